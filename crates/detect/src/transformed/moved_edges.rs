//! Detects boards whose edges have moved: blooming, bleeding ink or compression made all dark tiles larger or smaller.
//!
//! Dark tiles that meet diagonally at a corner then overlap or leave a gap. A fine level of the pyramid shows the gap
//! instead of a corner. On a coarse level it is small compared with the blur, so the corner is visible, but the gap
//! still shifts the brightness of the centre. A minimum or maximum over neighbours moves all edges back by a pixel.
//! On the level on which a tile has 12 to 24 px, two pixels are 8 to 16 % of the tile, and corners tolerate another pixel.
//!
//! ```text
//!     ███████        ███████           ███████
//!     ███████   →    ███████    min    ████████
//!     ███████        ███████    →      ████████
//!            ░░░░░           ░█████        ░████
//!             █████           █████         █████
//! ```

use rayon::prelude::*;

use crate::corners::saddles::{SaddleFinder, is_all_noise};
use crate::grid::grids::grids;
use crate::grid::links::link::has_chain;
use crate::grid::outline::WholeBoard;
use crate::grid::saddle_grid::SaddleGrid;
use crate::levels::MIN_LEVEL_SIDE;
use crate::tiling::CHECKER;
use deltille_core::raster::{Gray, Pyramid};

/// Number of corners by which a grid may exceed the whole board that another view shows: tips of tiles beyond its border.
/// A larger board exceeds it by a whole row.
const FALSE_CORNERS: usize = 2;

/// Returns the grids of the level and the displacement that show the whole board or the largest grid, in px of level 0.
pub(crate) fn grids_of_moved_edges<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    whole: Option<&WholeBoard>,
) -> Vec<SaddleGrid> {
    let of_level = |level: usize| -> Vec<View> {
        let coarse = pyramid.from_level(level);
        let seen = |image: &Gray<i16>| {
            // Its first level is blurred, so that gaps of a pixel close.
            let blurred = Pyramid::new(image, coarse.levels().len(), MIN_LEVEL_SIDE);
            let saddles = finder.find(&blurred);
            let mut grids = grids(finder, &blurred, &saddles, whole);
            for placed in grids.iter_mut().flat_map(|grid| grid.values_mut()) {
                placed.position = Pyramid::to_level_0(level, placed.position);
            }
            View { grids, has_chain: has_chain(&blurred, &saddles) }
        };
        let image = &coarse.levels()[0];
        let ways: [&(dyn Fn() -> Vec<View> + Sync); 3] = [
            &|| vec![seen(image)],
            &|| in_steps::<N>(image, i16::min).iter().map(seen).collect(),
            &|| in_steps::<N>(image, i16::max).iter().map(seen).collect(),
        ];
        ways.into_par_iter().flat_map_iter(|way| way()).collect()
    };
    let (mut best, mut may_be_finer) = (Vec::new(), true);
    let worth = |grids: &[SaddleGrid]| {
        let is_whole = |grid| whole.is_some_and(|whole| whole.is_shown_by(grid));
        grids.first().map_or(0, |grid| grid.len() + if is_whole(grid) { FALSE_CORNERS } else { 0 })
    };
    for level in (1..pyramid.levels().len()).rev() {
        // The finest level takes most of the time. On the next one, the tiles of its boards have half as many pixels, and
        // some of their corners are already joined.
        if is_all_noise(&pyramid.levels()[level]) || level == 1 && !may_be_finer {
            continue;
        }
        let views = of_level(level);
        may_be_finer = views.iter().any(|view| view.has_chain);
        // Of equally good ones, the finest level.
        let largest = views.into_iter().map(|view| view.grids).max_by_key(|grids| worth(grids));
        best = largest.filter(|grids| worth(grids) >= worth(&best)).unwrap_or(best);
    }
    best
}

/// What an image shows whose edges have been moved.
struct View {
    grids: Vec<SaddleGrid>,
    /// Whether corners are joined, as on a board.
    has_chain: bool,
}

/// Returns images whose edges have been moved by one and by two pixels.
fn in_steps<const N: usize>(
    image: &Gray<i16>,
    filter: impl Fn(i16, i16) -> i16 + Copy,
) -> [Gray<i16>; 2] {
    // The gap between two squares is closed along its diagonal. Around a triangle, all edges have to move equally.
    let first = if N == CHECKER { Neighbours::Eight } else { Neighbours::Four };
    let by_one = with_moved_edges(image, first, filter);
    let by_two = with_moved_edges(&by_one, Neighbours::Eight, filter);
    [by_one, by_two]
}

/// The pixels around one that replace it.
#[derive(PartialEq)]
enum Neighbours {
    Four,
    Eight,
}

/// Returns an image with the minimum or maximum over its neighbours at each pixel.
fn with_moved_edges(
    image: &Gray<i16>,
    neighbours: Neighbours,
    filter: impl Fn(i16, i16) -> i16 + Copy,
) -> Gray<i16> {
    let height = image.height();
    let mut along = image.clone();
    for y in 0..height {
        let (row, out) = (image.row(y), along.row_mut(y));
        for (out, next) in out.iter_mut().zip(&row[1..]) {
            *out = filter(*out, *next);
        }
        for (out, before) in out[1..].iter_mut().zip(row) {
            *out = filter(*out, *before);
        }
    }
    let mut both = along.clone();
    let beside = if neighbours == Neighbours::Four { image } else { &along };
    for y in 0..height {
        let [above, below] = [beside.row(y.saturating_sub(1)), beside.row((y + 1).min(height - 1))];
        let row = both.row_mut(y);
        for (out, (&above, &below)) in row.iter_mut().zip(above.iter().zip(below)) {
            *out = filter(filter(above, *out), below);
        }
    }
    both
}
