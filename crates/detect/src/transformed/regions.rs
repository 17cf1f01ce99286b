//! The parts of an image that may show a board which the image itself does not show clearly.
//!
//! A board has two brightness values and many edges. Few other objects have both: edges of natural textures are weak
//! compared with the range of their brightness. Averages over squares of pixels show this, relative to the squared range:
//!
//! - the variance of the brightness;
//! - the mean squared gradient, if the tiles are small compared with the square;
//! - the ratio of the eigenvalues of the structure tensor, the mean of ∇I ∇Iᵀ (Förstner and Gülch, 1987), is small at a
//!   grazing angle: it is the inverse square of the aspect ratio of the tiles.

use std::f64::consts::PI;
use std::ops::Range;

use glam::DVec2;
use multiversion::multiversion;

use deltille_core::raster::{Gray, Intensity, Pyramid, bands};

/// Value outside a region, on a scale of 0 to 1023: neither dark nor bright.
pub(super) const OUTSIDE: i16 = 512;

/// Side of a block, px.
const BLOCK: usize = 16;

/// Number of blocks around one whose averages count, in each direction: the square is 48 px wide. Tiles of the boards
/// that are searched for are smaller than half of it.
const AROUND: usize = 1;

/// The same for large tiles at a grazing angle.
const FAR_AROUND: usize = 4;

/// Weakest contrast of a board, on a scale of 0 to 1023: three grey levels in 8 bits. Quantisation has two values as well.
const MIN_RANGE: f32 = 12.0;

/// Minimum variance of the brightness in a square, relative to its squared range. It is 0.25 if one half is black and the
/// other white, 0.05 if a twentieth is, and 0.02 for noise.
const MIN_VARIANCE: f32 = 0.03;

/// The same for tiles that are at most twice as long as wide: narrower ones lose contrast.
const MIN_EVEN_VARIANCE: f32 = 0.05;

/// Minimum mean squared gradient in a square, px⁻², relative to the squared range: that of edges 30 px apart in two
/// directions. Nearly all corners of boards of smaller tiles have more, under any light and at any angle, even if a blur of
/// 3 px leaves three quarters of their contrast.
const MIN_EDGES: f32 = 0.03;

/// The same for strong blur or motion, which weakens gradients but hardly the variance of tiles that are larger than it: that
/// of motion of 15 px across tiles of 38 px is 0.02, with a variance of 0.07 or more.
const MIN_BLURRED_EDGES: f32 = 0.015;

/// The variance that is then needed. Most of what has such weak gradients has less.
const MIN_BLURRED_VARIANCE: f32 = 0.06;

/// The same for the direction with the weaker edges, if tiles are at most twice as long as wide.
const MIN_EVEN_EDGES: f32 = 0.01;

/// The same for edges in one direction. Nineteen of twenty corners seen at 80° with a blur of 1 px have more than 0.033.
const MIN_PARALLEL_EDGES: f32 = 0.02;

/// Maximum ratio of the eigenvalues at a grazing angle. It is 0.07 for all patterns seen at 75°; tags, blur and the corners of
/// triangles double it.
const MAX_RATIO: f32 = 0.3;

/// Fraction of the blocks of an image that are assumed to show noise alone.
const QUIET: f64 = 0.05;

/// Minimum eigenvalue relative to the mean squared gradient of the noise.
const OVER_NOISE: f32 = 2.0;

/// Blocks of an image.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    /// Width and height of the image, px.
    size: [usize; 2],
    /// Columns and rows of blocks of the bounding box.
    bounds: [Range<usize>; 2],
    /// Which blocks of the bounding box belong to the region, by rows.
    is_part: Vec<bool>,
}

impl Region {
    /// Returns the whole of an image.
    pub(crate) fn whole<T: Intensity>(image: &Gray<T>) -> Self {
        let size = [image.width(), image.height()];
        let all = blocks_in(size);
        Self { size, bounds: all.map(|side| 0..side), is_part: vec![true; all[0] * all[1]] }
    }

    /// Returns the region of some blocks, at least one.
    fn of(size: [usize; 2], blocks: &[[usize; 2]]) -> Self {
        let bounds = [0, 1].map(|axis| {
            let places = || blocks.iter().map(|block| block[axis]);
            places().min().unwrap_or(0)..places().max().unwrap_or(0) + 1
        });
        let mut region =
            Self { size, is_part: vec![false; bounds[0].len() * bounds[1].len()], bounds };
        for &block in blocks {
            if let Some(index) = region.index(block) {
                region.is_part[index] = true;
            }
        }
        region
    }

    /// Returns the index of a block in the bounding box.
    fn index(&self, [u, v]: [usize; 2]) -> Option<usize> {
        let [columns, rows] = &self.bounds;
        let is_inside = columns.contains(&u) && rows.contains(&v);
        is_inside.then(|| (v - rows.start) * columns.len() + u - columns.start)
    }

    /// Returns whether the block of a pixel belongs to it. Pixels beyond the last whole block belong to that block.
    fn has_block_of(&self, [x, y]: [usize; 2]) -> bool {
        let [columns, rows] = blocks_in(self.size);
        let block = [(x / BLOCK).min(columns - 1), (y / BLOCK).min(rows - 1)];
        self.index(block).is_some_and(|index| self.is_part[index])
    }

    /// Returns its bounding box in a level of a pyramid, with grey outside the region.
    pub(crate) fn cut_from(&self, image: &Gray<i16>) -> Gray<i16> {
        let [columns, rows] = self.bounds();
        let mut cut = Gray::new(columns.len(), rows.len());
        for y in rows.clone() {
            let row = cut.row_mut(y - rows.start);
            row.copy_from_slice(&image.row(y)[columns.clone()]);
            self.clear_outside([columns.start, y], row, 1, OUTSIDE);
        }
        cut
    }

    /// Replaces pixels outside the region in a row that begins at a position in the image, and has `scale` pixels for each
    /// pixel of the image.
    pub(crate) fn clear_outside<T: Copy>(
        &self,
        [x, y]: [usize; 2],
        row: &mut [T],
        scale: usize,
        value: T,
    ) {
        for (pixels, x) in row.chunks_mut(BLOCK * scale).zip((x..).step_by(BLOCK)) {
            if !self.has_block_of([x, y]) {
                pixels.fill(value);
            }
        }
    }

    /// Returns whether a position in the image, px, lies in it.
    pub(crate) fn contains(&self, at: DVec2) -> bool {
        self.has_block_of(at.to_array().map(|c| c.max(0.0) as usize))
    }

    /// Returns the columns and rows of pixels of its bounding box, with those beyond the last whole block of the image.
    pub(crate) fn bounds(&self) -> [Range<usize>; 2] {
        let all = blocks_in(self.size);
        [0, 1].map(|axis| {
            let Range { start, end } = self.bounds[axis];
            BLOCK * start..if end == all[axis] { self.size[axis] } else { BLOCK * end }
        })
    }
}

/// Returns the number of columns and rows of blocks in an image.
fn blocks_in(size: [usize; 2]) -> [usize; 2] {
    size.map(|side| (side / BLOCK).max(1))
}

/// Returns connected regions of the blocks that are set, by rows.
fn connected(size: [usize; 2], mut is_set: Vec<bool>) -> Vec<Region> {
    let [columns, rows] = blocks_in(size);
    let mut regions = Vec::new();
    for first in 0..is_set.len() {
        let (mut blocks, mut reached) = (Vec::new(), vec![first]);
        while let Some(i) = reached.pop() {
            if std::mem::take(&mut is_set[i]) {
                let [u, v] = [i % columns, i / columns];
                blocks.push([u, v]);
                reached.extend(near(v, 1, rows).map(|v| v * columns + u));
                reached.extend(near(u, 1, columns).map(|u| v * columns + u));
            }
        }
        if !blocks.is_empty() {
            regions.push(Region::of(size, &blocks));
        }
    }
    regions
}

/// Returns the indices up to `reach` from one, below `count`.
fn near(index: usize, reach: usize, count: usize) -> Range<usize> {
    index.saturating_sub(reach)..(index + reach + 1).min(count)
}

/// Averages of the brightness and its gradient over blocks of an image.
#[derive(Clone, Debug)]
pub(crate) struct Blocks {
    /// Width and height of the image, px.
    size: [usize; 2],
    averages: Vec<Averages>,
    /// Whether other objects are known to be there.
    is_taken: Vec<bool>,
}

/// Averages over pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Averages {
    /// Of gx², gx gy and gy², where g is the difference of the pixels on either side.
    gradients: [f32; 3],
    /// Of the brightness and its square.
    powers: [f32; 2],
    /// Least and greatest brightness.
    range: [f32; 2],
}

impl Blocks {
    /// Computes the averages of a level of a pyramid with at least one block. Blocks around the positions of other objects,
    /// px of level 0, do not become part of any region.
    pub(crate) fn of(pyramid: &Pyramid, level: usize, others: &[DVec2]) -> Self {
        let image = &pyramid.levels()[level];
        let size = [image.width(), image.height()];
        let [columns, rows] = blocks_in(size);
        let averages = bands(0..rows, columns * BLOCK * BLOCK, |band| {
            let mut averages = Vec::with_capacity(band.len() * columns);
            for v in band {
                for u in 0..columns {
                    averages.push(block(image, u * BLOCK, v * BLOCK));
                }
            }
            averages
        });
        let mut is_taken = vec![false; columns * rows];
        for &place in others {
            let on_level = Pyramid::from_level_0(level, place);
            let [u, v] = on_level.to_array().map(|c| c.max(0.0) as usize / BLOCK);
            for v in near(v, AROUND, rows) {
                is_taken[v * columns..][near(u, AROUND, columns)].fill(true);
            }
        }
        Self { size, averages, is_taken }
    }

    /// Returns the blocks that satisfy `is`, and those around them, as connected regions.
    fn regions(&self, is: impl Fn(usize) -> bool) -> Vec<Region> {
        let [columns, rows] = blocks_in(self.size);
        let mut is_part = vec![false; columns * rows];
        for i in (0..columns * rows).filter(|&i| !self.is_taken[i] && is(i)) {
            let [u, v] = [i % columns, i / columns];
            for row in near(v, AROUND, rows) {
                is_part[row * columns..][near(u, AROUND, columns)].fill(true);
            }
        }
        connected(self.size, is_part)
    }

    /// Returns where the image may show tiles of less than about 30 px that are at most twice as long as wide.
    pub(crate) fn even_tiles(&self) -> Vec<Region> {
        let squares = self.squares(AROUND);
        self.regions(|i| {
            let [_, small] = eigenvalues(squares[i].gradients);
            squares[i].has_variance(MIN_EVEN_VARIANCE)
                && small > MIN_EVEN_EDGES * squares[i].squared_range()
        })
    }

    /// Returns where the image may show tiles of less than about 30 px.
    pub(crate) fn small_tiles(&self) -> Vec<Region> {
        let squares = self.squares(AROUND);
        self.regions(|i| {
            let ([xx, _, yy], squared_range) = (squares[i].gradients, squares[i].squared_range());
            let is_dense = |variance, edges| {
                squares[i].has_variance(variance) && xx + yy > edges * squared_range
            };
            is_dense(MIN_VARIANCE, MIN_EDGES) || is_dense(MIN_BLURRED_VARIANCE, MIN_BLURRED_EDGES)
        })
    }

    /// Returns for each of `N` directions in 180° where the image may show tiles that are long in about this direction.
    pub(crate) fn parallel_edges<const N: usize>(&self) -> [Vec<Region>; N] {
        let mut quiet: Vec<f32> =
            self.averages.iter().map(|block| eigenvalues(block.gradients)[1]).collect();
        let place = (QUIET * quiet.len() as f64) as usize;
        let (_, &mut noise, _) = quiet.select_nth_unstable_by(place, f32::total_cmp);
        // Half a step of the scale from 0 to 1023 is the least noise.
        let noise = noise.max(0.5);
        let scales = [AROUND, FAR_AROUND].map(|around| (around, self.squares(around)));
        let direction = |square: &Averages, around: usize| {
            let [large, small] = eigenvalues(square.gradients).map(|value| value - noise);
            let sparse = (2 * AROUND + 1) as f32 / (2 * around + 1) as f32;
            let is_long = square.has_variance(MIN_VARIANCE)
                && small < MAX_RATIO * large
                && large > OVER_NOISE * noise
                && large > sparse * MIN_PARALLEL_EDGES * square.squared_range();
            is_long.then(|| along(square.gradients))
        };
        let of_scales = scales.map(|(around, squares)| -> Vec<Option<f64>> {
            squares.iter().map(|square| direction(square, around)).collect()
        });
        std::array::from_fn(|n| {
            let is_near = |direction: f64| {
                let off = (direction - PI * n as f64 / N as f64).rem_euclid(PI);
                off.min(PI - off) < PI / N as f64
            };
            self.regions(|i| of_scales.iter().any(|of_scale| of_scale[i].is_some_and(is_near)))
        })
    }

    /// Returns the averages over the squares around each block.
    fn squares(&self, around: usize) -> Vec<Averages> {
        let ([columns, rows], averages) = (blocks_in(self.size), &self.averages);
        let along = |i: usize| {
            let row = &averages[i / columns * columns..][..columns];
            Averages::of_all(&row[near(i % columns, around, columns)])
        };
        let along: Vec<Averages> = (0..averages.len()).map(along).collect();
        let across = |i: usize| {
            let of_row = |v: usize| along[v * columns + i % columns];
            let column: Vec<Averages> = near(i / columns, around, rows).map(of_row).collect();
            Averages::of_all(&column)
        };
        (0..averages.len()).map(across).collect()
    }
}

impl Averages {
    /// Combines equal areas.
    fn of_all(areas: &[Self]) -> Self {
        let mean =
            |of: &dyn Fn(&Self) -> f32| areas.iter().map(of).sum::<f32>() / areas.len() as f32;
        let [mut least, mut greatest] = [f32::INFINITY, f32::NEG_INFINITY];
        for area in areas {
            least = least.min(area.range[0]);
            greatest = greatest.max(area.range[1]);
        }
        Self {
            gradients: std::array::from_fn(|k| mean(&|area| area.gradients[k])),
            powers: std::array::from_fn(|k| mean(&|area| area.powers[k])),
            range: [least, greatest],
        }
    }

    /// Returns the squared range of the brightness, or that of the weakest board.
    fn squared_range(&self) -> f32 {
        (self.range[1] - self.range[0]).max(MIN_RANGE).powi(2)
    }

    /// Returns whether the variance of the brightness is a large part of its squared range.
    fn has_variance(&self, least: f32) -> bool {
        let [mean, square] = self.powers;
        square - mean * mean > least * self.squared_range()
    }
}

/// Returns the eigenvalues of a structure tensor, the larger one first.
fn eigenvalues([xx, xy, yy]: [f32; 3]) -> [f32; 2] {
    let (mean, half) = ((xx + yy) / 2.0, (xx - yy).hypot(2.0 * xy) / 2.0);
    [mean + half, mean - half]
}

/// Returns the direction of the edges, radians: that of the smaller eigenvalue.
fn along([xx, xy, yy]: [f32; 3]) -> f64 {
    f64::from((2.0 * xy).atan2(xx - yy)) / 2.0 + PI / 2.0
}

/// Returns the averages over the block whose first pixel is (x, y). The first and the last row and column of the image have
/// no gradient.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn block(image: &Gray<i16>, x: usize, y: usize) -> Averages {
    let [x, y] = [x.clamp(1, image.width() - 1 - BLOCK), y.clamp(1, image.height() - 1 - BLOCK)];
    let (mut gradients, mut powers) = ([[0; BLOCK]; 3], [[0; BLOCK]; 2]);
    let (mut least, mut greatest) = ([i16::MAX; BLOCK], [i16::MIN; BLOCK]);
    for v in y..y + BLOCK {
        let [above, here, below] = [v - 1, v, v + 1].map(|v| &image.row(v)[x - 1..x + BLOCK + 1]);
        for i in 0..BLOCK {
            let value = here[i + 1];
            let gx = i32::from(here[i + 2]) - i32::from(here[i]);
            let gy = i32::from(below[i + 1]) - i32::from(above[i + 1]);
            gradients[0][i] += gx * gx;
            gradients[1][i] += gx * gy;
            gradients[2][i] += gy * gy;
            powers[0][i] += i32::from(value);
            powers[1][i] += i32::from(value) * i32::from(value);
            least[i] = least[i].min(value);
            greatest[i] = greatest[i].max(value);
        }
    }
    let (mut sums, mut range) = ([0; 5], [i16::MAX, i16::MIN]);
    for i in 0..BLOCK {
        for (sum, columns) in sums.iter_mut().zip(gradients.iter().chain(&powers)) {
            *sum += columns[i];
        }
        range = [range[0].min(least[i]), range[1].max(greatest[i])];
    }
    let [xx, xy, yy, value, square] = sums.map(|sum| sum as f32 / (BLOCK * BLOCK) as f32);
    Averages { gradients: [xx, xy, yy], powers: [value, square], range: range.map(f32::from) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board of two values in `x < 160`, whose squares have these sides, px, beside an edge; with waves of noise.
    fn board(width: f64, height: f64) -> Pyramid<'static> {
        let sharp = Gray::from_fn(320, 240, |x, y| {
            let cell = (x as f64 / width) as usize + (y as f64 / height) as usize;
            let value = if x < 160 { 60.0 + 130.0 * (cell % 2) as f64 } else { x as f64 / 2.0 };
            (value + ((x * 7 + y * 13) as f64).sin()) as u8
        });
        Pyramid::new(&sharp, 1, 8)
    }

    #[test]
    fn small_tiles_are_found_where_they_are() {
        let regions = Blocks::of(&board(20.0, 17.0), 0, &[]).small_tiles();
        let [region] = &regions[..] else { panic!("{} regions", regions.len()) };
        assert!(region.contains(DVec2::new(80.0, 120.0)) && region.contains(DVec2::new(2.0, 2.0)));
        assert!(!region.contains(DVec2::new(260.0, 120.0)));
        assert!(region.bounds()[0].end < 240);
        let others: Vec<DVec2> = (0..40).map(|i| DVec2::new(80.0, 6.0 * f64::from(i))).collect();
        let regions = Blocks::of(&board(20.0, 17.0), 0, &others).small_tiles();
        assert!(!regions.iter().any(|region| region.contains(DVec2::new(80.0, 120.0))));
        // A single edge, and tiles that are larger than the squares.
        assert!(Blocks::of(&board(400.0, 400.0), 0, &[]).small_tiles().is_empty());
    }

    #[test]
    fn long_tiles_are_found_in_their_direction() {
        let of_board = |regions: &Vec<Region>| {
            regions.iter().any(|region| region.contains(DVec2::new(80.0, 120.0)))
        };
        let are_found =
            Blocks::of(&board(40.0, 9.0), 0, &[]).parallel_edges::<8>().each_ref().map(of_board);
        assert!(are_found[0] && !are_found[2..7].contains(&true), "{are_found:?}");
        let are_found =
            Blocks::of(&board(12.0, 50.0), 0, &[]).parallel_edges::<8>().each_ref().map(of_board);
        assert!(are_found[4] && !are_found[..3].contains(&true), "{are_found:?}");
        let of_others = Blocks::of(&board(20.0, 20.0), 0, &[]).parallel_edges::<8>();
        assert!(!of_others.each_ref().map(of_board).contains(&true));
    }

    #[test]
    fn connected_regions_are_cut_out_and_grey_outside() {
        let board = board(20.0, 17.0);
        let image = &board.levels()[0];
        let mut is_set = vec![false; 20 * 15];
        [(4, 2), (5, 2), (5, 3), (19, 14)].iter().for_each(|(u, v)| is_set[v * 20 + u] = true);
        let [first, second] = &connected([320, 240], is_set)[..] else { panic!("two regions") };
        let cut = first.cut_from(image);
        assert_eq!([cut.width(), cut.height()], [32, 32]);
        assert_eq!([cut.at(0, 0), cut.at(31, 31)], [image.at(64, 32), image.at(95, 63)]);
        assert_eq!(cut.at(15, 16), 512);
        assert_eq!(second.bounds(), [304..320, 224..240]);
        assert_eq!(second.cut_from(image).width(), 16);
    }
}
