//! Lookup table for values of tiles, fast enough for every pixel of a page.

use deltille_core::lattice::{Orientation, Tile};

/// Values of tiles, as a table over all positions within their extent.
pub(crate) struct TileTable<T> {
    first: [i32; 2],
    /// Rows and columns.
    size: [usize; 2],
    /// Two positions per row and column: the inverted triangle, and the other tile.
    values: Vec<Option<T>>,
}

impl<T> TileTable<T> {
    pub(crate) fn new(tiles: impl Iterator<Item = (Tile, T)> + Clone) -> Self {
        let ends = |of: fn(&Tile) -> i32| {
            let values = || tiles.clone().map(|(tile, _)| of(&tile));
            let (least, most) = (values().min().unwrap_or(0), values().max().unwrap_or(-1));
            (least, (most - least + 1) as usize)
        };
        let (rows, cols) = (ends(|tile| tile.anchor.row), ends(|tile| tile.anchor.col));
        let values = std::iter::repeat_with(|| None).take(2 * rows.1 * cols.1).collect();
        let mut table = Self { first: [rows.0, cols.0], size: [rows.1, cols.1], values };
        for (tile, value) in tiles {
            if let Some(place) = table.place(tile) {
                table.values[place] = Some(value);
            }
        }
        table
    }

    fn place(&self, tile: Tile) -> Option<usize> {
        let index = |at: i32, first: i32| usize::try_from(at.checked_sub(first)?).ok();
        let row = index(tile.anchor.row, self.first[0])?;
        let col = index(tile.anchor.col, self.first[1])?;
        let other = usize::from(tile.orientation != Orientation::Inverted);
        (row < self.size[0] && col < self.size[1]).then_some(2 * (row * self.size[1] + col) + other)
    }

    pub(crate) fn get(&self, tile: Tile) -> Option<&T> {
        self.values[self.place(tile)?].as_ref()
    }
}
