//! Rows and columns of an untagged board that is visible on every side, from its outline.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use super::map::local_map::{LocalMap, Shape};
use super::map::spacing::Spacing;
use super::saddle_grid::SaddleGrid;
use crate::tiling::CHECKER;
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

/// Returns the motion that maps a grid onto an outline, if exactly one does and every side of the outline is seen. The
/// upright tiles of `inverted` boards are bright, so these boards are rotated by 180°.
pub(crate) fn fit_outline(
    grid: &SaddleGrid,
    outline: &BTreeSet<Vertex>,
    inverted: bool,
) -> Option<LatticeMap> {
    let kind = GridKind::Deltille;
    let half_turn = if inverted { 3 } else { 0 };
    let mut fitting = [0, 2, 4].into_iter().flat_map(move |rotations| {
        let turned = LatticeMap::new(kind, rotations + half_turn, Vertex::new(0, 0));
        let shifts = shifts(grid.keys().map(move |&v| turned.apply(v)), outline.iter().copied());
        let map = move |shift| LatticeMap::new(kind, rotations + half_turn, shift);
        shifts.map(map).filter(|map| grid.keys().all(|&v| outline.contains(&map.apply(v))))
    });
    let map = fitting.next()?;
    let seen: BTreeSet<Vertex> = grid.keys().map(|&v| map.apply(v)).collect();
    let is_only = fitting.next().is_none();
    (is_only && shows_every_side(kind, &seen, outline)).then_some(map)
}

/// Returns the shifts after which the rows and columns of some vertices are among those of others.
fn shifts(
    vertices: impl Iterator<Item = Vertex>,
    among: impl Iterator<Item = Vertex>,
) -> impl Iterator<Item = Vertex> {
    let [[low, high], [least, most]] = [ends(vertices), ends(among)];
    let rows = least.row - low.row..=most.row - high.row;
    rows.flat_map(move |row| {
        (least.col - low.col..=most.col - high.col).map(move |col| Vertex::new(row, col))
    })
}

/// Returns the lowest row and column of some vertices, and the highest; zero if there are none.
fn ends(vertices: impl Iterator<Item = Vertex>) -> [Vertex; 2] {
    let each = |v: Vertex| [v, v];
    let wider = |[low, high]: [Vertex; 2], [v, _]: [Vertex; 2]| {
        [
            Vertex::new(low.row.min(v.row), low.col.min(v.col)),
            Vertex::new(high.row.max(v.row), high.col.max(v.col)),
        ]
    };
    vertices.map(each).reduce(wider).unwrap_or([Vertex::new(0, 0); 2])
}

/// Returns whether more than half of the corners on every side of an outline are seen. Single corners there may belong
/// to something else, while the real side is hidden.
fn shows_every_side(kind: GridKind, seen: &BTreeSet<Vertex>, outline: &BTreeSet<Vertex>) -> bool {
    kind.steps().iter().all(|&step| {
        let side = || outline.iter().filter(|&&v| !outline.contains(&(v + step)));
        2 * side().filter(|v| seen.contains(v)).count() > side().count()
    })
}

/// Returns the motion that labels a grid of a checkerboard of which every side is seen.
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
    let [low, high] = ends(grid.keys().copied());
    let size = (high.row - low.row + 1, high.col - low.col + 1);
    if size != (rows, cols) && size != (cols, rows) {
        return None;
    }
    let is_whole = grid.len() as i64 == i64::from(rows) * i64::from(cols);
    if !is_whole {
        let vertices = (low.row..=high.row)
            .flat_map(|row| (low.col..=high.col).map(move |col| Vertex::new(row, col)));
        let seen = grid.keys().copied().collect();
        if !shows_every_side(GridKind::Checker, &seen, &vertices.collect()) {
            return None;
        }
    }
    // Quarter rotations of the labels relative to the grid's rows and columns: (0, 0) is then at
    // the lower left, lower right, upper right or upper left of the grid.
    let fitting = (0..4u8).filter(|rotations| {
        size == if rotations.is_multiple_of(2) { (rows, cols) } else { (cols, rows) }
    });
    let origin = move |rotations: u8| {
        let row = if rotations >= 2 { high.row } else { low.row };
        let col = if matches!(rotations, 1 | 2) { high.col } else { low.col };
        Vertex::new(row, col)
    };
    let at = |v: Vertex| grid.get(&v).map(|placed| placed.position);
    let place = |v: Vertex| {
        let shape = Shape::usual(Spacing::EQUAL);
        let predicted = || LocalMap::about::<CHECKER>(v, at, shape).map(|map| map.place);
        at(v).or_else(predicted)
    };
    let keyed: Option<Vec<_>> = fitting
        .map(|rotations| {
            let at = origin(rotations);
            // The square that the first row and column span at (0, 0), in the grid's labels.
            let square = (at.row - i32::from(rotations >= 2))
                + (at.col - i32::from(matches!(rotations, 1 | 2)));
            let DVec2 { x, y } = place(at)?;
            Some((((square.rem_euclid(2) == 0) != inverted, [y, -x]), rotations))
        })
        .collect();
    let (_, best) =
        keyed?.into_iter().max_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(Ordering::Equal))?;
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

        #[test]
        fn a_missing_corner_changes_no_label(
            rows in 3..7i32, cols in 3..7i32, missing in 0..49usize, rotations in 0..4u8,
        ) {
            // The lowest corners of a square may be equally low.
            prop_assume!(rows != cols);
            let grid = board(rows, cols, Vertex::new(2, -5), rotations);
            let size = [rows as u32, cols as u32];
            let motion = fit_rectangle(&grid, size, false).unwrap();
            let mut seen = grid.clone();
            let vertex = *grid.keys().nth(missing % grid.len()).unwrap();
            seen.remove(&vertex);
            let of_rest = fit_rectangle(&seen, size, false).unwrap();
            prop_assert!(grid.keys().all(|&v| of_rest.apply(v) == motion.apply(v)));
            // Without a row, or with a single corner of it, more than one placement may be right.
            let mut cut = grid.clone();
            let low = grid.keys().next().unwrap().row;
            let keep = grid.keys().find(|v| v.row == low).copied();
            for rest in [keep, None] {
                cut.retain(|&v, _| v.row != low || Some(v) == rest);
                prop_assert!(fit_rectangle(&cut, size, false).is_none());
            }
        }
    }

    #[test]
    fn a_deltille_board_with_a_gap_fits_in_one_place_or_has_no_labels() {
        use deltille_core::targets::board_vertices;
        let outline: BTreeSet<Vertex> =
            board_vertices(GridKind::Deltille, 6, 7).into_iter().collect();
        let placed = PlacedSaddle { position: DVec2::ZERO, amplitude: 1.0 };
        let turned = LatticeMap::new(GridKind::Deltille, 2, Vertex::new(3, -4));
        let whole: SaddleGrid = outline.iter().map(|&v| (turned.apply(v), placed)).collect();
        let map = fit_outline(&whole, &outline, false).unwrap();
        for &missing in whole.keys() {
            let mut seen = whole.clone();
            seen.remove(&missing);
            assert_eq!(fit_outline(&seen, &outline, false), Some(map), "{missing:?}");
        }
        let part = |row| {
            let seen = outline.iter().filter(|v| v.row != row);
            seen.map(|&v| (turned.apply(v), placed)).collect::<SaddleGrid>()
        };
        assert_eq!(fit_outline(&part(0), &outline, false), None);
        assert_eq!(fit_outline(&part(5), &outline, false), None);
    }
}
