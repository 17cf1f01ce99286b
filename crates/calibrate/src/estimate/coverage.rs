//! Numbers of corners in the parts of an image, for estimates that do not list the corners
//! themselves.

use std::collections::BTreeMap;

use glam::DVec2;

/// Number of cells along the longer side of the image.
const CELLS: f64 = 40.0;

/// Number of cells along the side of a block.
const BLOCK: u32 = 4;

/// Numbers of corners in the cells of an image, without outliers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    columns: usize,
    rows: usize,
    counts: Vec<u32>,
}

impl Coverage {
    /// Creates a coverage from counts, row by row from the top; `None` unless there is exactly one
    /// count for each cell.
    pub fn new(columns: usize, rows: usize, counts: Vec<u32>) -> Option<Self> {
        let is_whole = columns.checked_mul(rows) == Some(counts.len());
        is_whole.then_some(Self { columns, rows, counts })
    }

    /// Counts corners at these positions in an image of this size, px.
    pub(super) fn counted(size: DVec2, corners: impl Iterator<Item = DVec2>) -> Self {
        let cells = (size * CELLS / size.max_element()).round().max(DVec2::ONE);
        let (columns, rows) = (cells.x as usize, cells.y as usize);
        let mut counts = vec![0; columns * rows];
        for at in corners.map(|pixel| (pixel + 0.5) / size * cells) {
            let [column, row] = [(at.x.max(0.0), columns), (at.y.max(0.0), rows)]
                .map(|(at, cells)| (at as usize).min(cells - 1));
            counts[row * columns + column] += 1;
        }
        Self { columns, rows, counts }
    }

    /// Whether no corners are known.
    pub(crate) fn is_empty(&self) -> bool {
        self.counts.iter().all(|count| *count == 0)
    }

    /// Number of cells along a row, and number of rows.
    pub fn cells(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Number of corners in each cell, row by row from the top.
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// The centre, px, and the number of corners of each non-empty cell, for an image of this size.
    pub(crate) fn places(&self, size: DVec2) -> impl Iterator<Item = (DVec2, u32)> {
        let step = size / DVec2::new(self.columns as f64, self.rows as f64);
        let seen = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        seen.map(move |(index, &count)| {
            let (row, column) = (index / self.columns, index % self.columns);
            (step * (DVec2::new(column as f64, row as f64) + 0.5) - 0.5, count)
        })
    }

    /// Whether corners were detected in the block of cells at a position, px, in an image of this size.
    pub(crate) fn has_corners(&self, place: DVec2, size: DVec2) -> bool {
        let block = |place: DVec2| ((place + 0.5) / self.block(size)).as_ivec2();
        self.places(size).any(|(other, _)| block(other) == block(place))
    }

    /// The size of a block of cells in an image of this size, px.
    fn block(&self, size: DVec2) -> DVec2 {
        size * f64::from(BLOCK) / DVec2::new(self.columns as f64, self.rows as f64)
    }

    /// The centres of gravity, px, and the numbers of corners of blocks of cells: at most 10 × 10 positions that represent the corners
    /// of an image of this size.
    pub(crate) fn blocks(&self, size: DVec2) -> Vec<(DVec2, f64)> {
        let mut blocks = BTreeMap::new();
        for (place, count) in self.places(size) {
            let block = ((place + 0.5) / self.block(size)).as_ivec2().to_array();
            let (sum, all) = blocks.entry(block).or_insert((DVec2::ZERO, 0.0));
            *sum += place * f64::from(count);
            *all += f64::from(count);
        }
        blocks.into_values().map(|(sum, all)| (sum / all, all)).collect()
    }
}
