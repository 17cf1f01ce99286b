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

use glam::DVec2;
use rayon::prelude::*;

use super::regions::{Blocks, Region};
use crate::corners::saddles::{SaddleFinder, sample_noise};
use crate::grid::grids::grids;
use crate::grid::outline::WholeBoard;
use crate::grid::saddle_grid::SaddleGrid;
use crate::levels::MIN_LEVEL_SIDE;
use crate::tiling::CHECKER;
use deltille_core::raster::{Gray, Pyramid};

/// Number of corners by which a grid may exceed the whole board that another view shows: tips of tiles beyond its border.
/// A larger board exceeds it by a whole row.
const FALSE_CORNERS: usize = 2;

/// Number of views of a level: itself, and with the edges moved in and out by one and two pixels.
const VIEWS: usize = 5;

/// Returns the grids of the level and the displacement that show the whole board or the largest grid, in px of level 0.
pub(crate) fn grids_of_moved_edges<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    whole: Option<&WholeBoard>,
    others: &[DVec2],
) -> Vec<SaddleGrid> {
    let of_region = |level: usize, sigma: f32, region: &Region| -> Vec<Vec<SaddleGrid>> {
        let first = DVec2::from(region.bounds().map(|side| side.start as f64));
        let seen = |image: &Gray<i16>| {
            // Its first level is blurred, so that gaps of a pixel close.
            let blurred = Pyramid::new(image, pyramid.levels().len() - level, MIN_LEVEL_SIDE);
            let saddles = finder.find_in(&blurred, sigma);
            let mut grids = grids(finder, &blurred, &saddles, whole);
            for placed in grids.iter_mut().flat_map(|grid| grid.values_mut()) {
                placed.position = Pyramid::to_level_0(level, placed.position + first);
            }
            grids
        };
        let image = &region.cut_from(&pyramid.levels()[level]);
        let ways: [&(dyn Fn() -> Vec<Vec<SaddleGrid>> + Sync); 3] = [
            &|| vec![seen(image)],
            &|| in_steps::<N>(image, i16::min).iter().map(seen).collect(),
            &|| in_steps::<N>(image, i16::max).iter().map(seen).collect(),
        ];
        ways.into_par_iter().flat_map_iter(|way| way()).collect()
    };
    let worth = |grids: &[SaddleGrid]| {
        let is_whole = |grid| whole.is_some_and(|whole| whole.is_shown_by(grid));
        grids.first().map_or(0, |grid| grid.len() + if is_whole(grid) { FALSE_CORNERS } else { 0 })
    };
    let mut best = Vec::new();
    for (level, image) in pyramid.levels().iter().enumerate().skip(1).rev() {
        let noise = sample_noise(image);
        if noise.is_all {
            continue;
        }
        let mut views = vec![Vec::new(); VIEWS];
        for region in Blocks::of(pyramid, level, others).even_tiles() {
            for (view, found) in views.iter_mut().zip(of_region(level, noise.sigma, &region)) {
                view.extend(found);
            }
        }
        for view in &mut views {
            view.sort_by_key(|grid| std::cmp::Reverse(grid.len()));
        }
        // Of equally good ones, the finest level.
        let largest = views.into_iter().max_by_key(|grids| worth(grids));
        best = largest.filter(|grids| worth(grids) >= worth(&best)).unwrap_or(best);
    }
    best
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
