//! What is known of the corners of a grid, by row and column.

use super::detection::{Grid, GridCorner};
use crate::lattice::Vertex;

/// One thing for each corner, in the rectangle of rows and columns that they span.
pub struct ByVertex<T> {
    first: Vertex,
    cols: usize,
    items: Vec<Option<T>>,
}

impl<T: Copy> ByVertex<T> {
    /// Of every corner of a grid what `of` makes of it.
    pub fn of<'a>(grid: &'a Grid, of: impl Fn(&'a GridCorner) -> T) -> Self {
        let range = |of: fn(&GridCorner) -> i32| {
            let values = || grid.corners.iter().map(of);
            let first = values().min().unwrap_or(0);
            (first, values().max().map_or(0, |last| (last - first) as usize + 1))
        };
        let ((row, rows), (col, cols)) = (range(|c| c.row), range(|c| c.col));
        let mut found = Self { first: Vertex::new(row, col), cols, items: vec![None; rows * cols] };
        for corner in &grid.corners {
            if let Some(at) = found.index(Vertex::new(corner.row, corner.col)) {
                found.items[at] = Some(of(corner));
            }
        }
        found
    }

    /// What is known of a vertex.
    pub fn get(&self, vertex: Vertex) -> Option<T> {
        *self.items.get(self.index(vertex)?)?
    }

    fn index(&self, vertex: Vertex) -> Option<usize> {
        let Vertex { row, col } = vertex - self.first;
        let (row, col) = (usize::try_from(row).ok()?, usize::try_from(col).ok()?);
        (col < self.cols).then_some(row * self.cols + col)
    }
}
