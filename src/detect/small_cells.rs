//! Bits of tags whose cells are hardly larger than the blur: all from all pixels at once.
//!
//! A pixel p sees the cells c by the share W of each in its blurred surroundings, so that on a scale
//! of border 0 and white 1
//!
//! ```text
//!     I(p) = Σ W(p,c) b(c),      b = ½ + (WᵀW + λ)⁻¹ Wᵀ (I − ½ Σ W)
//! ```
//!
//! A cell by itself would be read together with its neighbours: at 2 px a bit and 0.7 px of blur they
//! give more than half of what is seen in its middle.

use nalgebra::{DMatrix, DVector};

use super::tile_map::TileMap;
use crate::lattice::TagCells;
use crate::raster::{Gray, Intensity};

/// A triangle is divided into 4², of which a square has two: at 4 px a bit they are as wide as a pixel.
const DIVISIONS: usize = 4;

/// λ: the variance of a pixel, 5 % of the contrast of noise and of what the map leaves, over that of a
/// bit, ¼.
const REGULARISATION: f64 = 0.01;

/// The blur reaches this many standard deviations.
const REACH_SIGMAS: f64 = 3.0;

/// Pixels that see less of the cells than this show the border.
const MIN_SHARE: f64 = 0.2;

/// The word of a tag, `inset_bits` inside its tile, under a blur of `sigma_px`, the pixel's square included; `levels` are the border
/// and the white at a point of the tile, in units of the image. `None` where the tag leaves the image.
pub fn word<T: Intensity>(
    image: &Gray<T>,
    map: &TileMap,
    cells: &TagCells,
    inset_bits: f64,
    sigma_px: f64,
    levels: impl Fn([f64; 2]) -> [f64; 2],
) -> Option<u64> {
    let bits = cells.dimension().bits();
    let points: Vec<Point> = (0..bits)
        .flat_map(|bit| {
            pieces(&cells.corners(bit, inset_bits)).into_iter().map(move |tile| (bit, tile))
        })
        .map(|(bit, tile)| Point { bit: bit as usize, tile, image: map.image_from_tile(tile) })
        .collect();
    let area_px2 = piece_area_px2(map, &cells.corners(0, inset_bits));
    let low = points.iter().fold([f64::INFINITY; 2], |m, p| [0, 1].map(|i| m[i].min(p.image[i])));
    let high =
        points.iter().fold([f64::NEG_INFINITY; 2], |m, p| [0, 1].map(|i| m[i].max(p.image[i])));
    let inside = low[0] >= 0.0
        && low[1] >= 0.0
        && high[0] < image.width() as f64 - 1.0
        && high[1] < image.height() as f64 - 1.0;
    if !inside {
        return None;
    }
    let n = bits as usize;
    let (mut normal, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let gain = area_px2 / (std::f64::consts::TAU * sigma_px * sigma_px);
    let reach2 = (REACH_SIGMAS * sigma_px).powi(2);
    for y in low[1] as usize..=high[1] as usize + 1 {
        for x in low[0] as usize..=high[0] as usize + 1 {
            let mut shares = DVector::<f64>::zeros(n);
            let mut tile = [0.0; 2];
            for point in &points {
                let [dx, dy] = [point.image[0] - x as f64, point.image[1] - y as f64];
                let distance2 = dx * dx + dy * dy;
                if distance2 < reach2 {
                    let share = gain * (-0.5 * distance2 / (sigma_px * sigma_px)).exp();
                    shares[point.bit] += share;
                    tile = [0, 1].map(|i| tile[i] + share * point.tile[i]);
                }
            }
            let sum = shares.sum();
            if sum < MIN_SHARE {
                continue;
            }
            let [border, white] = levels(tile.map(|t| t / sum));
            let seen = (f64::from(image.at(x, y).to_f32()) - border) / (white - border);
            right.axpy(seen - 0.5 * sum, &shares, 1.0);
            normal.ger(1.0, &shares, &shares, 1.0);
        }
    }
    for i in 0..n {
        normal[(i, i)] += REGULARISATION;
    }
    let off_middle = normal.cholesky()?.solve(&right);
    Some((0..bits).fold(0, |word, bit| word | u64::from(off_middle[bit as usize] > 0.0) << bit))
}

/// The middle of a piece of a cell.
struct Point {
    bit: usize,
    tile: [f64; 2],
    image: [f64; 2],
}

/// Middles of the equal triangles that a cell is divided into.
fn pieces(cell: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let third = 1.0 / (3.0 * DIVISIONS as f64);
    let rows = (0..DIVISIONS).flat_map(|j| (0..DIVISIONS - j).map(move |i| (i, j)));
    let parts: Vec<[f64; 2]> = rows
        .flat_map(|(i, j)| {
            let upright = [3 * i + 1, 3 * j + 1];
            let inverted = (i + j + 1 < DIVISIONS).then_some([3 * i + 2, 3 * j + 2]);
            [Some(upright), inverted].into_iter().flatten()
        })
        .map(|part| part.map(|thirds| thirds as f64 * third))
        .collect();
    let a = cell[0];
    let triangles = cell[1..].windows(2);
    let middles = triangles.flat_map(|bc| {
        let [b, c] = [bc[0], bc[1]];
        parts.iter().map(move |[s, t]| [0, 1].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k])))
    });
    middles.collect()
}

/// Area of a piece of a cell in the image.
fn piece_area_px2(map: &TileMap, cell: &[[f64; 2]]) -> f64 {
    let [a, b, c] = [cell[0], cell[1], cell[2]].map(|p| map.image_from_tile(p));
    let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    0.5 * cross.abs() / (DIVISIONS * DIVISIONS) as f64
}
