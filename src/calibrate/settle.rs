use super::error::CalibrationError;
use super::loss::Loss;
use super::minimise::{Minimum, Until, minimise};
use super::problem::Problem;
use super::weights::{Weights, Whitening};

/// Rounds in which weights and solution are fitted to one another; the third changes no digit that
/// matters.
const WEIGHT_ROUNDS: usize = 3;

/// Seen less predicted positions; empty blocks where a corner is out of reach, which problems that
/// were started do not have.
pub(super) fn residuals(problem: &Problem) -> Vec<Vec<[f64; 2]>> {
    problem.blocks.iter().map(|block| problem.residuals(block).unwrap_or_default()).collect()
}

/// The minimum of a problem whose weights fit its own residuals.
pub(super) fn settle(
    problem: Problem,
    weights: Weights,
    loss: Loss,
) -> Result<(Minimum, Whitening), CalibrationError> {
    let mut problem = problem;
    let mut whitening = Whitening::fit(&problem, weights, &residuals(&problem));
    // Where corners are alike and losses square, weights change nothing.
    if whitening.common_px.is_some() || loss != Loss::Squared {
        for _ in 1..WEIGHT_ROUNDS {
            problem = minimise(problem, &whitening, loss, Until::Rough)
                .ok_or(CalibrationError::NoStart)?
                .problem;
            whitening = Whitening::fit(&problem, weights, &residuals(&problem));
        }
    }
    let minimum =
        minimise(problem, &whitening, loss, Until::Fine).ok_or(CalibrationError::NoStart)?;
    Ok((minimum, whitening))
}

/// The a-posteriori variance: what the residuals cost for each of their degrees of freedom.
pub(super) fn variance(minimum: &Minimum) -> f64 {
    let unknowns = minimum.layout.count + 6 * minimum.problem.frames.len();
    let freedom = (2 * minimum.problem.count()).saturating_sub(unknowns).max(1);
    minimum.normal.cost / freedom as f64
}
