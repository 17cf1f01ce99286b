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

/// A filter that moves edges.
type Filter = fn(i16, i16) -> i16;

/// Maximum displacement of the edges, px of a level.
const MAX_STEPS: i32 = 2;

/// Returns the grids of the level and the displacement that show the largest grid, in px of level 0.
pub(crate) fn grids_of_moved_edges<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    whole: Option<&WholeBoard>,
) -> Vec<SaddleGrid> {
    let views: Vec<(usize, i32)> = (1..pyramid.levels().len())
        .filter(|&level| !is_all_noise(&pyramid.levels()[level]))
        .flat_map(|level| (-MAX_STEPS..=MAX_STEPS).map(move |steps| (level, steps)))
        .collect();
    let found = views.into_par_iter().map(|(level, steps)| {
        let coarse = pyramid.from_level(level);
        let filter = if steps < 0 { i16::min } else { i16::max };
        let moved = (0..steps.abs())
            .fold(coarse.levels()[0].clone(), |image, _| with_moved_edges(&image, filter));
        // Its first level is blurred, so that gaps of a pixel close.
        let coarse = Pyramid::new(&moved, coarse.levels().len(), MIN_LEVEL_SIDE);
        let saddles = finder.find(&coarse);
        let mut found = grids(finder, &coarse, &saddles, whole);
        for placed in found.iter_mut().flat_map(|grid| grid.values_mut()) {
            placed.position = Pyramid::to_level_0(level, placed.position);
        }
        found
    });
    let size = |grids: &Vec<SaddleGrid>| grids.first().map_or(0, |grid| grid.len());
    // Of equally good ones, the first: the finest level.
    let better = |a, b| if size(&b) > size(&a) { b } else { a };
    found.collect::<Vec<_>>().into_iter().reduce(better).unwrap_or_default()
}

/// Returns an image with the minimum or maximum over 3 × 3 pixels at each pixel.
fn with_moved_edges(image: &Gray<i16>, filter: Filter) -> Gray<i16> {
    let (width, height) = (image.width(), image.height());
    let mut along = image.clone();
    for y in 0..height {
        let row = image.row(y);
        for (x, out) in along.row_mut(y).iter_mut().enumerate() {
            *out = filter(filter(row[x.saturating_sub(1)], row[x]), row[(x + 1).min(width - 1)]);
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
