//! Levenberg–Marquardt: iterates from the values of a problem to the next minimum of the cost.

use super::factor::Factor;
use super::layout::Layout;
use super::normal::Normal;
use crate::input::loss::Loss;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;
use deltille_core::damping::Damping;

/// Maximum number of accepted steps; problems with a minimum take ten to forty.
const MAX_STEPS: usize = 200;

/// Initial damping.
const DAMPING: f64 = 1e-4;

/// Largest damping: beyond it no step lowers the cost.
const MAX_DAMPING: f64 = 1e12;

/// The accuracy at which the search ends. A step that is expected to lower the cost by δ² variances
/// moves no unknown by more than δ standard deviations, for any number of corners. The search ends
/// below this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Until {
    /// Accurate enough to continue with more unknowns or other weights: the remaining error is
    /// small compared with the noise.
    Rough,
    /// Accurate enough for results: three digits of the standard deviations, and more digits of the
    /// values.
    Fine,
}

impl Until {
    /// δ.
    fn deviations(self) -> f64 {
        match self {
            Self::Rough => 0.1,
            Self::Fine => 1e-3,
        }
    }
}

/// The result of the search.
pub(crate) struct Minimum {
    pub problem: Problem,
    pub normal: Normal,
    pub layout: Layout,
    pub steps: usize,
    /// The last factor of the equations, if they are large.
    pub factor: Option<Factor>,
}

/// Iterates from the problem's values to the next minimum of the cost (Levenberg–Marquardt); `None` if a camera cannot
/// image a corner at the start, or the calibration was stopped.
pub(crate) fn minimise(
    problem: Problem,
    whitening: &Whitening,
    loss: Loss,
    until: Until,
) -> Option<Minimum> {
    minimise_with(None, problem, whitening, loss, until)
}

/// The same with the factor of similar equations.
pub(crate) fn minimise_with(
    factor: Option<Factor>,
    problem: Problem,
    whitening: &Whitening,
    loss: Loss,
    until: Until,
) -> Option<Minimum> {
    let layout = Layout::of(&problem);
    let normal = Normal::of(&problem, &layout, whitening, loss)?;
    let mut best = Minimum { problem, normal, layout, steps: 0, factor };
    let mut damping = Damping::from(DAMPING);
    let coordinates = 2.0 * best.problem.count() as f64;
    while best.steps < MAX_STEPS && damping.part() < MAX_DAMPING {
        if best.problem.stop.is_raised() {
            return None;
        }
        let Some(step) = best.normal.step(&best.layout, damping, &mut best.factor) else {
            damping.stiffen();
            continue;
        };
        let variance = best.normal.cost / coordinates;
        if best.normal.predicted(&best.layout, &step) <= until.deviations().powi(2) * variance {
            break;
        }
        let problem = best.problem.after(&best.layout, &step);
        best.normal.release_if_large();
        match Normal::of(&problem, &best.layout, whitening, loss) {
            Some(normal) if normal.cost < best.normal.cost => {
                (best.problem, best.normal) = (problem, normal);
                best.steps += 1;
                damping.ease();
            }
            _ => {
                damping.stiffen();
                if best.normal.is_released() {
                    best.normal = Normal::of(&best.problem, &best.layout, whitening, loss)?;
                }
            }
        }
    }
    Some(best)
}
