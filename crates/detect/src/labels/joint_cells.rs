//! Joint likelihood of the cells of a tile, for tags whose cells are blurred into each other.
//!
//! Cells of a pixel or less are never determined one by one, but their sums over larger areas are. With the notation of
//! `soft_cells`, the likelihood of a word s = ±1 under Gaussian noise is
//!
//! ```text
//!     ln L(s) = b·s − ½ sᵀAs + constant,     A = ¼ Wᵀ R⁻¹ W,     b = ½ Wᵀ R⁻¹ (x − middle)
//! ```
//!
//! where R is the covariance of the samples due to noise and errors of the grey levels. The evidence for a word is the
//! ratio of its likelihood to the mean over random words and itself. If the word is random too, it is exchangeable with
//! these, so the ratio has the mean 1 for any tile.
//!
//! The ratio is at most the number of random words. So the noise is assumed to be so large that a tile determines at
//! most [`MAX_INFORMATION`]. Tags whose single cells determine more than that are read cell by cell.

use std::sync::Arc;

use multiversion::multiversion;
use nalgebra::DMatrix;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::lanes::{LANES, dot, sum};
use crate::refine::blurred_corner::exp_negative;

/// Maximum information in a tile, nats. The likelihood of a word that is shown is then a tenth of the sum over random
/// words.
const MAX_INFORMATION: f64 = 7.0;

/// Number of random words.
const COUNT: usize = 8192;

/// Halvings of the interval of the noise.
const HALVINGS: usize = 20;

/// Number of words whose signs are read together, so that they and their sums stay in the nearest cache.
const GROUP: usize = 256;

/// Random words.
#[derive(Clone, Debug)]
pub(super) struct RandomWords {
    /// ±1 for each word of a group, by group and bit.
    groups: Vec<Vec<[f32; GROUP]>>,
}

impl RandomWords {
    /// Draws the same words each time.
    pub(super) fn new(bits: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let words: Vec<u64> = (0..COUNT).map(|_| rng.next_u64()).collect();
        let of_group = |words: &[u64]| {
            (0..bits).map(|bit| std::array::from_fn(|k| sign(words[k], bit))).collect()
        };
        Self { groups: words.chunks_exact(GROUP).map(of_group).collect() }
    }
}

/// Returns the sum of one factor for each bit, by word of a group.
#[inline(always)]
fn sums_of_group(group: &[[f32; GROUP]], factors: &[f32]) -> [f32; GROUP] {
    let mut sums = [0.0; GROUP];
    for (signs, &factor) in group.iter().zip(factors) {
        for k in 0..GROUP {
            sums[k] += signs[k] * factor;
        }
    }
    sums
}

/// Returns the same for all words.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn sums(random: &RandomWords, factors: &[f32]) -> Vec<f32> {
    let mut sums = Vec::with_capacity(COUNT);
    for group in &random.groups {
        sums.extend_from_slice(&sums_of_group(group, factors));
    }
    sums
}

/// Returns ½ sᵀAs of all words, given the rows of A.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn half_squares(random: &RandomWords, matrix: &[Vec<f32>]) -> Vec<f32> {
    let mut squares = Vec::with_capacity(COUNT);
    for group in &random.groups {
        let mut of_group = [0.0; GROUP];
        for (row, signs) in matrix.iter().zip(group) {
            let sums = sums_of_group(group, row);
            for k in 0..GROUP {
                of_group[k] += 0.5 * sums[k] * signs[k];
            }
        }
        squares.extend_from_slice(&of_group);
    }
    squares
}

/// Returns ln Σ exp of the values, whose number is a multiple of [`LANES`].
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn ln_sum_exp(values: &[f32]) -> f32 {
    let (values, _) = values.as_chunks::<LANES>();
    let mut most = [f32::NEG_INFINITY; LANES];
    for values in values {
        for k in 0..LANES {
            most[k] = if values[k] > most[k] { values[k] } else { most[k] };
        }
    }
    let most = most.into_iter().fold(f32::NEG_INFINITY, f32::max);
    let mut sums = [0.0; LANES];
    for values in values {
        for k in 0..LANES {
            sums[k] += exp_negative(values[k] - most);
        }
    }
    most + sum(&sums).ln()
}

/// The likelihood of the words of a tile under one blur.
#[derive(Debug, PartialEq)]
pub(crate) struct JointModel {
    /// Rows of A.
    matrix: Vec<Vec<f32>>,
    /// Rows of the matrix that takes samples to b, by bit.
    gain: Vec<Vec<f32>>,
    /// ½ sᵀAs of the random words.
    random: Vec<f32>,
}

impl JointModel {
    /// Creates the model from ½ W by sample, and the effects of errors of the grey levels with a standard deviation of
    /// 1, for samples of this variance. Returns `None` if single cells determine more, `of_cells` nats.
    pub(super) fn new<'a>(
        half_shares: &DMatrix<f64>,
        levels: &DMatrix<f64>,
        variance: f64,
        of_cells: f64,
        random: impl FnOnce() -> &'a RandomWords,
    ) -> Option<Self> {
        if of_cells > MAX_INFORMATION {
            return None;
        }
        // R⁻¹ by the Woodbury identity: the errors of the grey levels are few.
        let among =
            levels.tr_mul(levels) / variance + DMatrix::identity(levels.ncols(), levels.ncols());
        let removed = among.try_inverse()? * levels.transpose() / variance;
        let gain = (half_shares.transpose() - half_shares.tr_mul(levels) * removed) / variance;
        let matrix = &gain * half_shares;
        // That of a Gaussian with unit variance in every cell.
        let eigenvalues = matrix.clone().symmetric_eigenvalues();
        let information =
            |part: f64| eigenvalues.iter().map(|a| (part * a).ln_1p() / 2.0).sum::<f64>();
        let (mut part, mut below) = (1.0, 0.0);
        if information(part) > MAX_INFORMATION {
            for _ in 0..HALVINGS {
                let middle = (part + below) / 2.0;
                *(if information(middle) > MAX_INFORMATION { &mut part } else { &mut below }) =
                    middle;
            }
            part = below;
        }
        if information(part) < of_cells {
            return None;
        }
        let (matrix, gain) = (part * matrix, part * gain);
        let rows = |m: &DMatrix<f64>| -> Vec<Vec<f32>> {
            m.row_iter().map(|row| row.iter().map(|&v| v as f32).collect()).collect()
        };
        let (matrix, gain) = (rows(&matrix), rows(&gain));
        let random = half_squares(random(), &matrix);
        Some(Self { matrix, gain, random })
    }

    /// Returns ½ sᵀAs of a word.
    pub(crate) fn half_square(&self, word: u64) -> f32 {
        let signs: Vec<f32> = (0..self.matrix.len()).map(|bit| sign(word, bit)).collect();
        let of_bit = |(sign, row): (&f32, &Vec<f32>)| sign * dot(row, &signs);
        0.5 * signs.iter().zip(&self.matrix).map(of_bit).sum::<f32>()
    }

    /// Returns the odds of all words, given the samples minus their middle.
    pub(super) fn odds(self: &Arc<Self>, off_middle: &[f32], random: &RandomWords) -> JointOdds {
        let linear: Vec<f32> = self.gain.iter().map(|row| dot(row, off_middle)).collect();
        let mut likelihoods = sums(random, &linear);
        likelihoods.iter_mut().zip(&self.random).for_each(|(sum, square)| *sum -= square);
        JointOdds { model: Arc::clone(self), linear, of_random: ln_sum_exp(&likelihoods) }
    }
}

/// The odds of all words of a tile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointOdds {
    /// The model, which tiles under the same blur share.
    pub model: Arc<JointModel>,
    /// b, by bit.
    pub linear: Vec<f32>,
    /// ln Σ L of the random words.
    of_random: f32,
}

impl JointOdds {
    /// Returns Λ of a word, nats: its log-likelihood ratio to random words. `product` is b·s, and `half_square` that of
    /// [`JointModel::half_square`].
    pub(crate) fn evidence(&self, product: f32, half_square: f32) -> f32 {
        let own = product - half_square;
        let (least, most) = (own.min(self.of_random), own.max(self.of_random));
        own + ((COUNT + 1) as f32).ln() - most - (least - most).exp().ln_1p()
    }

    /// Returns Λ of any word, nats.
    pub(crate) fn evidence_of(&self, word: u64) -> f32 {
        let terms = self.linear.iter().enumerate().map(|(bit, linear)| sign(word, bit) * linear);
        self.evidence(terms.sum(), self.model.half_square(word))
    }
}

/// Returns 1 for a white cell of a word, and −1 for a black one.
fn sign(word: u64, bit: usize) -> f32 {
    if word >> bit & 1 == 1 { 1.0 } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use rand::Rng;

    use super::*;

    const BITS: usize = 14;
    const SAMPLES: usize = 30;
    const NOISE: f64 = 0.05;

    /// A row of cells under a blur of this many cells.
    fn model(blur: f64, random: &RandomWords) -> (DMatrix<f64>, Option<Arc<JointModel>>) {
        let off = |i: usize, bit: usize| i as f64 * BITS as f64 / SAMPLES as f64 - bit as f64;
        let shares = DMatrix::from_fn(SAMPLES, BITS, |i, bit| {
            0.2 / blur * (-0.5 * (off(i, bit) / blur).powi(2)).exp()
        });
        let level = DMatrix::from_element(SAMPLES, 1, 0.15);
        let model = JointModel::new(&shares, &level, NOISE * NOISE, 3.0, || random);
        (shares, model.map(Arc::new))
    }

    /// The mean of e^Λ over all words is 1. A word that is shown has more evidence than 99 of 100 others, although none of
    /// its cells is visible.
    #[test]
    fn words_of_blurred_cells_are_distinguished() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let random = RandomWords::new(BITS);
        for blur in [1.5, 2.5] {
            let (shares, model) = model(blur, &random);
            let model = model.unwrap();
            let (mut means, mut ranks) = (Vec::new(), Vec::new());
            for _ in 0..50 {
                let word = rng.random_range(0..1u64 << BITS);
                let off_middle: Vec<f32> = (0..SAMPLES)
                    .map(|i| {
                        let cells =
                            (0..BITS).map(|bit| f64::from(sign(word, bit)) * shares[(i, bit)]);
                        (cells.sum::<f64>() + NOISE * rng.random_range(-1.7..1.7)) as f32
                    })
                    .collect();
                let odds = model.odds(&off_middle, &random);
                let all: Vec<f32> = (0..1u64 << BITS).map(|word| odds.evidence_of(word)).collect();
                means.push(all.iter().map(|l| f64::from(l.exp())).sum::<f64>() / all.len() as f64);
                let shown = all[word as usize];
                ranks.push(all.iter().filter(|&&l| l > shown).count() * 100 / all.len());
            }
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            assert!((0.8..1.25).contains(&mean), "blur {blur}: {mean}");
            let best = ranks.iter().filter(|&&rank| rank == 0).count();
            assert!(best >= 35, "blur {blur}: {best} of 50");
        }
        assert!(model(0.3, &random).1.is_some_and(|sharp| sharp.random.len() == COUNT));
    }
}
