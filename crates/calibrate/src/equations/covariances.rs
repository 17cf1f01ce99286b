//! The inverse of the normal matrix: covariances of all unknowns, and which are undetermined.

use deltille_core::damping::Damping;
use std::collections::BTreeSet;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SMatrix};
use rayon::prelude::*;

use super::cholesky::{cholesky, half_product, inverse, inverse_of_factor, squared};
use super::layout::Layout;
use super::normal::{Normal, PARTS_AT_A_TIME, Part, Reduced};
use super::robot::by_shared;
use crate::problem::bundle::Problem;
use deltille_core::camera::Pose;

/// The covariance of all unknowns for residuals of variance 1: of the shared unknowns, of each frame's pose, and of
/// each corner's offset.
pub(crate) struct Covariances {
    pub shared: DMatrix<f64>,
    /// The covariance of all kept unknowns.
    pub kept: DMatrix<f64>,
    /// A square root of the covariance of the shared unknowns.
    pub root: Root,
    pub frames: Vec<Matrix6<f64>>,
    pub corners: Vec<Matrix3<f64>>,
    /// The columns that the observations do not determine beyond rounding; their variances are lower bounds.
    pub loose: Vec<usize>,
    /// The columns whose standard deviation is more than [`TIED`] times what it would be if all other shared unknowns
    /// were known.
    pub tied: Vec<usize>,
}

/// A square root L of a covariance LLᵀ, and its inverse. Both come directly from the equations, so
/// that well determined directions remain exact next to poorly determined ones.
pub(crate) struct Root {
    pub half: DMatrix<f64>,
    pub inverse: DMatrix<f64>,
}

/// The inverse of equations, with the undetermined and the tied columns.
struct Inverse {
    matrix: DMatrix<f64>,
    root: Root,
    loose: Vec<usize>,
    tied: Vec<usize>,
}

/// The blocks on the diagonal, starting at a row.
fn blocks<const K: usize>(matrix: &DMatrix<f64>, first: usize) -> Vec<SMatrix<f64, K, K>> {
    let block = |i: usize| matrix.fixed_view::<K, K>(i, i).into_owned();
    (first..matrix.nrows()).step_by(K).map(block).collect()
}

fn fixed<const K: usize>(matrix: &DMatrix<f64>) -> SMatrix<f64, K, K> {
    matrix.fixed_view::<K, K>(0, 0).into_owned()
}

/// Eigenvalue below which the reduced equations are singular, after scaling by the diagonal that they would have with
/// known poses: elimination leaves errors of a few dozen times the machine precision.
const SINGULAR: f64 = 1e-14;

/// Trace of the inverse, relative to 1 / [`SINGULAR`], below which no eigenvalue is singular and rounding is of no
/// importance.
const CERTAIN: f64 = 0.01;

/// Minimum component of an unknown that is involved in a direction, as a fraction of the largest
/// component.
const INVOLVED: f64 = 0.3;

/// Inflation of the standard deviation above which a single parameter is not meaningful. Equally
/// good values then form a valley that is a thousand times as long as it is wide. Standard
/// deviations assume a straight valley, but a bend by a thousandth of its length leads out of it.
/// The terms of a short polynomial remain below this limit.
const TIED: f64 = 1000.0;

impl Normal {
    /// The inverse of the equations; `None` if the pose of a frame is undetermined.
    pub(crate) fn covariances(&self, layout: &Layout) -> Option<Covariances> {
        let Reduced { matrix, inverses, .. } = self.reduced(Damping::NONE)?;
        let Inverse { matrix: kept, root, loose, tied } = self.invert(matrix)?;
        let firsts: Vec<usize> = (0..inverses.len()).step_by(PARTS_AT_A_TIME).collect();
        let some_parts = |first: usize| {
            let some = first..(first + PARTS_AT_A_TIME).min(inverses.len());
            let [_, through] = self.through(&inverses, some.clone());
            let carried = half_product(&kept, &through);
            let of_part = |(index, inverse): (usize, &DMatrix<f64>)| {
                let (first, size) = (index * inverse.nrows(), inverse.nrows());
                let half = through.columns(first, size).tr_mul(&carried.columns(first, size));
                inverse + &half + half.transpose()
            };
            inverses[some].iter().enumerate().map(of_part).collect::<Vec<_>>()
        };
        let parts = firsts.into_par_iter().map(some_parts).collect::<Vec<_>>().concat();
        let (frames, corners) = match (layout.frames, layout.corners) {
            (Some(first), _) => (blocks(&kept, first), parts.iter().map(fixed).collect()),
            (None, Some(first)) => (parts.iter().map(fixed).collect(), blocks(&kept, first)),
            (None, None) => (parts.iter().map(fixed).collect(), Vec::new()),
        };
        let shared = kept.view((0, 0), (self.shared, self.shared)).into_owned();
        Some(Covariances { shared, kept, root, frames, corners, loose, tied })
    }

    /// The covariance of all unknowns for residuals of variance 1: the kept ones, then those of the parts. `None` if a part is
    /// undetermined.
    pub(crate) fn covariance_of_all(&self, found: &Covariances) -> Option<DMatrix<f64>> {
        let inverses = self.inverses(Damping::NONE)?;
        let [_, through] = self.through(&inverses, 0..inverses.len());
        let (kept, parts) = (found.kept.nrows(), through.ncols());
        let carried = &found.kept * &through;
        let mut all = DMatrix::zeros(kept + parts, kept + parts);
        all.view_mut((0, 0), (kept, kept)).copy_from(&found.kept);
        all.view_mut((0, kept), (kept, parts)).copy_from(&-&carried);
        all.view_mut((kept, 0), (parts, kept)).tr_copy_from(&-&carried);
        all.view_mut((kept, kept), (parts, parts)).copy_from(&through.tr_mul(&carried));
        let mut first = kept;
        for inverse in &inverses {
            let size = inverse.nrows();
            let mut own = all.view_mut((first, first), (size, size));
            own += inverse;
            first += size;
        }
        Some(all)
    }

    /// The covariance of the kept unknowns for residuals of variance 1; `None` if any is undetermined.
    pub(crate) fn covariance_of_kept(&self) -> Option<DMatrix<f64>> {
        let matrix = self.reduced(Damping::NONE)?.matrix;
        let n = matrix.nrows();
        let scale = DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let inverse = inverse(cholesky(scaled)?);
        Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }

    /// Solves the equations for right-hand sides (columns) of the shared unknowns and the corner
    /// offsets, in this order, which are zero for the poses of frames. `None` if a corner is
    /// undetermined.
    pub(crate) fn solve_without_frames(
        &self,
        layout: &Layout,
        found: &Covariances,
        right: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        if layout.corners.is_some() {
            return Some(&found.kept * right);
        }
        let shared = self.shared;
        let mut of_parts = right.rows(shared, right.nrows() - shared).into_owned();
        self.solve_parts(&mut of_parts)?;
        let mut of_kept = DMatrix::zeros(layout.count, right.ncols());
        of_kept.rows_mut(0, shared).copy_from(&right.rows(0, shared));
        let each = || {
            let parts = (0..self.parts.len()).step_by(PARTS_AT_A_TIME);
            let parts = parts.map(|first| first..(first + PARTS_AT_A_TIME).min(self.parts.len()));
            parts.map(|parts| (3 * parts.start, self.b.between(parts)))
        };
        for (first, between) in each() {
            of_kept.gemm(-1.0, &between, &of_parts.rows(first, between.ncols()), 1.0);
        }
        let kept = (&found.kept * of_kept).transpose();
        let mut carried = DMatrix::zeros(of_parts.nrows(), right.ncols());
        for (first, between) in each() {
            carried.rows_mut(first, between.ncols()).tr_copy_from(&(&kept * &between));
        }
        self.solve_parts(&mut carried)?;
        let mut solution = right.clone();
        solution.rows_mut(0, shared).tr_copy_from(&kept.columns(0, shared));
        solution.rows_mut(shared, carried.nrows()).copy_from(&(of_parts - carried));
        Some(solution)
    }

    /// Solves the equations of each part separately.
    fn solve_parts(&self, right: &mut DMatrix<f64>) -> Option<()> {
        let mut first = 0;
        for Part { c, .. } in &self.parts {
            c.clone().cholesky()?.solve_mut(&mut right.rows_mut(first, c.nrows()));
            first += c.nrows();
        }
        Some(())
    }

    /// For each frame with a link, the covariance of its predicted residual from the errors of the unknowns, for
    /// residuals of corners of variance 1. The poses of frames must be eliminated.
    pub(crate) fn of_links(
        &self,
        problem: &Problem,
        layout: &Layout,
        found: &Covariances,
    ) -> Option<Vec<Option<Matrix6<f64>>>> {
        let (robot, first) = (problem.robot.as_ref()?, layout.robot?);
        let inverses = self.inverses(Damping::NONE)?;
        let of_frame = |(frame, pose): (usize, &Pose)| {
            // A frame without a used link has a prediction, too.
            let measured = robot.poses[frame].unwrap_or_else(|| robot.predicted(pose));
            let link = robot.link(pose, &measured);
            let through = link.by_frame * &inverses[frame];
            let mut by_kept = -(&through * self.b.between(frame..frame + 1).transpose());
            let own = by_shared(robot, &link);
            let mut of_robot = by_kept.columns_mut(first, own.ncols());
            of_robot += own;
            let covariance =
                &by_kept * &found.kept * by_kept.transpose() + through * link.by_frame.transpose();
            Some(Matrix6::from_column_slice(covariance.as_slice()))
        };
        Some(problem.frames.iter().enumerate().map(of_frame).collect())
    }

    /// The inverse of the reduced equations; the root is that of the shared unknowns, which alone may be undetermined.
    fn invert(&self, reduced: DMatrix<f64>) -> Option<Inverse> {
        let (n, shared) = (reduced.nrows(), self.shared);
        let others = n - shared;
        if others == 0 {
            return Some(self.invert_shared(reduced));
        }
        let own = reduced.view((shared, shared), (others, others)).into_owned();
        let across = reduced.view((shared, 0), (others, shared)).into_owned();
        let of_shared = reduced.view((0, 0), (shared, shared)).into_owned();
        drop(reduced);
        let mut own = inverse(cholesky(own)?);
        let through = &own * &across;
        let of_shared = of_shared - across.tr_mul(&through);
        let found = self.invert_shared(of_shared);
        let of_shared = &found.matrix;
        let carried = &through * of_shared;
        let mut inverse = DMatrix::zeros(n, n);
        inverse.view_mut((0, 0), (shared, shared)).copy_from(of_shared);
        inverse.view_mut((shared, 0), (others, shared)).copy_from(&-&carried);
        inverse.view_mut((0, shared), (shared, others)).copy_from(&-carried.transpose());
        own.gemm(1.0, &carried, &through.transpose(), 1.0);
        inverse.view_mut((shared, shared), (others, others)).copy_from(&own);
        Some(Inverse { matrix: inverse, ..found })
    }

    /// The inverse of the equations of the shared unknowns.
    fn invert_shared(&self, reduced: DMatrix<f64>) -> Inverse {
        let n = reduced.nrows();
        if n == 0 {
            let root = Root { half: reduced.clone(), inverse: reduced.clone() };
            return Inverse { matrix: reduced, root, loose: Vec::new(), tied: Vec::new() };
        }
        let scale = DVector::from_fn(n, |i, _| 1.0 / self.a[(i, i)].max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| reduced[(i, j)] * scale[i] * scale[j]);
        let found = of_determined(&scaled).unwrap_or_else(|| of_undetermined(&scaled));
        let (inverse, [half, inverse_half], loose) = found;
        let is_tied = |&i: &usize| inverse[(i, i)] * scaled[(i, i)] > TIED * TIED;
        let tied = (0..n).filter(is_tied).collect();
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let root = Root {
            half: DMatrix::from_fn(n, n, |i, j| scale[i] * half[(i, j)]),
            inverse: DMatrix::from_fn(n, n, |i, j| inverse_half[(i, j)] / scale[j]),
        };
        Inverse { matrix: inverse, root, loose, tied }
    }
}

/// The inverse of a matrix, a square root of the inverse and the inverse of this root, and the undetermined columns.
type Inverted = (DMatrix<f64>, [DMatrix<f64>; 2], Vec<usize>);

/// The inverse by Cholesky's method; `None` if the matrix could be singular.
fn of_determined(scaled: &DMatrix<f64>) -> Option<Inverted> {
    let factor = cholesky(scaled.clone())?;
    let upper = factor.l().transpose();
    let lower = inverse_of_factor(factor);
    let inverse = squared(&lower);
    // The smallest eigenvalue is at least the reciprocal of the trace of the inverse.
    (inverse.trace() < CERTAIN / SINGULAR)
        .then(|| (inverse, [lower.transpose(), upper], Vec::new()))
}

/// The inverse by eigenvalues; those less than [`SINGULAR`] are raised to it.
fn of_undetermined(scaled: &DMatrix<f64>) -> Inverted {
    let n = scaled.nrows();
    let eigen = scaled.clone().symmetric_eigen();
    let mut loose = BTreeSet::new();
    for (&value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if value <= SINGULAR {
            let most = direction.amax();
            loose.extend((0..n).filter(|&i| direction[i].abs() >= INVOLVED * most));
        }
    }
    let roots = eigen.eigenvalues.map(|value| value.max(SINGULAR).sqrt());
    let turn = &eigen.eigenvectors;
    let half = DMatrix::from_fn(n, n, |i, j| turn[(i, j)] / roots[j]);
    let inverse_half = DMatrix::from_fn(n, n, |i, j| roots[i] * turn[(j, i)]);
    (&half * half.transpose(), [half, inverse_half], loose.into_iter().collect())
}
