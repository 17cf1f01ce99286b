//! Detects boards at a grazing angle in images that are compressed along their tiles.
//!
//! At 75°, a tile is four times as wide as it is high, and its sectors are 15° wide. A circle that is
//! large enough to show them extends beyond the tile. The image is compressed to a third of its
//! width, along one of a few directions. In the direction nearest to that of the tiles, they appear
//! as if seen at 40° to 60°; those seen at 80°, as if at 60° to 70°.
//!
//! ```text
//!     ╲▁▁▁▁▁▁╱▔▔▔▔▔▔╲▁▁▁▁▁▁╱        ╲▁▁╱▔▔╲▁▁╱
//!     ╱▔▔▔▔▔▔╲▁▁▁▁▁▁╱▔▔▔▔▔▔╲   →    ╱▔▔╲▁▁╱▔▔╲
//! ```

use std::f64::consts::PI;

use glam::DVec2;
use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use rayon::prelude::*;

use super::regions::{Blocks, OUTSIDE, Region};
use crate::corners::saddles::{SaddleFinder, sample_noise};
use crate::grid::grids::grids;
use crate::grid::saddle_grid::SaddleGrid;
use crate::levels::MIN_LEVEL_SIDE;
use crate::tiling::step;
use deltille_core::raster::{Gray, Pyramid};

/// Number of directions in 180° if that of the tiles is only known from their edges. No direction is more than 11° from
/// one of them. At 11°, a third of the width changes tiles from an aspect ratio of 4 to one of 2.2.
const DIRECTIONS: usize = 8;

/// Factor of the compressed width.
const WIDTH: f64 = 1.0 / 3.0;

/// Aspect ratio of tiles, seen at 70°, from which a grid may lack corners that the compressed image shows.
const LARGE_ASPECT: f64 = 3.0;

/// Maximum number of pixels of the pyramid level that is used: tiles of larger images are larger.
const MAX_PIXELS: usize = 2_500_000;

/// Tolerance for rounded steps, px: within a row they add up to less than a tenth of a pixel.
const SLACK_PX: f64 = 0.1;

/// Step below which a row of a view counts as level, px. It rises by less than the tolerance in a hundred million
/// pixels.
const LEVEL_STEP: f64 = 1e-9;

/// Number of pixels of a view that are drawn together, or not at all.
const RUN: usize = 8;

/// The direction in which tiles are long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Direction {
    /// That of a grid, radians.
    Known(f64),
    /// That of the edges, wherever they are parallel.
    OfEdges,
}

/// Returns the direction in which the tiles of a grid are long, radians, if they are foreshortened.
pub(crate) fn foreshortened_direction<const N: usize>(grid: &SaddleGrid) -> Option<f64> {
    // Over the steps of a lattice that is seen from the front, the outer products add up to a multiple of the identity.
    let mut moments = Matrix2::zeros();
    for (&vertex, placed) in grid {
        for next in (0..N / 2).filter_map(|k| grid.get(&(vertex + step::<N>(k)))) {
            let DVec2 { x, y } = next.position - placed.position;
            moments += Matrix2::new(x * x, x * y, x * y, y * y);
        }
    }
    let SymmetricEigen { eigenvalues, eigenvectors } = moments.symmetric_eigen();
    let long = eigenvalues.imax();
    let is_long = eigenvalues[long] > LARGE_ASPECT * LARGE_ASPECT * eigenvalues[1 - long];
    is_long.then(|| eigenvectors[(1, long)].atan2(eigenvectors[(0, long)]))
}

/// Returns the grids of the direction in which the largest is seen, in px of level 0.
pub(crate) fn foreshortened_grids<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    direction: Direction,
    others: &[DVec2],
) -> Vec<SaddleGrid> {
    let levels = pyramid.levels();
    let fitting = levels.iter().position(|level| level.pixels().len() <= MAX_PIXELS);
    let level = fitting.unwrap_or(levels.len() - 1);
    let is_small = levels[level].width().min(levels[level].height()) < MIN_LEVEL_SIDE;
    let noise = sample_noise(&levels[level]);
    if is_small || noise.is_all {
        return Vec::new();
    }
    let directions = match direction {
        Direction::Known(angle) => vec![(angle, vec![Region::whole(&levels[level])])],
        Direction::OfEdges => {
            let regions = Blocks::of(pyramid, level, others).parallel_edges::<DIRECTIONS>();
            let angle = |i: usize| PI * i as f64 / DIRECTIONS as f64;
            regions.into_iter().enumerate().map(|(i, regions)| (angle(i), regions)).collect()
        }
    };
    let seen = |angle: f64, region: &Region| -> Vec<SaddleGrid> {
        let view = View::new(angle, region);
        let drawn = view.drawn(&levels[level]);
        let compressed = Pyramid::new(&drawn, levels.len() - level, MIN_LEVEL_SIDE);
        let saddles = finder.find_in(&compressed, noise.sigma);
        let mut found = grids(finder, &compressed, &saddles, None);
        for placed in found.iter_mut().flat_map(|grid| grid.values_mut()) {
            placed.position = Pyramid::to_level_0(level, view.in_picture(placed.position));
        }
        found
    };
    let of_directions = directions.par_iter().map(|(angle, regions)| {
        let mut grids: Vec<SaddleGrid> =
            regions.iter().flat_map(|region| seen(*angle, region)).collect();
        grids.sort_by_key(|grid| std::cmp::Reverse(grid.len()));
        grids
    });
    let size = |grids: &Vec<SaddleGrid>| grids.first().map_or(0, |grid| grid.len());
    // Of equally good directions, the first.
    let better = |a, b| if size(&b) > size(&a) { b } else { a };
    of_directions.collect::<Vec<_>>().into_iter().reduce(better).unwrap_or_default()
}

/// A region of an image, compressed in one direction.
struct View<'a> {
    picture_from_view: Matrix2<f64>,
    /// Centre of the view, in the image and in the view.
    centres: [Vector2<f64>; 2],
    size: [usize; 2],
    region: &'a Region,
}

impl<'a> View<'a> {
    fn new(angle: f64, region: &'a Region) -> Self {
        let along = Vector2::new(angle.cos(), angle.sin());
        let view_from_picture = Matrix2::identity() - (1.0 - WIDTH) * along * along.transpose();
        let picture_from_view =
            Matrix2::identity() + (1.0 / WIDTH - 1.0) * along * along.transpose();
        let [columns, rows] = region.bounds();
        let first = Vector2::new(columns.start as f64, rows.start as f64);
        let end = Vector2::new(columns.end as f64, rows.end as f64);
        let view = view_from_picture.abs() * (end - first);
        let half_px = Vector2::repeat(0.5);
        Self {
            picture_from_view,
            centres: [(first + end) / 2.0 - half_px, view / 2.0 - half_px],
            size: [view.x.ceil() as usize, view.y.ceil() as usize],
            region,
        }
    }

    fn in_picture(&self, at: DVec2) -> DVec2 {
        let [picture, view] = self.centres;
        let there = picture + self.picture_from_view * (Vector2::new(at.x, at.y) - view);
        DVec2::new(there.x, there.y)
    }

    /// Renders the region as the view shows it, with grey outside. (A pyramid level is smooth enough to be sampled at every
    /// second pixel.)
    fn drawn(&self, image: &Gray<i16>) -> Gray<i16> {
        // The last position has a pixel behind it.
        let last = [image.width(), image.height()].map(|side| side as f64 - (2.0 + SLACK_PX));
        let [width, height] = self.size;
        let step = DVec2::from_slice(self.picture_from_view.column(0).as_slice());
        let mut drawn = Gray::new(width, height);
        for (y, row) in drawn.pixels_mut().chunks_mut(width).enumerate() {
            row.fill(OUTSIDE);
            let first = self.in_picture(DVec2::new(0.0, y as f64));
            // The part of the row that lies in the image.
            let (mut from, mut to) = (0.0, width as f64);
            for i in 0..2 {
                let ends = [(SLACK_PX - first[i]) / step[i], (last[i] - first[i]) / step[i]];
                if step[i].abs() > LEVEL_STEP {
                    from = f64::max(from, ends[0].min(ends[1]));
                    to = f64::min(to, ends[0].max(ends[1]));
                } else if !(0.0..=last[i]).contains(&first[i]) {
                    to = from;
                }
            }
            let (from, to) = (from.ceil(), to.floor());
            let seen = row.get_mut(from as usize..to as usize).unwrap_or_default();
            for (n, run) in seen.chunks_mut(RUN).enumerate() {
                let start = first + (from + (n * RUN) as f64) * step;
                if self.region.contains(start + run.len() as f64 / 2.0 * step) {
                    sample(image, start, step, run);
                }
            }
        }
        drawn
    }
}

/// Samples bilinearly along a line inside an image.
fn sample(image: &Gray<i16>, first: DVec2, step: DVec2, out: &mut [i16]) {
    /// Fractional bits of a coordinate. With this rounding, a row of ten thousand steps is off by less than a tenth of
    /// a pixel.
    const FINE_BITS: u32 = 16;
    const FINE: f64 = (1u32 << FINE_BITS) as f64;
    /// Bits of a weight: two weights and a grey value of 10 bits fit into 32.
    const WEIGHT_BITS: u32 = 8;
    const WEIGHTS: i32 = 1 << WEIGHT_BITS;
    /// Bits of the product of two weights.
    const SUM_BITS: u32 = 2 * WEIGHT_BITS;
    let (data, width) = (image.pixels(), image.width());
    let [mut x, mut y] = (first * FINE).round().as_i64vec2().to_array();
    let [dx, dy] = (step * FINE).round().as_i64vec2().to_array();
    for pixel in out {
        let [col, row] = [x, y].map(|c| (c.max(0) >> FINE_BITS) as usize);
        let [fx, fy] = [x, y].map(|c| (c >> (FINE_BITS - WEIGHT_BITS)) as i32 & (WEIGHTS - 1));
        let at = row * width + col;
        let (upper, lower) = (&data[at..at + 2], &data[at + width..at + width + 2]);
        let across = |pair: &[i16]| i32::from(pair[0]) * (WEIGHTS - fx) + i32::from(pair[1]) * fx;
        let sum = across(upper) * (WEIGHTS - fy) + across(lower) * fy;
        *pixel = ((sum + (1 << (SUM_BITS - 1))) >> SUM_BITS) as i16;
        (x, y) = (x + dx, y + dy);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_show_points_at_their_mapped_positions() {
        let image = Gray::from_fn(200, 150, |x, y| {
            let [u, v] = [x as f64 - 120.3, y as f64 - 60.8];
            (1000.0 * (-(u * u + v * v) / 200.0).exp()) as i16
        });
        let region = Region::whole(&image);
        for angle in (0..DIRECTIONS).map(|i| PI * i as f64 / DIRECTIONS as f64) {
            let view = View::new(angle, &region);
            let drawn = view.drawn(&image);
            let (mut sum, mut middle) = (0.0, DVec2::ZERO);
            for y in 0..drawn.height() {
                for x in 0..drawn.width() {
                    let weight = match drawn.at(x, y) {
                        OUTSIDE => 0.0,
                        value => f64::from(value),
                    };
                    sum += weight;
                    middle += weight * DVec2::new(x as f64, y as f64);
                }
            }
            let found = view.in_picture(middle / sum);
            assert!(found.distance(DVec2::new(120.3, 60.8)) < 0.1, "{found}");
        }
    }
}
