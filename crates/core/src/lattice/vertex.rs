use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::ROW_HEIGHT;

/// A vertex of the triangular lattice, by row and column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Vertex {
    /// Lattice row, counted upwards on the print.
    pub row: i32,
    /// Lattice column, counted to the right along a row.
    pub col: i32,
}

impl Vertex {
    /// Steps to the six neighbours, counterclockwise on the print, starting along the row.
    pub const STEPS: [Vertex; 6] = [
        Vertex::new(0, 1),
        Vertex::new(1, 0),
        Vertex::new(1, -1),
        Vertex::new(0, -1),
        Vertex::new(-1, 0),
        Vertex::new(-1, 1),
    ];

    /// Creates the vertex at `row`, `col`.
    pub const fn new(row: i32, col: i32) -> Self {
        Self { row, col }
    }

    /// Returns the position in the plane, in units of the edge length: x right, y up.
    pub fn position(self) -> DVec2 {
        let (row, col) = (f64::from(self.row), f64::from(self.col));
        DVec2::new(col + 0.5 * row, row * ROW_HEIGHT)
    }

    /// Returns the six neighbours, counterclockwise, starting along the row.
    pub fn neighbours(self) -> [Vertex; 6] {
        Self::STEPS.map(|step| self + step)
    }
}

impl std::ops::Add for Vertex {
    type Output = Vertex;

    fn add(self, other: Vertex) -> Vertex {
        Vertex::new(self.row + other.row, self.col + other.col)
    }
}

impl std::ops::Sub for Vertex {
    type Output = Vertex;

    fn sub(self, other: Vertex) -> Vertex {
        Vertex::new(self.row - other.row, self.col - other.col)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_six_neighbours_are_one_edge_away_and_60_degrees_apart() {
        for (i, step) in Vertex::STEPS.into_iter().enumerate() {
            let angle = std::f64::consts::FRAC_PI_3 * i as f64;
            assert!(step.position().abs_diff_eq(DVec2::from_angle(angle), 1e-12));
        }
    }
}
