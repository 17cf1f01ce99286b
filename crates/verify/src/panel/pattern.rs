//! The expected appearance of every point of a panel: its tiles, and the cells of their tags.

use std::collections::BTreeMap;

use glam::{DMat2, DVec2};

use crate::panel::tile_table::TileTable;
use deltille_core::family::Family;
use deltille_core::lattice::{Cell, GridKind, TagCells, Tile};
use deltille_core::targets::{Panel, TagPlacement};

/// Pixels closer than this to a change of colour are ignored, px: the half diagonal of a pixel (0.71), over which an
/// edge is smeared, 0.02 mm at 300 dpi (0.24), and some blur.
pub(crate) const EDGE_PX: f64 = 1.25;

/// Number of directions in which an edge is searched for beside a pixel: enough that no 60° tip of a tile or cell
/// fits between two of them and reaches the pixel.
pub(crate) const PROBES: u32 = 24;

/// The expected appearance of a tile.
pub(crate) struct Expected<'a> {
    /// Whether the tile is black, as a whole or around its tag.
    pub black: bool,
    /// Whether black and white are swapped.
    inverted: bool,
    pub tag: Option<ExpectedTag<'a>>,
}

impl Expected<'_> {
    /// Whether the tile is black at tile coordinates.
    pub(crate) fn is_black_at(&self, p: DVec2) -> bool {
        let Some(tag) = &self.tag else { return self.black };
        match tag.looks.region(p) {
            Region::Margin => self.black,
            Region::Border => !self.inverted,
            Region::Hole => self.inverted,
            Region::Cell(bit) => (tag.word >> bit & 1 == 0) != self.inverted,
        }
    }
}

/// Returns the expected appearance of all tiles of a panel; `family` is that of its tiling.
pub(crate) fn expected<'a>(
    panel: &Panel,
    family: Option<&Family>,
    looks: Option<&'a TagLooks>,
) -> BTreeMap<Tile, Expected<'a>> {
    let tags: BTreeMap<Tile, TagPlacement> =
        panel.tags.iter().map(|tag| (panel.tag_tile(tag), *tag)).collect();
    let expected = panel.tiles().into_iter().map(|tile| {
        let tag = tags.get(&tile).and_then(|&placement| {
            let word = family?.code(placement.id)?;
            Some(ExpectedTag { placement, word, looks: looks? })
        });
        let inverted = panel.inverted;
        (tile, Expected { black: tile.is_dark() != inverted, inverted, tag })
    });
    expected.collect()
}

/// The colours of a panel at every point.
pub(crate) struct Pattern<'a> {
    panel: &'a Panel,
    table: TileTable<&'a Expected<'a>>,
}

impl<'a> Pattern<'a> {
    pub(crate) fn new(panel: &'a Panel, expected: &'a BTreeMap<Tile, Expected<'a>>) -> Self {
        let table = TileTable::new(expected.iter().map(|(&tile, expected)| (tile, expected)));
        Self { panel, table }
    }

    /// Whether a point of the panel, in edges, lies in a tile.
    pub(crate) fn has_tile_at(&self, at: DVec2) -> bool {
        self.table.get(self.panel.tile_at(at)).is_some()
    }

    /// Whether the panel is black at a point, in edges. Outside the tiles that is the colour of its field.
    pub(crate) fn is_black_at(&self, at: DVec2) -> bool {
        let tile = self.panel.tile_at(at);
        let Some(expected) = self.table.get(tile) else { return self.panel.inverted };
        if expected.tag.is_none() {
            return expected.black;
        }
        let (origin, tile_from_panel) = self.tile_coordinates(tile);
        expected.is_black_at(tile_from_panel * (at - origin))
    }

    /// Returns how far the colour at a point, in edges, certainly stays the same along `way`, as a multiple of it.
    pub(crate) fn same_along(&self, at: DVec2, way: DVec2) -> f64 {
        let tile = self.panel.tile_at(at);
        let (origin, tile_from_panel) = self.tile_coordinates(tile);
        let (mut p, mut way) = (tile_from_panel * (at - origin), tile_from_panel * way);
        if let Some(tag) = self.table.get(tile).and_then(|expected| expected.tag.as_ref()) {
            if tag.looks.hole.is_some() || tag.looks.bit(p).is_none() {
                return 0.0;
            }
            p = (p * tag.looks.width - tag.looks.inset).fract();
            way *= tag.looks.width;
            if self.panel.kind == GridKind::Deltille && p.element_sum() >= 1.0 {
                (p, way) = (1.0 - p, -way);
            }
        }
        // Beyond the sides along the axes, and the opposite ones.
        let (rest, shrinks_by) = match self.panel.kind {
            GridKind::Checker => (1.0 - p, -way),
            GridKind::Deltille => {
                (DVec2::splat(1.0 - p.element_sum()), DVec2::splat(-way.element_sum()))
            }
        };
        let sides = [(p.x, way.x), (p.y, way.y), (rest.x, shrinks_by.x), (rest.y, shrinks_by.y)];
        let ends = sides.map(|(from, by)| if by < 0.0 { from / -by } else { f64::INFINITY });
        ends.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the origin of the coordinates of a tile, in edges, and the map to them.
    fn tile_coordinates(&self, tile: Tile) -> (DVec2, DMat2) {
        let [a, b, c] = tile.frame().map(|vertex| self.panel.position(vertex));
        (a, DMat2::from_cols(b - a, c - a).inverse())
    }
}

pub(crate) struct ExpectedTag<'a> {
    pub placement: TagPlacement,
    pub word: u64,
    pub looks: &'a TagLooks,
}

/// The positions of the tag cells of a panel, in tile coordinates.
pub(crate) struct TagLooks {
    pub cells: TagCells,
    /// Distance from the edges of the tile to the border, and to the cells, bit widths.
    margin: f64,
    pub inset: f64,
    /// Edge of the tile, bit widths.
    pub width: f64,
    /// Radius of the hole in the centre of a triangle, edges.
    hole: Option<f64>,
    /// Bit of each cell, in rows of `columns` positions, two per column: inverted, upright.
    bits: Vec<Option<u32>>,
    columns: usize,
}

/// A part of a tile with a tag.
#[derive(Clone, Copy, PartialEq)]
enum Region {
    Margin,
    Border,
    Cell(u32),
    Hole,
}

impl TagLooks {
    pub(crate) fn new(family: &Family, panel: &Panel) -> Self {
        let cells = family.cells();
        let (margin, inset) = (panel.tag_margin_bits(), panel.tag_inset_bits());
        let most = |of: fn(&Cell) -> u32| {
            cells.cells().iter().map(of).max().map_or(0, |most| most as usize + 1)
        };
        let columns = most(|cell| cell.col);
        let mut bits = vec![None; most(|cell| cell.row) * columns * 2];
        for (bit, cell) in (0..).zip(cells.cells()) {
            let place = cell.row as usize * columns + cell.col as usize;
            bits[2 * place + usize::from(cell.upright)] = Some(bit);
        }
        let width = cells.width(inset);
        let hole = panel.hole_mm.map(|diameter| diameter / 2.0 / panel.edge_mm);
        Self { cells, margin, inset, width, hole, bits, columns }
    }

    /// Returns the region at tile coordinates.
    fn region(&self, p: DVec2) -> Region {
        if let Some(radius) = self.hole {
            // The edges along the coordinate axes meet at 60°.
            let from_middle = p - 1.0 / 3.0;
            let squared = from_middle.length_squared() + from_middle.x * from_middle.y;
            if squared < radius * radius {
                return Region::Hole;
            }
        }
        if let Some(bit) = self.bit(p) {
            return Region::Cell(bit);
        }
        // Only squares have a margin.
        let margin = self.margin / self.width;
        match p.min_element() >= margin && p.max_element() <= 1.0 - margin {
            true => Region::Border,
            false => Region::Margin,
        }
    }

    /// Returns the bit of the cell at tile coordinates (u, v), `None` outside the cells.
    pub(crate) fn bit(&self, p: DVec2) -> Option<u32> {
        let DVec2 { x: u, y: v } = p * self.width - self.inset;
        if u < 0.0 || v < 0.0 {
            return None;
        }
        let upright = self.cells.kind() == GridKind::Checker || u.fract() + v.fract() < 1.0;
        let (row, col) = (v as usize, u as usize);
        if col >= self.columns {
            return None;
        }
        let place = row * self.columns + col;
        self.bits.get(2 * place + usize::from(upright)).copied().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::targets::{BoardSpec, Target};

    #[test]
    fn the_colour_stays_the_same_as_far_as_stated() {
        for (kind, family) in
            [(GridKind::Deltille, "delTag25h7"), (GridKind::Checker, "aprilTag36h11")]
        {
            let family = Family::shipped(family).unwrap();
            let target = Target::new("board", BoardSpec::new(kind, 4, 5, 20.0)).unwrap();
            let panel = &target.panels[0];
            let looks = TagLooks::new(&family, panel);
            let expected = expected(panel, Some(&family), Some(&looks));
            let pattern = Pattern::new(panel, &expected);
            let mut stated = 0;
            for n in 0..4000 {
                let n = f64::from(n);
                // Irrational steps spread the positions evenly.
                let at =
                    DVec2::new((n * 0.618_034).fract() * 7.0, (n * 0.754_878).fract() * 5.0) - 1.0;
                let way = 0.01 * DVec2::from_angle(n);
                let same = pattern.same_along(at, way).min(100.0);
                let colours = (0..20)
                    .map(|i| pattern.is_black_at(at + 0.999 * f64::from(i) / 19.0 * same * way));
                let black = pattern.is_black_at(at);
                assert!(colours.into_iter().all(|colour| colour == black), "{at}, {way}");
                stated += u32::from(same >= 1.0);
            }
            assert!(stated > 3000, "{stated}");
        }
    }
}
