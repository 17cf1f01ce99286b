//! Consistency of views: finds the views that contradict the camera of all others because zoom,
//! focus or crop changed.
//!
//! At the minimum the gradients of all views with respect to the camera sum to zero. With S = Σ Sᵥ
//! the reduced normal equations (Schur complement), the gradient s of a consistent view has the
//! covariance Sᵥ − Sᵥ S⁻¹ Sᵥ, so that the statistic
//!
//! ```text
//!     T = sᵀ (Sᵥ − Sᵥ S⁻¹ Sᵥ)⁺ s
//! ```
//!
//! is χ² distributed. Its degrees of freedom are the number of camera parameters that the view
//! determines. This is the Chow test (Chow 1960) of whether this view has the same camera as all
//! others. An inconsistent view increases the statistic of all views until it is removed. Lack of
//! fit of the model always increases it, and is not due to a single view.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::lack_of_fit::deviate_of_f;
use super::reweighting::Settled;
use crate::equations::layout::Layout;
use crate::equations::local_share::LocalShare;
use crate::equations::normal::{Normal, Reduced};
use crate::input::loss::Loss;
use crate::problem::bundle::Problem;
use deltille_core::damping::Damping;
use deltille_core::statistics::median;

/// Minimum number of views for the test: three remain without the tested one.
const MIN_VIEWS: usize = 4;

/// Minimum information about a direction of the camera parameters. A direction is undetermined if
/// all views together contribute less than the fraction `OPEN` of the best direction. It is not
/// tested if the view, or all others, contribute less than the fraction `MIN_PART` of it.
const OPEN: f64 = 1e-9;
const MIN_PART: f64 = 1e-3;

/// Most views agree if the median of T, divided by its degrees of freedom, is below this limit; 0.9
/// is usual.
const AGREEING: f64 = 1.5;

/// Significance above which a view is inconsistent, in standard deviations relative to the scatter
/// of all views. Noise exceeds it less than once in a million views.
const SIGNIFICANT: f64 = 5.0;

/// Minimum shift of the camera parameters due to an inconsistent view, in their standard
/// deviations.
const HARMFUL: f64 = 1.0;

/// Statistical efficiency of the median relative to the mean, for squares.
const EFFICIENCY: f64 = 0.64;

/// The test of one view against all others.
#[derive(Clone, Copy, Debug)]
struct Pull {
    /// T divided by its degrees of freedom, in units of the variance of residuals.
    statistic: f64,
    freedom: f64,
    /// Shift of the camera parameters if the view is left out, in their standard deviations.
    moves: f64,
}

impl Pull {
    /// Computes it from pairs: the fraction of a direction that the view contributes, and the component of its gradient
    /// along it.
    fn of(directions: impl Iterator<Item = (f64, f64)>, variance: f64) -> Self {
        let mut found = Self { statistic: 0.0, freedom: 0.0, moves: 0.0 };
        for (part, along) in directions {
            let others = 1.0 - part;
            if part > MIN_PART && others > MIN_PART {
                let along = along.powi(2) / variance;
                found.statistic += along / (part * others);
                found.moves += along / (others * others);
                found.freedom += 1.0;
            }
        }
        found.statistic /= found.freedom.max(1.0);
        found.moves = found.moves.sqrt();
        found
    }
}

/// Result of the test over all frames.
pub(super) struct Consistency {
    /// Whether most frames agree on the cameras.
    pub agree: bool,
    /// The frame that contradicts the cameras of all others most significantly, if any, and the
    /// shift of the cameras that it causes, in standard deviations.
    pub inconsistent: Option<(usize, f64)>,
}

impl Consistency {
    /// Tests all frames at a minimum; `None` if the cameras are known or there are too few frames.
    pub(super) fn of(settled: &Settled, loss: Loss) -> Option<Self> {
        let pulls = pulls(settled, loss)?;
        let tested = pulls.iter().flatten().filter(|pull| pull.freedom > 0.0);
        let tested: Vec<Pull> = tested.copied().collect();
        if tested.len() < MIN_VIEWS {
            return None;
        }
        let usual = median(tested.iter().map(|pull| pull.statistic).collect()).unwrap_or(0.0);
        let all: f64 = tested.iter().map(|pull| pull.freedom).sum();
        let deviations = |pull: &Pull| {
            let others = EFFICIENCY * (all - pull.freedom);
            deviate_of_f(pull.statistic / usual.max(1.0), pull.freedom, others)
        };
        let of_frames =
            pulls.iter().enumerate().filter_map(|(frame, pull)| Some((frame, (*pull)?)));
        let strange =
            of_frames.filter(|(_, pull)| pull.moves > HARMFUL && deviations(pull) > SIGNIFICANT);
        let most = strange.max_by(|a, b| deviations(&a.1).total_cmp(&deviations(&b.1)));
        let inconsistent = most.map(|(frame, pull)| (frame, pull.moves));
        Some(Self { agree: usual <= AGREEING, inconsistent })
    }
}

/// The test of each frame; `None` for a frame that alone determines nothing.
fn pulls(settled: &Settled, loss: Loss) -> Option<Vec<Option<Pull>>> {
    let problem = &settled.minimum.problem;
    if problem.cameras.iter().any(|camera| camera.roughness.is_some()) {
        return pulls_of_some(settled, loss);
    }
    let all = settled.minimum.normal.reduced(Damping::NONE)?.matrix;
    let whiten = whitener(&all)?;
    let variance = settled.whitening.sigma.powi(2);
    let of_frame = |frame: usize| {
        let (matrix, right) = reduced_of(problem, settled, loss, frame)?;
        let pull = &whiten * right;
        let eigen = (&whiten * matrix * whiten.transpose()).symmetric_eigen();
        let along = eigen.eigenvectors.column_iter().map(|direction| direction.dot(&pull));
        Some(Pull::of(eigen.eigenvalues.iter().copied().zip(along), variance))
    };
    Some((0..problem.frames.len()).into_par_iter().map(of_frame).collect())
}

/// The same for cameras with a spline lens, because a frame determines only some knots.
fn pulls_of_some(settled: &Settled, loss: Loss) -> Option<Vec<Option<Pull>>> {
    let problem = &settled.minimum.problem;
    let all = settled.minimum.normal.covariance_of_kept()?;
    let variance = settled.whitening.sigma.powi(2);
    let of_frame = |frame: usize| {
        let (matrix, right) = reduced_of(problem, settled, loss, frame)?;
        let share = LocalShare::of(&matrix, &all)?;
        let along = share.along(&right);
        Some(Pull::of(share.parts.iter().copied().zip(along.iter().copied()), variance))
    };
    Some((0..problem.frames.len()).into_par_iter().map(of_frame).collect())
}

/// The reduced normal equations (Schur complement) of a single frame, without priors: matrix and
/// right-hand side.
fn reduced_of(
    problem: &Problem,
    settled: &Settled,
    loss: Loss,
    frame: usize,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let mut part = problem.with_frames(|other| other == frame);
    part.cameras.iter_mut().for_each(|camera| camera.forget_expected());
    let whitening = settled.whitening.of(&part);
    let found = Normal::of(&part, &Layout::of(&part), &whitening, loss)?.reduced(Damping::NONE);
    let found = found.map(|Reduced { matrix, right, .. }| (matrix, right));
    found.filter(|(matrix, right)| matrix.iter().chain(right).all(|v| v.is_finite()))
}

/// The whitening matrix W of S, with W S Wᵀ = 1 over the directions that S determines; `None` if it determines none.
fn whitener(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if n == 0 || !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    let scale = DVector::from_fn(n, |i, _| matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let least = OPEN * eigen.eigenvalues.max().max(f64::MIN_POSITIVE);
    let known: Vec<usize> = (0..n).filter(|&i| eigen.eigenvalues[i] > least).collect();
    let whiten = DMatrix::from_fn(known.len(), n, |row, column| {
        let i = known[row];
        eigen.eigenvectors[(column, i)] * scale[column] / eigen.eigenvalues[i].sqrt()
    });
    (!known.is_empty()).then_some(whiten)
}
