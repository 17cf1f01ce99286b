//! Corrects the covariances of positions for noise that is not white.
//!
//! Demosaicing, JPEG and enlargement correlate neighbouring residuals r. If a model fits only approximately, residuals
//! are also larger at the edges, which determine the position. Let c be the influence of the pixels on a position (δx =
//! Σ c r), ρ the correlation of the residuals at a lag, and R the covariance of the noise. The variance of x is cᵀRc
//! instead of σ² cᵀc:
//!
//! ```text
//!     factor = Σ c² r²/(1 − H) / (σ² Σ c²) · (1 + Σ_lags ρ(lag) Σ c(p) c(p + lag) / Σ c²)
//! ```
//!
//! pooled over the corners of an image. The even part about a corner (equal at opposite pixels) and
//! the odd part have separate factors. Consider a blur that differs from that of the model, for
//! example after motion. The residuals of a corner of three edges are then odd. They do not move
//! it, because its influence is nearly even. For two edges, the reverse is true. A fit removes from
//! its residuals the components that resemble its parameters: E[r rᵀ] = σ² (1 − H) with the hat
//! matrix H of white noise, so the division by 1 − H restores them.

use multiversion::multiversion;

use crate::lanes;
use crate::lanes::LANES;

/// Residuals of a corner, and the influence of its pixels on its position.
#[derive(Clone, Debug)]
pub(crate) struct Influence {
    /// Pixels, relative to any origin.
    pub places: Vec<[i32; 2]>,
    /// Position of the corner among them, times two.
    pub twice_middle: [i32; 2],
    /// Pixels minus model.
    pub residuals: Vec<f32>,
    /// Influence on x and y.
    pub on_position: [Vec<f32>; 2],
    /// Derivatives of the model with respect to x and y.
    pub slopes: [Vec<f32>; 2],
    /// Columns Q with H = Q Qᵀ.
    pub hat: Vec<Vec<f32>>,
    /// Standard deviation of the residuals.
    pub noise: f64,
}

/// Largest lags, px: for sensors and JPEG, and for enlarged images, whose grain is wider.
const LAGS_PX: [i32; 2] = [2, 6];

/// Mean correlation at the largest lag above which larger lags are used.
const WIDE: f64 = 0.05;

/// Range of plausible factors. If motion is ten times the blur, the noise is a tenth of the residuals. Enlargement by
/// six gives 36.
const FACTORS: [f64; 2] = [0.02, 40.0];

/// Minimum fraction of a pixel's noise that a fit leaves in its residual. If a fit follows a pixel more closely, its
/// residual contains no information about its noise. Nearly all pixels leave more: from 0.01 to 0.2
/// no covariance changes.
const MIN_LEFT: f32 = 0.1;

/// Number of corners that determine correlations; the sums of ten vary by a few per cent.
pub(crate) const CORNERS: usize = 10;

/// One corner in this many determines the part that fits remove from residuals. That part depends
/// only on the windows and is nearly the same for all.
const HAT_EVERY: usize = 4;

impl Influence {
    /// Returns the pairs of opposite pixels, each once.
    fn pairs(&self) -> Vec<(usize, usize)> {
        // Index of each pixel of the square around the corner.
        let reach =
            self.places.iter().flatten().map(|c| c.unsigned_abs() as i32).max().unwrap_or(0);
        let side = (2 * reach + 1) as usize;
        let index = |[u, v]: [i32; 2]| {
            let [u, v] = [u, v].map(|c| usize::try_from(c + reach).ok().filter(|&c| c < side));
            Some(v? * side + u?)
        };
        let mut at = vec![None; side * side];
        for (i, &place) in self.places.iter().enumerate() {
            if let Some(index) = index(place) {
                at[index] = Some(i);
            }
        }
        let opposite =
            |[u, v]: [i32; 2]| at[index([self.twice_middle[0] - u, self.twice_middle[1] - v])?];
        let pair = |(i, &place): (usize, &[i32; 2])| Some((i, opposite(place)?));
        self.places.iter().enumerate().filter_map(pair).collect()
    }

    /// Returns the even and the odd part of the pixels that have an opposite one, with the columns of the hat matrix on
    /// request.
    fn parts(&self, with_hat: bool) -> [Part; 2] {
        let pairs = self.pairs();
        let mut squares = [1.0, -1.0].map(|_| vec![0.0; pairs.len()]);
        let [even, odd] = &mut squares;
        for q in &self.hat {
            for ((even, odd), &(i, j)) in even.iter_mut().zip(&mut *odd).zip(&pairs) {
                *even += 0.5 * (q[i] + q[j]).powi(2);
                *odd += 0.5 * (q[i] - q[j]).powi(2);
            }
        }
        let [even, odd] = squares;
        [(1.0, even), (-1.0, odd)].map(|(sign, diagonal)| {
            let part = |values: &[f32]| -> Vec<f32> {
                let sum = |&(i, j): &(usize, usize)| values[i] + sign * values[j];
                pairs.iter().map(|pair| std::f32::consts::FRAC_1_SQRT_2 * sum(pair)).collect()
            };
            let hat: &[Vec<f32>] = if with_hat { &self.hat } else { &[] };
            Part {
                places: pairs.iter().map(|&(i, _)| self.places[i]).collect(),
                residuals: part(&self.residuals),
                on_position: [0, 1].map(|i| part(&self.on_position[i])),
                diagonal,
                hat: hat.iter().map(|q| part(q)).collect(),
                noise: self.noise,
            }
        })
    }
}

/// The even or odd part about a corner.
#[derive(Clone, Debug)]
struct Part {
    places: Vec<[i32; 2]>,
    residuals: Vec<f32>,
    on_position: [Vec<f32>; 2],
    /// The diagonal of H.
    diagonal: Vec<f32>,
    /// The columns of Q, for one corner in [`HAT_EVERY`]; empty for the others.
    hat: Vec<Vec<f32>>,
    noise: f64,
}

impl Part {
    /// Returns the sum of the squares of the influence.
    fn strength(&self) -> f64 {
        self.on_position.iter().flatten().map(|c| f64::from(c * c)).sum()
    }
}

/// Returns the factor of the covariances of positions, relative to white noise.
pub(crate) fn inflation(corners: &[Influence]) -> f64 {
    let corners = &corners[..corners.len().min(CORNERS)];
    if corners.is_empty() {
        return 1.0;
    }
    let parts = corners.iter().enumerate().map(|(i, corner)| corner.parts(i % HAT_EVERY == 0));
    let (even, odd): (Vec<Part>, Vec<Part>) = parts.map(|[even, odd]| (even, odd)).unzip();
    let (mut factor, mut strength) = (both(&even, &odd), 0.0);
    for parts in [even, odd] {
        let weight: f64 = parts.iter().map(Part::strength).sum();
        factor += weight * factor_of(&parts);
        strength += weight;
    }
    let factor = factor / strength;
    if factor.is_finite() { factor.clamp(FACTORS[0], FACTORS[1]) } else { 1.0 }
}

/// Returns the factor of the even or the odd part.
fn factor_of(parts: &[Part]) -> f64 {
    let (narrow, rim) = lagged(parts, LAGS_PX[0]);
    let lags = if rim > WIDE { lagged(parts, LAGS_PX[1]).0 } else { narrow };
    uneven(parts) * lags
}

/// Returns the common factor of the even and the odd part: noise of different strength in black and white.
fn both(even: &[Part], odd: &[Part]) -> f64 {
    let common = |(even, odd): (&Part, &Part)| {
        let at = |i: usize| {
            let [x, y] = [0, 1].map(|k| even.on_position[k][i] * odd.on_position[k][i]);
            f64::from((x + y) * even.residuals[i] * odd.residuals[i])
        };
        2.0 * (0..even.residuals.len()).map(at).sum::<f64>() / even.noise.powi(2)
    };
    even.iter().zip(odd).map(common).sum()
}

/// Returns the factor by which residuals are larger at the pixels that determine positions.
fn uneven(corners: &[Part]) -> f64 {
    let (mut seen, mut white) = (0.0, 0.0);
    for corner in corners {
        for i in 0..corner.residuals.len() {
            let rest = (1.0 - corner.diagonal[i]).max(MIN_LEFT);
            let square = f64::from(corner.residuals[i].powi(2) / rest);
            let influence: f32 = corner.on_position.iter().map(|c| c[i] * c[i]).sum();
            seen += f64::from(influence) * square / corner.noise.powi(2);
            white += f64::from(influence);
        }
    }
    seen / white
}

/// Returns the factor of the lags, and the mean correlation at the largest lag.
fn lagged(corners: &[Part], reach: i32) -> (f64, f64) {
    let lags: Vec<[i32; 2]> = (0..=reach)
        .flat_map(|v| (-reach..=reach).map(move |u| [u, v]))
        .filter(|&[u, v]| v > 0 || u > 0)
        .collect();
    let mut pairs = vec![0.0; lags.len()];
    let mut products = vec![0.0; lags.len()];
    let mut influences = vec![0.0; lags.len()];
    let (mut square, mut count, mut white) = (0.0, 0.0, 0.0);
    let hats = corners.len() as f64 / corners.len().div_ceil(HAT_EVERY) as f64;
    for corner in corners {
        let field = Field::of(corner, reach);
        let mask = field.spread([vec![1.0; corner.residuals.len()].as_slice()]);
        let residual = field.spread([corner.residuals.as_slice()]);
        let on_position = field.spread(corner.on_position.iter().map(Vec::as_slice));
        let variance = corner.noise.powi(2);
        square += field.product(&residual, 0) / variance;
        count += field.product(&mask, 0);
        white += field.product(&on_position, 0);
        for (k, lag) in lags.iter().enumerate() {
            let offset = field.offset(*lag);
            pairs[k] += field.product(&mask, offset);
            products[k] += field.product(&residual, offset) / variance;
            influences[k] += field.product(&on_position, offset);
        }
        if !corner.hat.is_empty() {
            let hat = field.spread(corner.hat.iter().map(Vec::as_slice));
            square += hats * field.product(&hat, 0);
            for (k, lag) in lags.iter().enumerate() {
                products[k] += hats * field.product(&hat, field.offset(*lag));
            }
        }
    }
    let scale = square / count;
    let correlation = |k: usize| products[k] / (pairs[k] * scale);
    let part = (0..lags.len()).map(|k| 2.0 * correlation(k) * influences[k] / white).sum::<f64>();
    let rim: Vec<f64> = (0..lags.len())
        .filter(|&k| lags[k].iter().any(|l| l.abs() == reach) && lags[k].contains(&0))
        .map(correlation)
        .collect();
    (1.0 + part, rim.iter().sum::<f64>() / rim.len() as f64)
}

/// A rectangle of pixels with space for lags at its sides.
struct Field {
    first: [i32; 2],
    width: usize,
    /// Number of pixels, in whole vectors, followed by zeros for the largest lag.
    pixels: usize,
    room: usize,
    places: Vec<usize>,
}

impl Field {
    fn of(corner: &Part, reach: i32) -> Self {
        let ends = |i: usize| {
            let values = || corner.places.iter().map(|p| p[i]);
            (values().min().unwrap_or(0), values().max().unwrap_or(0))
        };
        let ((left, right), (top, bottom)) = (ends(0), ends(1));
        let width = (right - left + 1 + reach) as usize;
        let height = (bottom - top + 1) as usize;
        let pixels = (width * height).next_multiple_of(LANES);
        let mut field = Self { first: [left, top], width, pixels, room: 0, places: Vec::new() };
        field.room = pixels + field.offset([reach, reach]);
        field.places = corner.places.iter().map(|&place| field.index(place)).collect();
        field
    }

    fn index(&self, [u, v]: [i32; 2]) -> usize {
        (v - self.first[1]) as usize * self.width + (u - self.first[0]) as usize
    }

    fn offset(&self, [u, v]: [i32; 2]) -> usize {
        (v * self.width as i32 + u) as usize
    }

    /// Arranges values of the corner's pixels, one rectangle after the other.
    fn spread<'a>(&self, all: impl IntoIterator<Item = &'a [f32]>) -> Vec<f32> {
        let mut fields = Vec::new();
        for values in all {
            let first = fields.len();
            fields.resize(first + self.room, 0.0);
            let field = &mut fields[first..];
            self.places.iter().zip(values).for_each(|(&place, &value)| field[place] = value);
        }
        fields
    }

    /// Returns the sum over such rectangles of the products of all values with those at `offset`.
    fn product(&self, fields: &[f32], offset: usize) -> f64 {
        lagged_product(fields, [self.pixels, self.room], offset)
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn lagged_product(fields: &[f32], [pixels, room]: [usize; 2], offset: usize) -> f64 {
    let mut sums = [0.0f32; LANES];
    let mut first = 0;
    while first < fields.len() {
        let (here, _) = fields[first..first + pixels].as_chunks::<LANES>();
        let (there, _) = fields[first + offset..first + offset + pixels].as_chunks::<LANES>();
        for (here, there) in here.iter().zip(there) {
            for k in 0..LANES {
                sums[k] += here[k] * there[k];
            }
        }
        first += room;
    }
    f64::from(lanes::sum(&sums))
}
