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

use nalgebra::DMatrix;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Maximum information in a tile, nats. The likelihood of a word that is shown is then a tenth of the sum over random
/// words.
const MAX_INFORMATION: f64 = 7.0;

/// Number of random words.
const COUNT: usize = 8192;

/// Halvings of the interval of the noise.
const HALVINGS: usize = 20;

/// Random words.
#[derive(Clone, Debug)]
pub(super) struct RandomWords {
    /// ±1 for each word, by bit.
    signs: Vec<Vec<f32>>,
}

impl RandomWords {
    /// Draws the same words each time.
    pub(super) fn new(bits: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let words: Vec<u64> = (0..COUNT).map(|_| rng.next_u64()).collect();
        let signs = (0..bits).map(|bit| words.iter().map(|&word| sign(word, bit)).collect());
        Self { signs: signs.collect() }
    }

    /// Returns the sum of one factor for each bit, by word.
    fn sums(&self, factors: &[f32]) -> Vec<f32> {
        let mut sums = vec![0.0; COUNT];
        for (signs, factor) in self.signs.iter().zip(factors) {
            sums.iter_mut().zip(signs).for_each(|(sum, sign)| *sum += sign * factor);
        }
        sums
    }
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
        let (random, mut squares) = (random(), vec![0.0; COUNT]);
        for (row, signs) in matrix.iter().zip(&random.signs) {
            let sums = random.sums(row);
            let terms = sums.iter().zip(signs).map(|(sum, sign)| 0.5 * sum * sign);
            squares.iter_mut().zip(terms).for_each(|(square, term)| *square += term);
        }
        Some(Self { matrix, gain, random: squares })
    }

    /// Returns ½ sᵀAs of a word.
    pub(crate) fn half_square(&self, word: u64) -> f32 {
        let of_bit = |(bit, row): (usize, &Vec<f32>)| {
            sign(word, bit) * row.iter().enumerate().map(|(k, a)| sign(word, k) * a).sum::<f32>()
        };
        0.5 * self.matrix.iter().enumerate().map(of_bit).sum::<f32>()
    }

    /// Returns the odds of all words, given the samples minus their middle.
    pub(super) fn odds(self: &Arc<Self>, off_middle: &[f32], random: &RandomWords) -> JointOdds {
        let product = |row: &Vec<f32>| row.iter().zip(off_middle).map(|(g, off)| g * off).sum();
        let linear: Vec<f32> = self.gain.iter().map(product).collect();
        let sums = random.sums(&linear);
        let likelihoods = || sums.iter().zip(&self.random).map(|(sum, square)| sum - square);
        let most = likelihoods().fold(f32::NEG_INFINITY, f32::max);
        let sum = likelihoods().map(|l| (l - most).exp()).sum::<f32>();
        JointOdds { model: Arc::clone(self), linear, of_random: most + sum.ln() }
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
