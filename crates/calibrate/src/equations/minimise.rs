//! Levenberg–Marquardt: from a problem's values to the next minimum of the cost.

use super::layout::Layout;
use super::normal::Normal;
use crate::input::loss::Loss;
use crate::problem::bundle::Problem;
use crate::problem::whitening::Whitening;
use deltille_core::damping::Damping;

/// Accepted steps at most; problems that have a minimum take ten to forty.
const MOST_STEPS: usize = 200;

/// Damping at the start.
const DAMPING: f64 = 1e-4;

/// Beyond this damping no step is left that would help.
const MOST_DAMPING: f64 = 1e12;

/// How far the search goes on. A step that is expected to lower the cost by δ² variances moves no
/// unknown by more than δ of its standard deviations, however many corners there are; below that the
/// search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Until {
    /// Good enough to go on with more unknowns or other weights: what is left is small beside noise.
    Rough,
    /// Good enough to be told: three digits of the deviations, and more of the values.
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

/// Where the search ended.
pub(crate) struct Minimum {
    pub problem: Problem,
    pub normal: Normal,
    pub layout: Layout,
    pub steps: usize,
}

/// Walks from the problem's values to the next minimum of the cost (Levenberg–Marquardt); `None`
/// where a corner is out of its camera's reach at the start, or the work is to end.
pub(crate) fn minimise(
    problem: Problem,
    whitening: &Whitening,
    loss: Loss,
    until: Until,
) -> Option<Minimum> {
    let layout = Layout::of(&problem);
    let normal = Normal::of(&problem, &layout, whitening, loss)?;
    let mut best = Minimum { problem, normal, layout, steps: 0 };
    let mut damping = Damping::from(DAMPING);
    let coordinates = 2.0 * best.problem.count() as f64;
    while best.steps < MOST_STEPS && damping.part() < MOST_DAMPING {
        if best.problem.stop.is_raised() {
            return None;
        }
        let Some(step) = best.normal.step(&best.layout, damping) else {
            damping.stiffen();
            continue;
        };
        let variance = best.normal.cost / coordinates;
        if best.normal.predicted(&best.layout, &step) <= until.deviations().powi(2) * variance {
            break;
        }
        let problem = best.problem.after(&best.layout, &step);
        match Normal::of(&problem, &best.layout, whitening, loss) {
            Some(normal) if normal.cost < best.normal.cost => {
                (best.problem, best.normal) = (problem, normal);
                best.steps += 1;
                damping.ease();
            }
            _ => damping.stiffen(),
        }
    }
    Some(best)
}
