//! Detects boards of small tiles in the enlarged image.
//!
//! The circle on which corners are searched for extends beyond the area that tags leave clear in such tiles. In an image
//! of twice the size, it covers half of the area.

use glam::DVec2;

use super::regions::{Blocks, Region};
use crate::corners::saddles::{SaddleFinder, sample_noise};
use crate::grid::grids::grids;
use crate::grid::outline::WholeBoard;
use crate::grid::saddle_grid::SaddleGrid;
use crate::levels::MIN_LEVEL_SIDE;
use deltille_core::raster::{Gray, ImageView, Pyramid};

/// Maximum number of pixels of an image that is enlarged: four times as many take a tenth of a second and 80 MB.
const MAX_PIXELS: usize = 5_000_000;

/// Largest value of an enlarged pixel.
const WHITE: f32 = 65535.0;

/// Value outside the region that is enlarged: neither dark nor bright.
const OUTSIDE: u16 = 32768;

/// Returns the grids of small tiles that the enlarged image shows, in px of the image.
pub(crate) fn enlarged_grids<const N: usize>(
    finder: &SaddleFinder<N>,
    image: ImageView,
    pyramid: &Pyramid,
    whole: Option<&WholeBoard>,
    others: &[DVec2],
) -> Vec<SaddleGrid> {
    let (width, height) = (image.width(), image.height());
    let is_small = width.min(height) < MIN_LEVEL_SIDE;
    if is_small || width * height > MAX_PIXELS {
        return Vec::new();
    }
    let finest = &pyramid.levels()[0];
    let noise = sample_noise(finest);
    if noise.is_all {
        return Vec::new();
    }
    let seen = |region: &Region| -> Vec<SaddleGrid> {
        let enlarged = enlarged(image, region);
        let enlarged = Pyramid::new(&enlarged, pyramid.levels().len() + 1, MIN_LEVEL_SIDE);
        let first = DVec2::from(region.bounds().map(|side| side.start as f64));
        let saddles = finder.find_in(&enlarged, noise.sigma);
        let mut found = grids(finder, &enlarged, &saddles, whole);
        for placed in found.iter_mut().flat_map(|grid| grid.values_mut()) {
            placed.position = Pyramid::from_level_0(1, placed.position) + first;
        }
        found
    };
    let regions = Blocks::of(pyramid, 0, others).small_tiles();
    let mut grids: Vec<SaddleGrid> = regions.iter().flat_map(seen).collect();
    grids.sort_by_key(|grid| std::cmp::Reverse(grid.len()));
    grids
}

/// Returns a region of an image at twice its size, with linear interpolation.
fn enlarged(image: ImageView, region: &Region) -> Gray<u16> {
    let [columns, rows] = region.bounds();
    let (width, height) = (columns.len(), rows.len());
    let mut enlarged = Gray::new(2 * width, 2 * height);
    // Three quarters of the nearest pixel and a quarter of the next, along rows and columns.
    let beside = |i: usize, size: usize| match i % 2 {
        0 => (i / 2).saturating_sub(1),
        _ => (i / 2 + 1).min(size - 1),
    };
    let mix = |near: f32, next: f32| 0.75 * near + 0.25 * next;
    let level = |value: f32| (WHITE * value + 0.5) as u16;
    let mut pair = [vec![0.0; width], vec![0.0; width]];
    // One row of the result before it is enlarged along the row, with the first and the last pixel repeated.
    let mut between = vec![0.0; width + 2];
    for y in 0..2 * height {
        for (row, y) in pair.iter_mut().zip([y / 2, beside(y, height)]) {
            // All rows lie in the image.
            let _ = image.read_row(columns.start, rows.start + y, row);
        }
        let [near, next] = &pair;
        for (value, (&near, &next)) in between[1..].iter_mut().zip(near.iter().zip(next)) {
            *value = mix(near, next);
        }
        (between[0], between[width + 1]) = (between[1], between[width]);
        let around = between.windows(3);
        for (pixels, around) in enlarged.row_mut(y).chunks_exact_mut(2).zip(around) {
            let (left, here, right) = (around[0], around[1], around[2]);
            (pixels[0], pixels[1]) = (level(mix(here, left)), level(mix(here, right)));
        }
        region.clear_outside([columns.start, rows.start + y / 2], enlarged.row_mut(y), 2, OUTSIDE);
    }
    enlarged
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_those_of_a_pyramid() {
        let image = Gray::from_fn(20, 10, |x, y| (1000 * x + 2000 * y) as u16);
        let enlarged = enlarged((&image).into(), &Region::whole(&image));
        for (x, y) in [(2, 2), (17, 9), (30, 16)] {
            let place = Pyramid::from_level_0(1, glam::DVec2::new(x as f64, y as f64));
            let expected = 1000.0 * place.x + 2000.0 * place.y;
            assert!((f64::from(enlarged.at(x, y)) - expected).abs() <= 1.0, "{x} {y}");
        }
    }
}
