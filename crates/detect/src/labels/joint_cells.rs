//! Joint likelihood of the cells of a tile, for tags whose cells are blurred into each other.
//!
//! Cells of a pixel or less are never determined one by one, but their sums over larger areas are. With the notation of
//! `soft_cells`, the likelihood of a word s = ±1 under Gaussian noise is
//!
//! ```text
//!     ln L(s) = b·s − ½ sᵀAs + constant,     A = ¼ Wᵀ R⁻¹ W,     b = ½ Wᵀ R⁻¹ (x − middle)
//! ```
//!
//! where R is the covariance of the samples due to noise and errors of the grey levels. The evidence for a word is
//! Λ = ln L(s) − ln mean L, with the mean over random words, so that e^Λ has the mean 1 over these for any tile.
//!
//! The mean is estimated from a sample of words, and is reliable only if no few words dominate it. So the noise is
//! assumed to be so large that a tile determines at most [`MAX_INFORMATION`]; e^Λ then still has the mean 1. Tags whose
//! single cells determine more than that are read cell by cell.

use std::rc::Rc;

use nalgebra::DMatrix;
use rand::{RngCore, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Maximum information in a tile, nats. The variance of the estimated mean, relative to its square, is up to
/// e^7/[`COUNT`], an eighth.
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
pub(super) struct JointModel {
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
    pub(super) fn new(
        half_shares: &DMatrix<f64>,
        levels: &DMatrix<f64>,
        variance: f64,
        of_cells: f64,
        random: &RandomWords,
    ) -> Option<Self> {
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
        let mut squares = vec![0.0; COUNT];
        for (row, signs) in matrix.iter().zip(&random.signs) {
            let sums = random.sums(row);
            let terms = sums.iter().zip(signs).map(|(sum, sign)| 0.5 * sum * sign);
            squares.iter_mut().zip(terms).for_each(|(square, term)| *square += term);
        }
        Some(Self { matrix, gain, random: squares })
    }

    /// Returns the odds of all words, given the samples minus their middle.
    pub(super) fn odds(self: &Rc<Self>, off_middle: &[f32], random: &RandomWords) -> JointOdds {
        let product = |row: &Vec<f32>| row.iter().zip(off_middle).map(|(g, off)| g * off).sum();
        let linear: Vec<f32> = self.gain.iter().map(product).collect();
        let sums = random.sums(&linear);
        let likelihoods = || sums.iter().zip(&self.random).map(|(sum, square)| sum - square);
        let most = likelihoods().fold(f32::NEG_INFINITY, f32::max);
        let mean = likelihoods().map(|l| (l - most).exp()).sum::<f32>() / COUNT as f32;
        JointOdds { model: Rc::clone(self), linear, mean: most + mean.ln() }
    }
}

/// The odds of all words of a tile.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct JointOdds {
    model: Rc<JointModel>,
    /// b, by bit.
    linear: Vec<f32>,
    /// ln mean L.
    mean: f32,
}

impl JointOdds {
    /// Returns Λ of a word, nats: its log-likelihood ratio to random words.
    pub(crate) fn evidence(&self, word: u64) -> f32 {
        let of_bit = |(bit, (row, linear)): (usize, (&Vec<f32>, &f32))| {
            let product: f32 = row.iter().enumerate().map(|(k, a)| sign(word, k) * a).sum();
            sign(word, bit) * (linear - 0.5 * product)
        };
        let rows = self.model.matrix.iter().zip(&self.linear);
        rows.enumerate().map(of_bit).sum::<f32>() - self.mean
    }
}

/// Returns 1 for a white cell of a word, and −1 for a black one.
fn sign(word: u64, bit: usize) -> f32 {
    if word >> bit & 1 == 1 { 1.0 } else { -1.0 }
}
