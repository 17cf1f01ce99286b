//! How much of the surroundings of a corner shows nothing but that corner.
//!
//! ```text
//!        2 ╱╲ 1        the six neighbours of a corner span a hexagon; its sides are the nearest
//!       ╱────────╲      other edges. With tags in the tiles, cells begin part of the way out.
//!    3 ╱    ·     ╲ 0
//!      ╲          ╱
//!     4 ╲────────╱ 5
//! ```
//!
//! On a checkerboard the four squares around a corner are bounded by its eight neighbours, with tags
//! in them by the lines that join the four nearest.

use std::collections::BTreeMap;

use super::detection::{Grid, GridCorner};
use crate::target::GridKind;

/// Steps to the neighbours in turn, by the tiling.
const HEXAGON: [(i32, i32); 6] = [(0, 1), (1, 0), (1, -1), (0, -1), (-1, 0), (-1, 1)];
const SQUARE: [(i32, i32); 8] =
    [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)];

/// The nearest neighbours on a checkerboard: between them lie the diagonals of the squares.
const DIAMOND: [(i32, i32); 4] = [(0, 1), (1, 0), (0, -1), (-1, 0)];

/// Blur of the next edges reaches this many standard deviations into the clear: beyond, an edge
/// changes what is seen by less than 2.5 % of its contrast.
const BLUR_MARGIN_SIGMAS: f64 = 2.0;

/// Half the side of the largest clear square around every corner of a grid, px, in their order.
///
/// `part` is the part of the way to the far side of a triangle, or to the diagonal of a square,
/// where its tag begins, 1 without tags; `blur_px` is the deviation of the blur.
/// A corner with no two neighbours in turn has none: 0.
pub fn clear_squares(grid: &Grid, part: f64, blur_px: f64) -> Vec<f64> {
    let steps: &[(i32, i32)] = match grid.kind {
        GridKind::Deltille => &HEXAGON,
        GridKind::Checker if part < 1.0 => &DIAMOND,
        GridKind::Checker => &SQUARE,
    };
    let places: BTreeMap<(i32, i32), [f64; 2]> =
        grid.corners.iter().map(|c| ((c.row, c.col), [c.x, c.y])).collect();
    let square = |&GridCorner { row, col, x, y, .. }: &GridCorner| {
        let seen =
            |(dr, dc): (i32, i32)| places.get(&(row + dr, col + dc)).map(|p| [p[0] - x, p[1] - y]);
        // A neighbour that is not there lies as far as the one opposite.
        let neighbour = |(dr, dc): (i32, i32)| {
            seen((dr, dc)).or_else(|| seen((-dr, -dc)).map(|p| [-p[0], -p[1]]))
        };
        let sides = (0..steps.len()).filter_map(|i| {
            Some(distance(neighbour(steps[i])?, neighbour(steps[(i + 1) % steps.len()])?))
        });
        let clear = sides.min_by(f64::total_cmp).unwrap_or(0.0);
        (part * clear - BLUR_MARGIN_SIGMAS * blur_px).max(0.0) * std::f64::consts::FRAC_1_SQRT_2
    };
    grid.corners.iter().map(square).collect()
}

/// Distance of the origin from the segment a–b.
fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let t = -(a[0] * along[0] + a[1] * along[1]) / length2.max(f64::MIN_POSITIVE);
    let t = t.clamp(0.0, 1.0);
    (a[0] + t * along[0]).hypot(a[1] + t * along[1])
}
