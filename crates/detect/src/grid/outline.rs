//! Rows and columns of an entirely visible untagged board, from its outline.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use super::saddle_grid::SaddleGrid;
use deltille_core::lattice::{GridKind, LatticeMap, Vertex};

/// All corners of the only board to detect.
#[derive(Clone, Debug)]
pub(crate) struct WholeBoard {
    kind: GridKind,
    vertices: BTreeSet<Vertex>,
}

impl WholeBoard {
    /// Creates a board with corners at these vertices.
    pub(crate) fn new(kind: GridKind, vertices: impl IntoIterator<Item = Vertex>) -> Self {
        Self { kind, vertices: vertices.into_iter().collect() }
    }

    /// Returns the number of corners.
    pub(crate) fn corners(&self) -> usize {
        self.vertices.len()
    }

    /// Returns whether a grid has exactly the board's corners, in any rotation and shift.
    pub(crate) fn is_shown_by<S>(&self, grid: &BTreeMap<Vertex, S>) -> bool {
        grid.len() == self.vertices.len()
            && (0..self.kind.steps().len() as i32).any(|rotations| {
                let turned = LatticeMap::new(self.kind, rotations, Vertex::new(0, 0));
                let first = grid.keys().map(|&v| turned.apply(v)).min();
                let shift = self.vertices.first().zip(first).map(|(to, from)| *to - from);
                shift.is_some_and(|shift| {
                    let map = LatticeMap::new(self.kind, rotations, shift);
                    grid.keys().all(|&v| self.vertices.contains(&map.apply(v)))
                })
            })
    }
}

/// Returns the motion that maps a whole grid exactly onto an outline, if exactly one does. The
/// upright tiles of `inverted` boards are bright, so these boards are rotated by 180°.
pub(crate) fn fit_outline(
    grid: &SaddleGrid,
    outline: &BTreeSet<Vertex>,
    inverted: bool,
) -> Option<LatticeMap> {
    if grid.len() != outline.len() {
        return None;
    }
    let half_turn = if inverted { 3 } else { 0 };
    let mut fitting = [0, 2, 4].into_iter().filter_map(|rotations| {
        let turned = LatticeMap::new(GridKind::Deltille, rotations + half_turn, Vertex::new(0, 0));
        // Lowest-leftmost corners must coincide.
        let lowest = grid.keys().map(|&v| turned.apply(v)).min()?;
        let map =
            LatticeMap::new(GridKind::Deltille, rotations + half_turn, *outline.first()? - lowest);
        grid.keys().all(|&v| outline.contains(&map.apply(v))).then_some(map)
    });
    let map = fitting.next()?;
    fitting.next().is_none().then_some(map)
}

/// Returns the motion that labels a grid of a whole checkerboard.
///
/// A rectangle fits in two ways, a square in four. Row 0, column 0 is the lower left corner of the print, rotated so
/// that the square up and right of this corner is dark. If rows + columns is odd, this determines the orientation.
/// Otherwise both look the same, and (0, 0) is the corner that lies lowest in the image (then leftmost). On an
/// `inverted` board that square is bright.
pub(crate) fn fit_rectangle(
    grid: &SaddleGrid,
    [rows, cols]: [u32; 2],
    inverted: bool,
) -> Option<LatticeMap> {
    let (rows, cols) = (i32::try_from(rows).ok()?, i32::try_from(cols).ok()?);
    let low = grid.keys().fold((i32::MAX, i32::MAX), |(r, c), v| (r.min(v.row), c.min(v.col)));
    let high = grid.keys().fold((i32::MIN, i32::MIN), |(r, c), v| (r.max(v.row), c.max(v.col)));
    let size = (high.0 - low.0 + 1, high.1 - low.1 + 1);
    if grid.len() as i64 != i64::from(rows) * i64::from(cols) {
        return None;
    }
    // Quarter rotations of the labels relative to the grid's rows and columns: (0, 0) is then at
    // the lower left, lower right, upper right or upper left of the grid.
    let fitting = (0..4u8).filter(|rotations| {
        size == if rotations.is_multiple_of(2) { (rows, cols) } else { (cols, rows) }
    });
    let origin = move |rotations: u8| {
        let row = if rotations >= 2 { high.0 } else { low.0 };
        let col = if matches!(rotations, 1 | 2) { high.1 } else { low.1 };
        Vertex::new(row, col)
    };
    let best = fitting.max_by(|&a, &b| {
        let key = |rotations: u8| {
            let at = origin(rotations);
            // The square that the first row and column span at (0, 0), in the grid's labels.
            let square = (at.row - i32::from(rotations >= 2))
                + (at.col - i32::from(matches!(rotations, 1 | 2)));
            let place = grid.get(&at).map_or(DVec2::ZERO, |placed| placed.position);
            ((square.rem_euclid(2) == 0) != inverted, [place.y, -place.x])
        };
        key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
    })?;
    let back = -i32::from(best);
    Some(LatticeMap::taking(GridKind::Checker, origin(best), Vertex::new(0, 0), back))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::grid::saddle_grid::PlacedSaddle;

    /// An upright board: the lower left vertex of the print is `low`, with one pixel per column.
    fn board(rows: i32, cols: i32, low: Vertex, rotations: u8) -> SaddleGrid {
        let vertices = (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c)));
        vertices
            .map(|(r, c)| {
                let (row, col) = match rotations {
                    0 => (r, c),
                    1 => (c, -r),
                    2 => (-r, -c),
                    _ => (-c, r),
                };
                let position = DVec2::new(c.into(), -f64::from(r));
                (low + Vertex::new(row, col), PlacedSaddle { position, amplitude: 1.0 })
            })
            .collect()
    }

    proptest! {
        #[test]
        fn labels_are_those_of_the_print_however_the_grid_counts(
            rows in 2..7i32, cols in 2..7i32, row in -9..9i32, col in -9..9i32, rotations in 0..4u8,
            inverted: bool,
        ) {
            let grid = board(rows, cols, Vertex::new(row, col), rotations);
            let size = [rows as u32, cols as u32];
            let motion = fit_rectangle(&grid, size, inverted).unwrap();
            let map = |v| motion.apply(v);
            let labels: BTreeSet<Vertex> = grid.keys().map(|&v| map(v)).collect();
            prop_assert_eq!(labels.len(), grid.len());
            prop_assert_eq!(labels.first(), Some(&Vertex::new(0, 0)));
            prop_assert_eq!(labels.last(), Some(&Vertex::new(rows - 1, cols - 1)));
            // Not mirrored, and neighbours stay neighbours.
            let at = |label: Vertex| {
                let (_, placed) = grid.iter().find(|(v, _)| map(**v) == label).unwrap();
                placed.position
            };
            let (o, c, r) = (at(Vertex::new(0, 0)), at(Vertex::new(0, 1)), at(Vertex::new(1, 0)));
            let cross = (c[0] - o[0]) * (r[1] - o[1]) - (c[1] - o[1]) * (r[0] - o[0]);
            prop_assert_eq!(cross, -1.0);
            // The square at (0, 0) is dark if a rotation of the print can make it so.
            let of_square = |label: Vertex| {
                let corners = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(r, c)| label + Vertex::new(r, c));
                let on_grid = grid.keys().filter(|v| corners.contains(&map(**v)));
                let least = on_grid.fold((i32::MAX, i32::MAX), |m, v| (m.0.min(v.row), m.1.min(v.col)));
                (least.0 + least.1).rem_euclid(2) == 0
            };
            let dark = of_square(Vertex::new(0, 0));
            if (rows + cols) % 2 == 1 {
                prop_assert_eq!(dark, !inverted);
            } else if rows != cols {
                prop_assert_eq!(dark, of_square(Vertex::new(rows - 2, cols - 2)));
                prop_assert_eq!(o[1], 0.0, "the lower of the two");
            }
            prop_assert!(fit_rectangle(&grid, [size[0] + 1, size[1]], inverted).is_none());
        }
    }
}
