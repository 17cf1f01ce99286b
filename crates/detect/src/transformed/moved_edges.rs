//! Detects boards whose edges have moved: blooming, bleeding ink or compression made all dark tiles larger or smaller.
//!
//! Dark tiles that meet diagonally at a corner then overlap or leave a gap. A fine level of the pyramid shows the gap
//! instead of a corner. On a coarse level it is small compared with the blur, so the corner is visible, but the gap
//! still shifts the brightness of the centre. A minimum or maximum over 3 × 3 pixels moves all edges back by a pixel.
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
use crate::grid::outline::WholeBoard;
use crate::grid::saddle_grid::SaddleGrid;
use crate::levels::MIN_LEVEL_SIDE;
use deltille_core::raster::{Gray, Pyramid};

/// Displacement of the edges, by one and by two px of a level.
#[derive(Clone, Copy)]
enum Move {
    None,
    /// Dark areas grow.
    In,
    /// Dark areas shrink.
    Out,
}

/// Returns the grids of the level and the displacement that show the largest grid, in px of level 0.
pub(crate) fn grids_of_moved_edges<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    whole: Option<&WholeBoard>,
) -> Vec<SaddleGrid> {
    let levels =
        (1..pyramid.levels().len()).filter(|&level| !is_all_noise(&pyramid.levels()[level]));
    let views: Vec<(usize, Move)> =
        levels.flat_map(|level| [Move::None, Move::In, Move::Out].map(|to| (level, to))).collect();
    let found = views.into_par_iter().flat_map_iter(|(level, to)| {
        let coarse = pyramid.from_level(level);
        let [image, ..] = coarse.levels() else { return Vec::new() };
        let grids_of = |image: &Gray<i16>| {
            // Its first level is blurred, so that gaps of a pixel close.
            let blurred = Pyramid::new(image, coarse.levels().len(), MIN_LEVEL_SIDE);
            let saddles = finder.find(&blurred);
            let mut found = grids(finder, &blurred, &saddles, whole);
            for placed in found.iter_mut().flat_map(|grid| grid.values_mut()) {
                placed.position = Pyramid::to_level_0(level, placed.position);
            }
            found
        };
        let moved = |image: &Gray<i16>| match to {
            Move::None => None,
            Move::In => Some(with_moved_edges(image, i16::min)),
            Move::Out => Some(with_moved_edges(image, i16::max)),
        };
        let Some(first) = moved(image) else { return vec![grids_of(image)] };
        let second = moved(&first);
        [Some(first), second].iter().flatten().map(grids_of).collect()
    });
    let size = |grids: &Vec<SaddleGrid>| grids.first().map_or(0, |grid| grid.len());
    // Of equally good ones, the first: the finest level.
    let better = |a, b| if size(&b) > size(&a) { b } else { a };
    found.collect::<Vec<_>>().into_iter().reduce(better).unwrap_or_default()
}

/// Returns an image with the minimum or maximum over 3 × 3 pixels at each pixel.
fn with_moved_edges(image: &Gray<i16>, filter: impl Fn(i16, i16) -> i16 + Copy) -> Gray<i16> {
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
    for y in 0..height {
        let [above, below] = [along.row(y.saturating_sub(1)), along.row((y + 1).min(height - 1))];
        let row = both.row_mut(y);
        for (out, (&above, &below)) in row.iter_mut().zip(above.iter().zip(below)) {
            *out = filter(filter(above, *out), below);
        }
    }
    both
}
