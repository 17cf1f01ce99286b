//! Empirical covariance of the shared unknowns, from the scatter between frames.
//!
//! Standard deviations that follow from the noise of corners take the model of cameras and target
//! for exact. Model errors, such as a board that is not quite flat, bias the estimate differently
//! in every frame. So the gradient of each frame is taken for one draw, and the scatter of all
//! gives the cluster-robust covariance with the correction CR2, which equals that of the noise
//! where there are no model errors (Bell & McCaffrey 2002).
//!
//! ```text
//!     yᵥ = (I − LᵀHᵥL)^−½ Lᵀ gᵥ,    Σ = LLᵀ       Hᵥ, gᵥ: normal equations and gradient of frame v
//!     S = L (Σᵥ yᵥ yᵥᵀ) Lᵀ
//! ```
//!
//! The prior on the knots of a spline does not come from any frame: with P its part of the normal
//! equations, frames scatter only as I − LᵀPL, and LᵀPL is added with its nominal size.
//!
//! F frames determine at most F − 1 directions, and each only roughly; so S is shrunk towards a
//! multiple of the covariance that follows from noise, as far as its own scatter calls for (Ledoit
//! & Wolf 2004).

use nalgebra::{DMatrix, DVector, Matrix6};
use rayon::prelude::*;

use super::local_share::LocalShare;
use super::loss::Loss;
use super::minimise::Minimum;
use super::normal::{Covariances, Local};
use super::weights::Whitening;

/// Least number of frames for an empirical covariance.
const LEAST_FRAMES: usize = 5;

/// Greatest leverage of one frame on a direction that is corrected for: beyond it no other frame
/// tests it.
const MOST_OF_ONE: f64 = 0.9;

/// An empirical covariance.
pub(super) struct Observed {
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom from which a variance of it is known.
    pub freedom: f64,
}

/// The empirical covariance of the unknowns that all frames share (n × n, in the order of the
/// layout); `None` with too few frames, or where nothing is shared.
pub(super) fn observed(
    minimum: &Minimum,
    whitening: &Whitening,
    loss: Loss,
    found: &Covariances,
) -> Option<Observed> {
    let frames = minimum.problem.frames.len();
    if frames < LEAST_FRAMES || minimum.layout.shared == 0 {
        return None;
    }
    let pull = |frame: usize| pull_of(minimum, whitening, loss, found, frame);
    let columns = (0..frames).into_par_iter().map(pull).collect::<Option<Vec<_>>>()?;
    let mut pulls = DMatrix::from_columns(&columns);
    // At the minimum they sum to zero; the remainder of the minimisation is no scatter.
    let mean = pulls.column_mean();
    pulls.column_iter_mut().for_each(|mut pull| pull -= &mean);
    let count = frames as f64;
    let expected = expected(minimum, whitening, found);
    let (scatter, share) = shrunk(&pulls, expected.as_ref());
    let mut scatter = scatter * (count / (count - 1.0));
    // The common level is known from all directions together.
    let mut directions = minimum.layout.shared as f64;
    if let Some(expected) = expected {
        directions -= expected.trace();
        scatter += expected * whitening.sigma.powi(2);
    }
    Some(Observed {
        covariance: &found.root.half * scatter * found.root.half.transpose(),
        freedom: (count - 1.0) * (1.0 + share * (directions - 1.0)),
    })
}

/// LᵀPL of the priors on the knots of splines; `None` where there are none.
fn expected(minimum: &Minimum, whitening: &Whitening, found: &Covariances) -> Option<DMatrix<f64>> {
    let Minimum { problem, layout, .. } = minimum;
    let (mut matrix, mut right) =
        (DMatrix::zeros(layout.shared, layout.shared), DVector::zeros(layout.shared));
    let mut is_some = false;
    for (camera, parameters) in problem.cameras.iter().zip(&layout.parameters) {
        let Some(roughness) = &camera.roughness else { continue };
        roughness.add(&camera.camera, parameters, whitening.sigma, &mut matrix, &mut right);
        is_some = true;
    }
    is_some.then(|| found.root.half.tr_mul(&matrix) * &found.root.half)
}

/// The gradient of a frame on the shared unknowns with the correction CR2, in units of the effect
/// of noise.
fn pull_of(
    minimum: &Minimum,
    whitening: &Whitening,
    loss: Loss,
    found: &Covariances,
    frame: usize,
) -> Option<DVector<f64>> {
    let Minimum { problem, normal, layout, .. } = minimum;
    let n = layout.shared;
    let (mut own, mut across, mut pose) =
        (DMatrix::<f64>::zeros(n, n), DMatrix::<f64>::zeros(n, 6), Matrix6::<f64>::zeros());
    let mut pull = DVector::<f64>::zeros(layout.count);
    for (block, weights) in problem.blocks.iter().zip(&whitening.blocks) {
        if block.frame != frame {
            continue;
        }
        let local = Local::of(problem, layout, block, weights, loss, whitening.sigma)?;
        let shared = local.columns.len();
        for (i, &row) in local.columns.iter().enumerate() {
            pull[row] += local.right[i];
            for (&column, value) in local.columns.iter().zip(local.row(i)) {
                own[(row, column)] += value;
            }
        }
        for i in 0..6 {
            let (of_shared, of_pose) = local.row(shared + i).split_at(shared);
            local.columns.iter().zip(of_shared).for_each(|(&row, v)| across[(row, i)] += v);
            of_pose.iter().enumerate().for_each(|(j, value)| pose[(i, j)] += value);
        }
        // The pose of the frame is at its own optimum.
        for corner in &local.corners {
            normal.pull_of_corner(layout, corner, &mut pull);
        }
    }
    let root = &found.root;
    let pull = if problem.map.is_some() {
        // Corner offsets absorb most of what a frame tells by itself, and each frame has the same
        // leverage on all of them.
        let frames = problem.frames.len() as f64;
        &root.inverse * (&found.across * pull) * (frames / (frames - 1.0)).sqrt()
    } else {
        own.fill_upper_triangle_with_lower_triangle();
        pose.fill_upper_triangle_with_lower_triangle();
        let through = pose.cholesky()?.solve(&across.transpose());
        let own: DMatrix<f64> = own - &across * through;
        // A frame touches only a few knots of a spline.
        if problem.cameras.iter().any(|camera| camera.roughness.is_some()) {
            return by_some(&own, &pull, found);
        }
        let share = (root.half.tr_mul(&own) * &root.half).symmetric_eigen();
        let grown =
            share.eigenvalues.map(|part| (1.0 - part.clamp(0.0, MOST_OF_ONE)).sqrt().recip());
        let turned = share.eigenvectors.tr_mul(&root.half.tr_mul(&pull)).component_mul(&grown);
        &share.eigenvectors * turned
    };
    pull.iter().all(|v| v.is_finite()).then_some(pull)
}

/// The same for a frame that touches only some of the unknowns.
fn by_some(own: &DMatrix<f64>, pull: &DVector<f64>, found: &Covariances) -> Option<DVector<f64>> {
    let share = LocalShare::of(own, &found.shared)?;
    let more = |part: f64| (1.0 - part.clamp(0.0, MOST_OF_ONE)).sqrt().recip() - 1.0;
    let more = share.along(pull).component_mul(&share.parts.map(more));
    let pull = found.root.half.tr_mul(pull) + share.spread(&more, &found.root.half);
    pull.iter().all(|v| v.is_finite()).then_some(pull)
}

/// The sum of x xᵀ over the columns, shrunk towards a multiple of the identity (Ledoit & Wolf
/// 2004), and the degree of shrinkage from 0 to 1; with a prior (`expected`), towards a multiple of
/// the identity less that.
fn shrunk(columns: &DMatrix<f64>, expected: Option<&DMatrix<f64>>) -> (DMatrix<f64>, f64) {
    let (n, count) = (columns.nrows() as f64, columns.ncols() as f64);
    let columns = columns * count.sqrt();
    let mean = &columns * columns.transpose() / count;
    let identity = DMatrix::identity(columns.nrows(), columns.nrows());
    let level = match expected {
        Some(expected) => {
            let left = identity - expected;
            let level = mean.trace() / left.trace();
            left * level
        }
        None => identity * (mean.trace() / n),
    };
    let spread = (&mean - &level).norm_squared();
    let scatter = columns.column_iter().map(|x| (x * x.transpose() - &mean).norm_squared());
    let uncertain = (scatter.sum::<f64>() / (count * count)).min(spread);
    let share = if spread > 0.0 { uncertain / spread } else { 1.0 };
    (level * share + mean * (1.0 - share), share)
}
