//! Tests whether a pattern continues beyond the end of a grid.
//!
//! A board ends: beyond its last squares lies paper, a table, or an occluder, and none of these
//! follows the board's rows and columns. A screen of dots, a dither, a moiré or a field of random
//! cells shows checkerboard corners only where its dots happen to meet. Elsewhere its dots and gaps
//! continue at the same pitch. The test reads two rows of squares beyond every end of a grid. It
//! counts the pairs of neighbours in a row that differ like black and white.
//!
//! ```text
//!     ░░ ██ ░░ ██        ·  ·  ·  ·         squares of a grid (left), and what is beyond
//!     ██ ░░ ██ ░░        ·  ·  ·  ·         its last row: paper, of one brightness, or
//!     ──+──+──+──        ──+──+──+──        dots, which alternate as squares would
//!     ░░ ██ ░░ ██        ░░ ██ ░░ ██
//! ```
//!
//! Dots alternate everywhere, random cells half of the time, and the surroundings of boards in a few per cent of pairs.
//! Squares outside the image, or where another grid begins, are ignored.

use std::collections::BTreeMap;

use glam::DVec2;

use super::checker_tiles::{CheckerTiles, Point, Square, moved};
use crate::corners::buckets::Buckets;
use crate::tiling::{CHECKER, step};
use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::{Gray, ImageView};

/// Maximum fraction of pairs of squares beyond a board that differ like black and white.
const MAX_DIFFERENT: f64 = 0.2;

/// The same for complete boards of known size. Cluttered surroundings, seen by the few pairs around a small board, reach a
/// fifth; random cells that happen to have the size differ in half of the pairs. This is midway.
const MAX_DIFFERENT_BOARD: f64 = 0.35;

/// The same for grids that are rows of corners instead of an area. Random cells form rows more
/// easily.
const MAX_DIFFERENT_ROWS: f64 = 0.08;

/// The same beyond the complete squares of a grid. Single corners that stand apart may be the rest of a covered board,
/// with more of it visible beyond. They may also be gaps between dots, which all alternate.
const MAX_DIFFERENT_SQUARES: f64 = 0.6;

/// Minimum number of pairs for a decision.
const MIN_PAIRS: usize = 6;

/// Number of rows of squares that are tested beyond an end.
const ROWS: i32 = 2;

/// Distance from a corner of another grid, in edges, within which a square belongs to that grid.
const OTHER_GRID: f64 = 1.0;

/// Returns for each grid of an image whether its pattern continues beyond its end. `image` is the finest level, and
/// `is_board` whether a grid is a complete board of known size. Returns false for deltille grids, because six
/// alternating sectors do not occur by coincidence.
pub(crate) fn go_on(
    image: &Gray<i16>,
    grids: &[&Grid],
    is_board: impl Fn(usize) -> bool,
) -> Vec<bool> {
    let mut corners = Buckets::new(image.width(), image.height());
    let mut owners = Vec::new();
    let several = if grids.len() > 1 { grids } else { &[] };
    for (i, grid) in several.iter().enumerate() {
        for corner in &grid.corners {
            corners.insert(corner.position());
            owners.push(i);
        }
    }
    let goes_on = |(i, grid): (usize, &&Grid)| {
        let is_others = |place, reach| corners.within(place, reach).any(|(c, _)| owners[c] != i);
        let goes_on = |tiles: &CheckerTiles, most| tiles.goes_on(is_others, most);
        grid.kind == GridKind::Checker && {
            let all = CheckerTiles::of(image.into(), grid);
            let most = match all.is_compact() {
                true if is_board(i) => MAX_DIFFERENT_BOARD,
                true => MAX_DIFFERENT,
                false => MAX_DIFFERENT_ROWS,
            };
            goes_on(&all, most) || {
                let squares = all.without_loose_corners();
                let stand_apart = squares.corners.len() < all.corners.len();
                stand_apart && goes_on(&squares, MAX_DIFFERENT_SQUARES)
            }
        }
    };
    grids.iter().enumerate().map(goes_on).collect()
}

/// Returns whether an image shows on every side of a board that it ends there: the vertices beyond most corners of the
/// side lie in the image, where they have been searched for, and squares beyond a checkerboard do not alternate.
pub(crate) fn is_seen_to_end(image: ImageView, grid: &Grid) -> bool {
    let tiles = CheckerTiles::of(image, grid);
    let size = DVec2::new(image.width() as f64, image.height() as f64) - 1.0;
    let ends_at = |k: usize, step: Vertex| {
        let beyond = tiles.corners.iter().filter(|(v, _)| !tiles.has(**v + step));
        let beyond = beyond.filter_map(|(&v, &corner)| Some(2.0 * corner - tiles.at(v - step)?));
        let is_seen = |p: &Point| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all();
        let (count, seen) =
            beyond.fold((0, 0), |(all, seen), p| (all + 1, seen + usize::from(is_seen(&p))));
        2 * seen > count && (grid.kind == GridKind::Deltille || tiles.ends_on_side(k))
    };
    grid.kind.steps().iter().enumerate().all(|(k, &step)| ends_at(k, step))
}

impl CheckerTiles<'_> {
    /// Returns whether squares beyond the end in direction `k` are visible and do not alternate.
    fn ends_on_side(&self, k: usize) -> bool {
        let Some([even, odd]) = self.levels() else {
            return false;
        };
        let values = self.values_beyond(k, |_, _| false);
        let [pairs, different] = pairs(&values, along_end(k), (even - odd).abs());
        pairs > 0 && different as f64 <= MAX_DIFFERENT * pairs as f64
    }

    /// Returns whether at least a fraction `most` of the pairs of squares beyond the ends
    /// alternates. `is_others` returns whether a corner of another grid is within a distance of a
    /// position, px.
    fn goes_on(&self, is_others: impl Fn(Point, f64) -> bool, most: f64) -> bool {
        let Some([even, odd]) = self.levels() else {
            return false;
        };
        let contrast = (even - odd).abs();
        let (mut count, mut different) = (0, 0);
        for k in 0..CHECKER {
            let values = self.values_beyond(k, &is_others);
            let [all, unequal] = pairs(&values, along_end(k), contrast);
            count += all;
            different += unequal;
        }
        count >= MIN_PAIRS && different as f64 >= most * count as f64
    }

    /// Returns the brightness of the squares beyond the ends in direction `k`, by their lowest, leftmost vertices.
    fn values_beyond(
        &self,
        k: usize,
        is_others: impl Fn(Point, f64) -> bool,
    ) -> BTreeMap<Vertex, f64> {
        let mut squares: BTreeMap<Vertex, Vec<Square>> = BTreeMap::new();
        for (&vertex, &corner) in &self.corners {
            let Some(edges) = self.end(vertex, corner, k) else {
                continue;
            };
            for row in 1..=ROWS {
                for side in [0, -1] {
                    let near = vertex + times(step::<CHECKER>(k), row) + times(along_end(k), side);
                    let vertices = [near, near + along_end(k)];
                    let vertices =
                        vertices.map(|v| [v, v + step::<CHECKER>(k)]).into_iter().flatten();
                    let vertices: Vec<Vertex> = vertices.collect();
                    if vertices.iter().any(|v| self.corners.contains_key(v)) {
                        continue;
                    }
                    let by = DVec2::new(f64::from(row), f64::from(side)) + 0.5;
                    let middle = moved(corner, edges, by);
                    let first = vertices.into_iter().min();
                    let square = Square { middle, edges };
                    squares.entry(first.unwrap_or(near)).or_default().push(square);
                }
            }
        }
        let value = |(vertex, predicted): (Vertex, Vec<Square>)| {
            let count = predicted.len() as f64;
            let middle = predicted.iter().map(|square| square.middle).sum::<DVec2>() / count;
            let edges = predicted[0].edges;
            let reach_px = OTHER_GRID * edges[0].length();
            let value = self.value(Square { middle, edges })?;
            (!is_others(middle, reach_px)).then_some((vertex, value))
        };
        squares.into_iter().filter_map(value).collect()
    }

    /// Returns the edges at a corner behind which the grid ends in direction `k`: the one away from it, and one along
    /// its end.
    fn end(&self, vertex: Vertex, corner: Point, k: usize) -> Option<[Point; 2]> {
        let at = |v: Vertex| self.corners.get(&v).copied();
        let way = step::<CHECKER>(k);
        if at(vertex + way).is_some() {
            return None;
        }
        let before = at(vertex - way)?;
        let along = match (at(vertex + along_end(k)), at(vertex - along_end(k))) {
            (Some(next), Some(last)) => (next - last) / 2.0,
            (Some(next), None) => next - corner,
            (None, Some(last)) => corner - last,
            (None, None) => return None,
        };
        Some([corner - before, along])
    }
}

/// Returns the number of pairs of neighbours along a step, and the number of those that differ like black and white.
fn pairs(values: &BTreeMap<Vertex, f64>, along: Vertex, contrast: f64) -> [usize; 2] {
    let next =
        |(&square, value): (&Vertex, &f64)| Some((value - values.get(&(square + along))?).abs());
    values.iter().filter_map(next).fold([0, 0], |[all, different], difference| {
        [all + 1, different + usize::from(difference >= 0.5 * contrast)]
    })
}

/// Returns the step along an end in direction `k`, up or to the right.
fn along_end(k: usize) -> Vertex {
    step::<CHECKER>((k + 1) % 2)
}

fn times(step: Vertex, count: i32) -> Vertex {
    Vertex::new(count * step.row, count * step.col)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::detection::GridCorner;

    const EDGE_PX: f64 = 20.0;

    /// Creates a grid of 5 × 6 corners in the middle of an image.
    fn grid() -> Grid {
        let corner = |row: i32, col: i32| GridCorner {
            row,
            col,
            id: None,
            x: 100.0 + EDGE_PX * f64::from(col),
            y: 200.0 - EDGE_PX * f64::from(row),
            cov: None,
        };
        let corners = (0..5).flat_map(|row| (0..6).map(move |col| corner(row, col))).collect();
        Grid {
            kind: GridKind::Checker,
            target: None,
            panel: None,
            mirrored: false,
            corners,
            tags: Vec::new(),
        }
    }

    /// Renders squares inside the grid's outermost ones, and `beyond` outside.
    fn picture(beyond: impl Fn(i32, i32) -> i16) -> Gray<i16> {
        Gray::from_fn(300, 300, |x, y| {
            let col = ((x as f64 - 100.0) / EDGE_PX).floor() as i32;
            let row = ((200.0 - y as f64) / EDGE_PX).floor() as i32;
            let inside = (-1..5).contains(&row) && (-1..6).contains(&col);
            match inside {
                true if (row + col) % 2 == 0 => 100,
                true => 800,
                false => beyond(row, col),
            }
        })
    }

    fn goes_on(image: &Gray<i16>) -> bool {
        go_on(image, &[&grid()], |_| false) == [true]
    }

    #[test]
    fn paper_and_tables_end_a_board() {
        assert!(!goes_on(&picture(|_, _| 800)));
        assert!(!goes_on(&picture(|row, _| if row < 0 { 50 } else { 850 })));
        // A margin of one square, then something dark.
        let margin = |row, col| (-2..6).contains(&row) && (-2..7).contains(&col);
        assert!(!goes_on(&picture(|row, col| if margin(row, col) { 800 } else { 100 })));
    }

    #[test]
    fn dots_and_random_cells_go_on() {
        assert!(goes_on(&picture(|row, col| if (row + col) % 2 == 0 { 100 } else { 800 })));
        // Every second dot of every second row, as in a dither.
        assert!(goes_on(&picture(|row, col| {
            if row % 2 == 0 && col % 2 == 0 { 100 } else { 800 }
        })));
        let random = |row: i32, col: i32| (row * 7919 + col * 104_729).rem_euclid(101) % 2;
        assert!(goes_on(&picture(|row, col| if random(row, col) == 0 { 100 } else { 800 })));
    }

    #[test]
    fn clutter_beyond_the_margin_ends_a_board_of_known_size() {
        let margin = |row, col| (-2..6).contains(&row) && (-2..7).contains(&col);
        let is_dark = |row: i32, col: i32| (row * 7919 + col * 104_729).rem_euclid(127) % 2 == 0;
        let clutter = picture(|row, col| match margin(row, col) {
            false if is_dark(row, col) => 100,
            _ => 800,
        });
        assert!(goes_on(&clutter));
        assert_eq!(go_on(&clutter, &[&grid()], |_| true), [false]);
        let dots = picture(|row, col| if (row + col) % 2 == 0 { 100 } else { 800 });
        assert_eq!(go_on(&dots, &[&grid()], |_| true), [true]);
    }

    #[test]
    fn squares_of_another_grid_do_not_count() {
        let image = picture(|row, col| if (row + col) % 2 == 0 { 100 } else { 800 });
        let mut around = grid();
        around.corners.clear();
        for row in -4..9 {
            for col in -4..10 {
                if !(-1..6).contains(&row) || !(-1..7).contains(&col) {
                    let (x, y) =
                        (100.0 + EDGE_PX * f64::from(col), 200.0 - EDGE_PX * f64::from(row));
                    around.corners.push(GridCorner { row, col, id: None, x, y, cov: None });
                }
            }
        }
        assert!(!go_on(&image, &[&grid(), &around], |_| false)[0]);
    }
}
