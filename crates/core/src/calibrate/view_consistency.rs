//! Views that speak for another camera than all others do: another zoom, focus or crop.
//!
//! At the minimum the pulls of all views on the camera add up to nothing. With S = Σ Sᵥ the reduced normal
//! equations, each view's pull s by chance has the covariance Sᵥ − Sᵥ S⁻¹ Sᵥ, so that in units of it
//!
//! ```text
//!     T = sᵀ (Sᵥ − Sᵥ S⁻¹ Sᵥ)⁺ s
//! ```
//!
//! is χ² of as many degrees of freedom as the view tells of the camera: whether the camera of this view
//! and that of all others are the same (Chow 1960). A stranger makes it larger in all views until it has gone; what a
//! model leaves does so in any case, and then no view is to blame.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::lack_of_fit::deviate_of_f;
use super::local_share::LocalShare;
use super::loss::Loss;
use super::normal::{Layout, Normal, Reduced};
use super::problem::Problem;
use super::reweighting::Settled;
use crate::statistics::median;

/// Fewest views of which one can stand out: three are left then.
const LEAST_VIEWS: usize = 4;

/// A direction of the camera in which all views together tell less than this part of what they tell in the
/// best one is open, and of which a view tells less than this part is left to the others.
const OPEN: f64 = 1e-9;
const LEAST_PART: f64 = 1e-3;

/// Views that mostly agree have a median of T, by its degrees of freedom, below this: 0.9 is usual.
const AGREEING: f64 = 1.5;

/// A view is a stranger from so many deviations on, as scattered as the views are: of a million hardly one by chance.
const SIGNIFICANT: f64 = 5.0;

/// And where the camera is so many of its deviations elsewhere without the view.
const HARMFUL: f64 = 1.0;

/// A median of squares is as good as the mean of this part of them.
const EFFICIENCY: f64 = 0.64;

/// What a view says of the camera against all others.
#[derive(Clone, Copy, Debug)]
struct Pull {
    /// T by its degrees of freedom, of variance 1.
    strange: f64,
    freedom: f64,
    /// By how many deviations the camera moves without the view.
    moves: f64,
}

impl Pull {
    /// Of the parts of directions that the view tells, and its pull along them.
    fn of(directions: impl Iterator<Item = (f64, f64)>, variance: f64) -> Self {
        let mut found = Self { strange: 0.0, freedom: 0.0, moves: 0.0 };
        for (part, along) in directions {
            let others = 1.0 - part;
            if part > LEAST_PART && others > LEAST_PART {
                let along = along.powi(2) / variance;
                found.strange += along / (part * others);
                found.moves += along / (others * others);
                found.freedom += 1.0;
            }
        }
        found.strange /= found.freedom.max(1.0);
        found.moves = found.moves.sqrt();
        found
    }
}

/// What frames say of the cameras.
pub(super) struct Opinions {
    /// Whether most say the same.
    pub agree: bool,
    /// The frame that speaks most for other cameras than all others, if one does; and by how many deviations it
    /// moves them.
    pub stranger: Option<(usize, f64)>,
}

impl Opinions {
    /// `None` where cameras are known, or frames are few.
    pub fn of(settled: &Settled, loss: Loss) -> Option<Self> {
        let pulls = pulls(settled, loss)?;
        let told = pulls.iter().flatten().filter(|pull| pull.freedom > 0.0);
        let told: Vec<Pull> = told.copied().collect();
        if told.len() < LEAST_VIEWS {
            return None;
        }
        let usual = median(told.iter().map(|pull| pull.strange).collect()).unwrap_or(0.0);
        let all: f64 = told.iter().map(|pull| pull.freedom).sum();
        let deviations = |pull: &Pull| {
            let others = EFFICIENCY * (all - pull.freedom);
            deviate_of_f(pull.strange / usual.max(1.0), pull.freedom, others)
        };
        let of_frames =
            pulls.iter().enumerate().filter_map(|(frame, pull)| Some((frame, (*pull)?)));
        let strange =
            of_frames.filter(|(_, pull)| pull.moves > HARMFUL && deviations(pull) > SIGNIFICANT);
        let most = strange.max_by(|a, b| deviations(&a.1).total_cmp(&deviations(&b.1)));
        let stranger = most.map(|(frame, pull)| (frame, pull.moves));
        Some(Self { agree: usual <= AGREEING, stranger })
    }
}

/// What each frame says; `None` where one says nothing by itself.
fn pulls(settled: &Settled, loss: Loss) -> Option<Vec<Option<Pull>>> {
    let problem = &settled.minimum.problem;
    if problem.cameras.iter().any(|camera| camera.roughness.is_some()) {
        return pulls_of_some(settled, loss);
    }
    let all = settled.minimum.normal.reduced(0.0)?.matrix;
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

/// The same where a frame tells only of some of the unknowns.
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

/// The reduced equations of a frame by itself.
fn reduced_of(
    problem: &Problem,
    settled: &Settled,
    loss: Loss,
    frame: usize,
) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let mut part = problem.with_frames(|other| other == frame);
    part.cameras.iter_mut().for_each(|camera| camera.forget_expected());
    let whitening = settled.whitening.of(&part);
    let found = Normal::of(&part, &Layout::of(&part), &whitening, loss)?.reduced(0.0);
    let found = found.map(|Reduced { matrix, right, .. }| (matrix, right));
    found.filter(|(matrix, right)| matrix.iter().chain(right).all(|v| v.is_finite()))
}

/// W of a matrix S: W S Wᵀ = 1, without the directions that S leaves open; `None` where that is all.
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
