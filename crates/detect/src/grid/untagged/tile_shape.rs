//! Tests whether the tiles of an untagged checkerboard are squares.
//!
//! Let a and b run from 0 to 1 along and across a square. A board shows the product of two profiles, whose waves are
//!
//! ```text
//!     f(a, b) = Σ F_jk sin(πja) sin(πkb),     j, k odd
//! ```
//!
//! with F_jk = F_j F_k. F_3 is a third of F_1, reduced by blur. A sum of two waves of any slant has corners like a
//! blurred board, but its F_3 vanishes along and across; in a slanted board, blur removes F_3 in one direction first.
//! Round dots have waves along and across, but a negative F_33, because they leave the corners of the squares.
//!
//! Random cells and those of a dither are squares. A few of them that happen to alternate form rows of corners rather
//! than areas. Many of them alternate except for isolated ones among the others, while the outline
//! of an occluder seldom follows a square on all four sides.

use std::collections::BTreeSet;

use super::checker_tiles::{CheckerTiles, Point, Square, WholeSquare, parity};
use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::ImageView;

/// Number of whole squares of the smallest board, of 3 × 3 corners.
const MIN_SQUARES: usize = 4;

/// Minimum F_3, relative to F_1. The model mistakes a wave for a blur of a quarter of an edge. Such
/// a blur leaves an F_3 of 0.028; a wave has none.
const WAVE: f64 = 0.02;

/// Maximum F_3 of plain squares, relative to F_1; tags have more.
const PLAIN: f64 = 1.0 / 3.0;

/// Minimum F_33 of squares, relative to its ideal value, the product of F_3 along and across.
const MIN_PRODUCT: f64 = 0.5;

/// Displacement of the edges above which F_3 of all squares is less than two thirds of its value.
pub(crate) const LARGE_INK: f64 = 0.05;

/// Tolerance of these limits, in standard deviations, measured by waves that tiles of boards and dots do not have.
const DEVIATIONS: f64 = 3.0;

/// Fewer isolated squares of the wrong colour than this count as dirt, whatever the number of
/// whole squares.
const MIN_WRONG: usize = 3;

/// The same as a fraction of the whole squares.
const WRONG_PART: f64 = 1.0 / 16.0;

/// Minimum approach of a square to the wrong colour, as a fraction of the distance from the right one.
const WRONG: f64 = 0.75;

/// Number of samples along and across a square.
const SAMPLES: usize = 8;

/// Returns whether an untagged grid consists of squares, after refinement of its corners. Its dark areas have grown by
/// `ink` edges on every side. Returns true for deltille grids.
pub(crate) fn is_of_squares(image: ImageView, grid: &Grid, ink: f64, may_have_tags: bool) -> bool {
    if grid.kind == GridKind::Deltille {
        return true;
    }
    let tiles = CheckerTiles::of(image, grid);
    let count = tiles.whole_squares().count();
    count >= MIN_SQUARES
        && has_few_wrong_squares(&tiles, count)
        && Waves::of(&tiles, ink).is_none_or(|waves| waves.are_of_squares(may_have_tags))
}

/// Amplitudes of other waves, relative to F_11.
#[derive(Clone, Copy, Debug)]
struct Waves {
    along: f64,
    across: f64,
    both: f64,
    /// Standard deviation of each due to noise and to errors of the corner positions, from waves
    /// whose two halves differ.
    noise: f64,
}

impl Waves {
    /// Measures the whole squares together. If ink has moved their edges far, only those that have shrunk are measured,
    /// each within its edges: the profile of all squares together has no F_3 if the edges move by a sixth.
    fn of(tiles: &CheckerTiles, ink: f64) -> Option<Self> {
        let part = |i: usize| (i as f64 + 0.5) / SAMPLES as f64;
        let mut mean = [[0.0; SAMPLES]; SAMPLES];
        let levels = tiles.levels().unwrap_or_default();
        let [even, odd] = levels;
        let shrunk =
            (ink.abs() > LARGE_INK).then_some(usize::from((even < odd) == (ink < 0.0)) ^ 1);
        // Squares that have shrunk lie in an area of the other colour.
        let around = shrunk.map_or((even + odd) / 2.0, |of| levels[1 - of]);
        let size = shrunk.map_or(1.0, |_| 1.0 - 2.0 * ink.abs());
        let place = |i: usize| 0.5 + size * (part(i) - 0.5);
        let is_measured =
            |square: &WholeSquare| shrunk.is_none_or(|of| parity(square.vertex) == of);
        for square in tiles.whole_squares().filter(is_measured) {
            let sign = [1.0, -1.0][parity(square.vertex)];
            for (i, row) in mean.iter_mut().enumerate() {
                for (j, sum) in row.iter_mut().enumerate() {
                    // At the border of the image, a part of a square has no information.
                    let value = tiles.brightness(square.place(place(j), place(i)));
                    *sum += sign * value.map_or(0.0, |value| value - around);
                }
            }
        }
        let wave = |along: usize, across: usize| {
            let sine = |k: usize, i: usize| (k as f64 * std::f64::consts::PI * part(i)).sin();
            let row = |(i, row): (usize, &[f64; SAMPLES])| {
                let along: f64 = row.iter().enumerate().map(|(j, v)| v * sine(along, j)).sum();
                along * sine(across, i)
            };
            mean.iter().enumerate().map(row).sum::<f64>()
        };
        let whole = wave(1, 1);
        let nothing = [(2, 2), (2, 4), (4, 2), (4, 4)].map(|(along, across)| wave(along, across));
        let square: f64 = nothing.iter().map(|v| v * v).sum();
        (whole != 0.0).then(|| Self {
            along: wave(3, 1) / whole,
            across: wave(1, 3) / whole,
            both: wave(3, 3) / whole,
            noise: (square / nothing.len() as f64).sqrt() / whole.abs(),
        })
    }

    fn are_of_squares(self, may_have_tags: bool) -> bool {
        let most = self.along.max(self.across);
        let is_plain = !may_have_tags && most <= PLAIN;
        let least = MIN_PRODUCT * self.along * self.across - DEVIATIONS * self.noise;
        most >= WAVE && !(is_plain && self.both < least)
    }
}

/// Returns whether there are few isolated squares of the wrong colour among others.
fn has_few_wrong_squares(tiles: &CheckerTiles, whole: usize) -> bool {
    let Some(levels) = tiles.levels() else {
        return true;
    };
    // Those above a corner, to its right and to its left.
    let above = |v: &Vertex| [0, -1].map(|col| *v + Vertex::new(1, col));
    let places: BTreeSet<Vertex> = tiles.corners.keys().flat_map(above).collect();
    let is_wrong = |&vertex: &Vertex| {
        let value = single(tiles, vertex).and_then(|square| tiles.value(square));
        let (right, wrong) = (levels[parity(vertex)], levels[1 - parity(vertex)]);
        value.is_some_and(|value| (value - right) / (wrong - right) >= WRONG)
    };
    let wrong = places.into_iter().filter(is_wrong).count();
    wrong < MIN_WRONG || (wrong as f64) < WRONG_PART * whole as f64
}

/// Returns the square at a vertex, if none of its corners is known and some are on each of its sides.
fn single(tiles: &CheckerTiles, vertex: Vertex) -> Option<Square> {
    let at = |row, col| tiles.at(vertex + Vertex::new(row, col));
    let own = [(0, 0), (0, 1), (1, 0), (1, 1)];
    if own.into_iter().any(|(row, col)| at(row, col).is_some()) {
        return None;
    }
    // Positions on opposite sides have the square's centre between them, three edges apart on the print.
    let opposite = |from: Option<Point>, to: Option<Point>| Some((from?, to?));
    let below = opposite(at(-1, 0), at(2, 1)).or_else(|| opposite(at(-1, 1), at(2, 0)));
    let beside = opposite(at(0, -1), at(1, 2)).or_else(|| opposite(at(1, -1), at(0, 2)));
    let (up, right) = (below?, beside?);
    let middle = (up.0 + up.1 + right.0 + right.1) / 4.0;
    let edges = [right, up].map(|(from, to)| (to - from) / 3.0);
    Some(Square { middle, edges })
}
