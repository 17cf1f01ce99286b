//! The log-odds of the cells of a tile from its samples: one multiplication, and a few iterations where samples are saturated
//! or missing.

use std::sync::Arc;

use super::joint_cells::JointModel;
use crate::lanes::dot;
use crate::refine::blurred_corner::erf_sqrt_half;

/// Minimum standard deviation of a predicted sample, relative to the contrast: a fiftieth of `soft_cells::MODEL_ERROR`.
const MIN_SPREAD: f32 = 1e-3;

/// Minimum probability above the bound at which the truncated mean is computed. Below it, the mean
/// is within σ/4 of the bound, and the error function is off by 1/1000 of the remaining
/// probability.
const MIN_ABOVE: f32 = 1e-4;

/// Largest half log-odds of a cell: one in two hundred cells is dirty on the print.
const MAX_HALF_ODDS: f64 = 2.6;

/// Number of iterations that replace saturated or missing samples by their expectation from the others.
const ROUNDS: usize = 6;

/// The estimator K and related terms.
#[derive(Debug)]
pub(crate) struct Mixing {
    pub bits: usize,
    /// ½ Σ W + white, by sample.
    pub middle: Vec<f32>,
    /// Rows of K, by bit.
    pub gain: Vec<Vec<f32>>,
    /// ½ W, by sample.
    pub half_shares: Vec<Vec<f32>>,
    /// 1/v, by bit.
    pub inverse_variance: Vec<f32>,
    /// Standard deviation of each predicted sample if nothing is known about the cells.
    pub spread: Vec<f32>,
    /// Joint likelihood of the cells, if they are not known one by one.
    pub joint: Option<Arc<JointModel>>,
}

/// A sample of a tile on the scale of black 0 and white 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Sample {
    /// The measured value.
    Share(f32),
    /// A lower bound: the sample is saturated.
    AtLeast(f32),
    /// No information.
    Erased,
}

impl Mixing {
    /// Returns half the log-odds that each cell is white, by bit. `samples` are at the positions of
    /// [`CellModel::points`].
    pub(crate) fn half_odds(&self, samples: &[Sample]) -> Vec<f32> {
        let whole = samples.iter().all(|sample| matches!(sample, Sample::Share(_)));
        let mut off_middle: Vec<f32> = samples
            .iter()
            .zip(&self.middle)
            .map(|(sample, middle)| match sample {
                Sample::Share(share) => share - middle,
                Sample::AtLeast(share) => (share - middle).max(0.0),
                Sample::Erased => 0.0,
            })
            .collect();
        let mut means = self.means(&off_middle);
        if !whole {
            for _ in 0..ROUNDS {
                for (i, sample) in samples.iter().enumerate() {
                    let predicted = || -> f32 {
                        self.half_shares[i].iter().zip(&means).map(|(w, m)| w * m).sum()
                    };
                    match sample {
                        Sample::Share(_) => {}
                        Sample::AtLeast(share) => {
                            let least = share - self.middle[i];
                            off_middle[i] = mean_above(least, predicted(), self.spread[i]);
                        }
                        Sample::Erased => off_middle[i] = predicted(),
                    }
                }
                means = self.means(&off_middle);
            }
        }
        let most = MAX_HALF_ODDS as f32;
        let odds = means.iter().zip(&self.inverse_variance);
        odds.map(|(mean, inverse_variance)| (mean * inverse_variance).clamp(-most, most)).collect()
    }

    fn means(&self, off_middle: &[f32]) -> Vec<f32> {
        self.gain[..self.bits].iter().map(|gain| dot(gain, off_middle)).collect()
    }
}

/// Returns the mean of a normal distribution truncated below at `least`.
fn mean_above(least: f32, mean: f32, deviation: f32) -> f32 {
    let deviation = deviation.max(MIN_SPREAD);
    let at = (least - mean) / deviation;
    let above = 0.5 - 0.5 * erf_sqrt_half(at);
    if above < MIN_ABOVE {
        return least;
    }
    let density = (-0.5 * at * at).exp() / std::f32::consts::TAU.sqrt();
    mean + deviation * density / above
}
