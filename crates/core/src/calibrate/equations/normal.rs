//! Normal equations of a problem, with the poses of the frames eliminated.
//!
//! ```text
//!     ⎡ A   B ⎤ ⎡ kept  ⎤   ⎡ a ⎤      A: cameras and panels, dense
//!     ⎣ Bᵀ  C ⎦ ⎣ parts ⎦ = ⎣ c ⎦      C: a 6 × 6 block for each frame
//!
//!     (A − Σ B C⁻¹ Bᵀ) kept = a − Σ B C⁻¹ c,     part = C⁻¹ (c − Bᵀ kept)
//! ```
//!
//! Where corners of the target are unknown too, no frame has an unknown in common with another frame but
//! through them, nor a corner with another corner but through frames: of the two the one that has more
//! unknowns is eliminated, and the other is kept.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat3, DVec2, DVec3};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix6, SMatrix, U6, Vector3, Vector6};
use rayon::prelude::*;

use crate::calibrate::input::loss::Loss;
use crate::calibrate::input::observation::Observation;
use crate::calibrate::problem::bundle::{Block, Problem, moved};
use crate::calibrate::problem::corner_map::CornerMap;
use crate::calibrate::problem::shape;
use crate::calibrate::problem::whitening::Whitening;
use crate::camera::{Lens, MAX_PARAMETERS, MOST_TOUCHED, PROJECTION_PARAMETERS, Projection};

/// Which column of the unknowns that are kept belongs to what.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::calibrate) struct Layout {
    /// For each camera the parameters that are unknown, and their columns.
    pub parameters: Vec<Vec<(usize, usize)>>,
    /// First of the six columns of a camera's pose.
    pub cameras: Vec<Option<usize>>,
    /// First of the six columns of a panel's pose.
    pub panels: Vec<Option<usize>>,
    /// First of the six columns of a target's pose.
    pub targets: Vec<Option<usize>>,
    /// First of the columns of the sheet's shape.
    pub shape: Option<usize>,
    /// Number of columns of what all frames share: all of the above.
    pub shared: usize,
    /// First of the columns of the frames' poses; `None` where they are eliminated.
    pub frames: Option<usize>,
    /// First of the columns of the corners' offsets; `None` where they are eliminated, or known.
    pub corners: Option<usize>,
    /// Number of columns.
    pub count: usize,
}

impl Layout {
    pub(in crate::calibrate) fn of(problem: &Problem) -> Self {
        let mut count = 0;
        let mut take = |columns: usize| {
            count += columns;
            count - columns
        };
        let mut parameters = Vec::new();
        let mut cameras = Vec::new();
        for camera in &problem.cameras {
            let free = (0..camera.free.len()).filter(|&i| camera.free[i]);
            parameters.push(free.map(|i| (i, take(1))).collect());
            cameras.push(camera.pose_free.then(|| take(6)));
        }
        let panels = problem.panels.iter().map(|p| p.pose_free.then(|| take(6))).collect();
        let targets = problem.targets.iter().map(|t| t.pose_free.then(|| take(6))).collect();
        let shape = problem.shape.map(|_| take(shape::COUNT));
        let shared = take(0);
        let of_frames = 6 * problem.frames.len();
        let of_corners = problem.map.as_ref().map(|map| 3 * map.len());
        let (frames, corners) = match of_corners {
            None => (None, None),
            Some(of_corners) if of_corners <= of_frames => (None, Some(take(of_corners))),
            Some(_) => (Some(take(of_frames)), None),
        };
        Self { parameters, cameras, panels, targets, shape, shared, frames, corners, count }
    }
}

/// The equations of unknowns that are eliminated: a frame, or a corner.
#[derive(Clone, Debug)]
struct Part {
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    right: DVector<f64>,
}

/// The normal equations at a point, and what the residuals cost there.
#[derive(Clone, Debug)]
pub(in crate::calibrate) struct Normal {
    pub cost: f64,
    /// Columns of what all frames share, the first.
    shared: usize,
    a: DMatrix<f64>,
    right: DVector<f64>,
    /// Frames, or corners.
    parts: Vec<Part>,
}

/// A step of all unknowns.
pub(in crate::calibrate) struct Step {
    shared: DVector<f64>,
    frames: Vec<Vector6<f64>>,
    corners: Vec<Vector3<f64>>,
}

/// The covariance of all unknowns for residuals of variance 1: of the shared ones, of each frame's pose, and
/// of each corner's offset.
pub(in crate::calibrate) struct Covariances {
    pub shared: DMatrix<f64>,
    /// Of all that are kept.
    pub kept: DMatrix<f64>,
    /// A square root of that of the shared unknowns.
    pub root: Root,
    pub frames: Vec<Matrix6<f64>>,
    pub corners: Vec<Matrix3<f64>>,
    /// The columns that nothing tells apart beyond what rounding leaves; their variances are the
    /// least that they can be.
    pub loose: Vec<usize>,
    /// The columns whose deviation is [`TIED`] times what it were if all other shared ones were known.
    pub tied: Vec<usize>,
}

/// A square root L of a covariance, LLᵀ, and its inverse, both from the equations, so that what is well determined is
/// exact beside what is not.
pub(in crate::calibrate) struct Root {
    pub half: DMatrix<f64>,
    pub inverse: DMatrix<f64>,
}

/// The inverse of equations, and the columns that they leave open, and tie to others.
struct Inverse {
    matrix: DMatrix<f64>,
    root: Root,
    loose: Vec<usize>,
    tied: Vec<usize>,
}

impl Normal {
    /// `None` where a corner is out of its camera's reach.
    pub(in crate::calibrate) fn of(
        problem: &Problem,
        layout: &Layout,
        whitening: &Whitening,
        loss: Loss,
    ) -> Option<Self> {
        let n = layout.count;
        let part = |size: usize| Part {
            b: DMatrix::zeros(n, size),
            c: DMatrix::zeros(size, size),
            right: DVector::zeros(size),
        };
        let mut normal = Self {
            cost: 0.0,
            shared: layout.shared,
            a: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            parts: match (layout.frames, &problem.map) {
                (Some(_), Some(map)) => vec![part(3); map.len()],
                _ => vec![part(6); problem.frames.len()],
            },
        };
        let blocks: Vec<_> = problem.blocks.iter().zip(&whitening.blocks).collect();
        for some in blocks.chunks(BLOCKS_AT_A_TIME) {
            let locals = some.par_iter().map(|(block, whitening_of)| {
                Local::of(problem, layout, block, whitening_of, loss, whitening.sigma)
            });
            // Summed in the order of the blocks, however many threads there are.
            let locals = locals.collect::<Vec<Option<Local>>>();
            for ((block, _), local) in some.iter().zip(locals) {
                normal.add(layout, &local?, block.frame);
            }
        }
        if let Some(map) = &problem.map {
            normal.add_map(map, layout, whitening.sigma);
        }
        normal.a.fill_upper_triangle_with_lower_triangle();
        for (panel, first) in problem.panels.iter().zip(&layout.panels) {
            if let (Some(prior), Some(first)) = (&panel.prior, *first) {
                normal.add_prior(prior.off(&panel.target_from_panel), first, whitening.sigma);
            }
        }
        for (camera, parameters) in problem.cameras.iter().zip(&layout.parameters) {
            if let Some(roughness) = &camera.roughness {
                let (matrix, right) = (&mut normal.a, &mut normal.right);
                normal.cost +=
                    roughness.add(&camera.camera, parameters, whitening.sigma, matrix, right);
            }
        }
        normal.cost.is_finite().then_some(normal)
    }

    /// Adds what is known of a pose beforehand; `sigma` is the deviation of a whitened coordinate,
    /// the unit in which costs are counted.
    fn add_prior(
        &mut self,
        (off, information): (Vector6<f64>, Matrix6<f64>),
        first: usize,
        sigma: f64,
    ) {
        let information = information * (sigma * sigma);
        let pull = information * off;
        self.cost += off.dot(&pull);
        for i in 0..6 {
            for j in 0..6 {
                self.a[(first + i, first + j)] += information[(i, j)];
            }
            self.right[first + i] -= pull[i];
        }
    }

    /// Adds what is expected of the corners' offsets.
    fn add_map(&mut self, map: &CornerMap, layout: &Layout, sigma: f64) {
        let weights = map.prior_mm.map(|sd| (sigma / sd).powi(2));
        for (index, offset) in map.offsets_mm.iter().enumerate() {
            for k in 0..3 {
                let pull = weights[k] * offset[k];
                self.cost += offset[k] * pull;
                match layout.corners {
                    Some(first) => {
                        let column = first + 3 * index + k;
                        self.a[(column, column)] += weights[k];
                        self.right[column] -= pull;
                    }
                    None => {
                        self.parts[index].c[(k, k)] += weights[k];
                        self.parts[index].right[k] -= pull;
                    }
                }
            }
        }
    }

    /// Adds a block, to the lower triangle of what is kept only: its columns ascend, and its last six are
    /// those of the frame's pose.
    fn add(&mut self, layout: &Layout, local: &Local, frame: usize) {
        self.cost += local.cost;
        let shared = local.columns.len();
        for (i, &row) in local.columns.iter().enumerate() {
            for (&column, value) in local.columns.iter().zip(local.row(i)) {
                self.a[(row, column)] += value;
            }
            self.right[row] += local.right[i];
        }
        for i in 0..6 {
            let (of_shared, of_frame) = local.row(shared + i).split_at(shared);
            let right = local.right[shared + i];
            if let Some(first) = layout.frames {
                let first = first + 6 * frame;
                for (&column, value) in local.columns.iter().zip(of_shared) {
                    self.a[(first + i, column)] += value;
                }
                for (j, value) in of_frame.iter().enumerate() {
                    self.a[(first + i, first + j)] += value;
                }
                self.right[first + i] += right;
                continue;
            }
            let part = &mut self.parts[frame];
            for (&row, value) in local.columns.iter().zip(of_shared) {
                part.b[(row, i)] += value;
            }
            for (j, value) in of_frame.iter().enumerate() {
                part.c[(i, j)] += value;
                if j < i {
                    part.c[(j, i)] += value;
                }
            }
            part.right[i] += right;
        }
        local.corners.iter().for_each(|corner| self.add_corner(layout, local, corner, frame));
    }

    /// Adds what a block says of a corner's offset.
    fn add_corner(&mut self, layout: &Layout, local: &Local, corner: &OfCorner, frame: usize) {
        let (of_shared, of_frame) = corner.cross.split_at(local.columns.len());
        for k in 0..3 {
            if let Some(first) = layout.corners {
                let row = first + 3 * corner.index + k;
                for (&column, values) in local.columns.iter().zip(of_shared) {
                    self.a[(row, column)] += values[k];
                }
                for (i, values) in of_frame.iter().enumerate() {
                    self.parts[frame].b[(row, i)] += values[k];
                }
                for l in 0..=k {
                    self.a[(row, first + 3 * corner.index + l)] += corner.own[(k, l)];
                }
                self.right[row] += corner.right[k];
            } else if let Some(first) = layout.frames {
                let part = &mut self.parts[corner.index];
                let of_frame =
                    of_frame.iter().enumerate().map(|(i, of)| (first + 6 * frame + i, of));
                let of_shared = local.columns.iter().copied().zip(of_shared);
                for (row, values) in of_shared.chain(of_frame) {
                    part.b[(row, k)] += values[k];
                }
                for l in 0..3 {
                    part.c[(k, l)] += corner.own[(k, l)];
                }
                part.right[k] += corner.right[k];
            }
        }
    }

    /// The step of Levenberg and Marquardt: diagonals grow by the factor 1 + `damping`. `None`
    /// where the equations have no unique solution.
    pub(in crate::calibrate) fn step(&self, layout: &Layout, damping: f64) -> Option<Step> {
        let Reduced { matrix, right, inverses } = self.reduced(damping)?;
        let kept = solve_scaled(matrix, right)?;
        let parts = self.parts.iter().zip(inverses);
        let parts = parts.map(|(part, inverse)| inverse * (&part.right - part.b.tr_mul(&kept)));
        let (frames, corners) = layout.split(&kept, &parts.collect::<Vec<_>>());
        let shared = kept.rows(0, self.shared).into_owned();
        let step = Step { shared, frames, corners };
        kept.iter().all(|v| v.is_finite()).then_some(step)
    }

    /// By how much the cost falls along a step if the equations hold.
    pub(in crate::calibrate) fn predicted(&self, layout: &Layout, step: &Step) -> f64 {
        let parts = self.parts.iter().map(|part| &part.right).collect::<Vec<_>>();
        let (frames, corners) = layout.split(&self.right, &parts);
        let of_frames = frames.iter().zip(&step.frames).map(|(right, step)| right.dot(step));
        let of_corners = corners.iter().zip(&step.corners).map(|(right, step)| right.dot(step));
        let shared = self.right.rows(0, self.shared).dot(&step.shared);
        shared + of_frames.chain(of_corners).sum::<f64>()
    }

    /// What is left of the equations when parts are eliminated. `None` where a frame's pose is open by itself.
    pub(in crate::calibrate) fn reduced(&self, damping: f64) -> Option<Reduced> {
        let grown = |diagonal: f64| diagonal * (1.0 + damping);
        let (mut matrix, mut right) = (self.a.clone(), self.right.clone());
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] = grown(matrix[(i, i)]));
        let mut inverses = Vec::with_capacity(self.parts.len());
        for parts in self.parts.chunks(PARTS_AT_A_TIME) {
            let columns = parts.iter().map(|part| part.c.nrows()).sum();
            let mut through = DMatrix::zeros(matrix.nrows(), columns);
            let mut across = DMatrix::zeros(columns, matrix.nrows());
            let mut first = 0;
            for Part { b, c, right: of_part } in parts {
                let mut c = c.clone();
                (0..c.nrows()).for_each(|i| c[(i, i)] = grown(c[(i, i)]));
                let inverse = c.cholesky()?.inverse();
                let through_part = b * &inverse;
                right -= &through_part * of_part;
                through.columns_mut(first, b.ncols()).copy_from(&through_part);
                across.rows_mut(first, b.ncols()).tr_copy_from(b);
                first += b.ncols();
                inverses.push(inverse);
            }
            matrix.gemm(-1.0, &through, &across, 1.0);
        }
        Some(Reduced { matrix, right, inverses })
    }

    /// The inverse of the equations; `None` where a frame's pose is open by itself.
    pub(in crate::calibrate) fn covariances(&self, layout: &Layout) -> Option<Covariances> {
        let Reduced { matrix, inverses, .. } = self.reduced(0.0)?;
        let Inverse { matrix: kept, root, loose, tied } = self.invert(matrix)?;
        let of_part = |(part, inverse): (&Part, DMatrix<f64>)| {
            let through = &part.b * &inverse;
            inverse + through.tr_mul(&(&kept * &through))
        };
        let parts: Vec<_> = self.parts.iter().zip(inverses).map(of_part).collect();
        let (frames, corners) = match (layout.frames, layout.corners) {
            (Some(first), _) => (blocks(&kept, first), parts.iter().map(fixed).collect()),
            (None, Some(first)) => (parts.iter().map(fixed).collect(), blocks(&kept, first)),
            (None, None) => (parts.iter().map(fixed).collect(), Vec::new()),
        };
        let shared = kept.view((0, 0), (self.shared, self.shared)).into_owned();
        Some(Covariances { shared, kept, root, frames, corners, loose, tied })
    }

    /// The covariance of what is kept for residuals of variance 1; `None` where something is open.
    pub(in crate::calibrate) fn covariance_of_kept(&self) -> Option<DMatrix<f64>> {
        let matrix = self.reduced(0.0)?.matrix;
        let n = matrix.nrows();
        let scale = DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
        let inverse = scaled.cholesky()?.inverse();
        Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
    }

    /// The solution of the equations for a right side of shared unknowns and corners' offsets, in this
    /// order, which is zero for the poses of frames. `None` where a corner is open by itself.
    pub(in crate::calibrate) fn solve_without_frames(
        &self,
        layout: &Layout,
        found: &Covariances,
        right: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        if layout.corners.is_some() {
            return Some(&found.kept * right);
        }
        let mut of_kept = DVector::zeros(layout.count);
        of_kept.rows_mut(0, self.shared).copy_from(&right.rows(0, self.shared));
        let mut of_parts = Vec::with_capacity(self.parts.len());
        for (index, part) in self.parts.iter().enumerate() {
            let whole = part.c.clone().cholesky()?;
            let own = right.rows(self.shared + 3 * index, 3).into_owned();
            of_kept -= &part.b * whole.solve(&own);
            of_parts.push((whole, own));
        }
        let kept = &found.kept * of_kept;
        let mut solution = DVector::zeros(right.len());
        solution.rows_mut(0, self.shared).copy_from(&kept.rows(0, self.shared));
        for (index, (part, (whole, own))) in self.parts.iter().zip(of_parts).enumerate() {
            let own = whole.solve(&(own - part.b.tr_mul(&kept)));
            solution.rows_mut(self.shared + 3 * index, 3).copy_from(&own);
        }
        Some(solution)
    }

    /// The inverse of the reduced equations; the root is that of what all frames share, which alone may be open.
    fn invert(&self, reduced: DMatrix<f64>) -> Option<Inverse> {
        let (n, shared) = (reduced.nrows(), self.shared);
        let others = n - shared;
        if others == 0 {
            return Some(self.invert_shared(reduced));
        }
        let own = reduced.view((shared, shared), (others, others)).into_owned();
        let own = own.cholesky()?.inverse();
        let across = reduced.view((shared, 0), (others, shared));
        let through = &own * across;
        let of_shared = reduced.view((0, 0), (shared, shared)) - across.tr_mul(&through);
        let found = self.invert_shared(of_shared);
        let of_shared = &found.matrix;
        let carried = &through * of_shared;
        let mut inverse = DMatrix::zeros(n, n);
        inverse.view_mut((0, 0), (shared, shared)).copy_from(of_shared);
        inverse.view_mut((shared, 0), (others, shared)).copy_from(&-&carried);
        inverse.view_mut((0, shared), (shared, others)).copy_from(&-carried.transpose());
        let own = own + carried * through.transpose();
        inverse.view_mut((shared, shared), (others, others)).copy_from(&own);
        Some(Inverse { matrix: inverse, ..found })
    }

    /// The inverse of the equations of what all frames share.
    fn invert_shared(&self, reduced: DMatrix<f64>) -> Inverse {
        let n = reduced.nrows();
        if n == 0 {
            let root = Root { half: reduced.clone(), inverse: reduced.clone() };
            return Inverse { matrix: reduced, root, loose: Vec::new(), tied: Vec::new() };
        }
        let scale = DVector::from_fn(n, |i, _| 1.0 / self.a[(i, i)].max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| reduced[(i, j)] * scale[i] * scale[j]);
        let eigen = scaled.clone().symmetric_eigen();
        let mut inverse = DMatrix::zeros(n, n);
        let mut loose = BTreeSet::new();
        for (&value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if value <= SINGULAR {
                let most = direction.amax();
                loose.extend((0..n).filter(|&i| direction[i].abs() >= INVOLVED * most));
            }
            inverse += direction * direction.transpose() / value.max(SINGULAR);
        }
        let is_tied = |&i: &usize| inverse[(i, i)] * scaled[(i, i)] > TIED * TIED;
        let tied = (0..n).filter(is_tied).collect();
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        let roots = eigen.eigenvalues.map(|value| value.max(SINGULAR).sqrt());
        let turn = &eigen.eigenvectors;
        let root = Root {
            half: DMatrix::from_fn(n, n, |i, j| scale[i] * turn[(i, j)] / roots[j]),
            inverse: DMatrix::from_fn(n, n, |i, j| roots[i] * turn[(j, i)] / scale[j]),
        };
        Inverse { matrix: inverse, root, loose: loose.into_iter().collect(), tied }
    }
}

/// What is left of equations, S and s of S kept = s, and the inverses by which parts were eliminated.
pub(in crate::calibrate) struct Reduced {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
    inverses: Vec<DMatrix<f64>>,
}

impl Layout {
    /// What belongs to frames and to corners of a vector over what is kept, and of those over parts.
    fn split(
        &self,
        kept: &DVector<f64>,
        parts: &[impl std::borrow::Borrow<DVector<f64>>],
    ) -> (Vec<Vector6<f64>>, Vec<Vector3<f64>>) {
        fn rows<const K: usize>(kept: &DVector<f64>, first: usize) -> Vec<SMatrix<f64, K, 1>> {
            kept.as_slice()[first..].chunks_exact(K).map(SMatrix::from_column_slice).collect()
        }
        fn each<const K: usize>(
            parts: &[impl std::borrow::Borrow<DVector<f64>>],
        ) -> Vec<SMatrix<f64, K, 1>> {
            parts.iter().map(|part| SMatrix::from_column_slice(part.borrow().as_slice())).collect()
        }
        match (self.frames, self.corners) {
            (Some(first), _) => (rows(kept, first), each(parts)),
            (None, Some(first)) => (each(parts), rows(kept, first)),
            (None, None) => (each(parts), Vec::new()),
        }
    }
}

/// The blocks on the diagonal from a row on.
fn blocks<const K: usize>(matrix: &DMatrix<f64>, first: usize) -> Vec<SMatrix<f64, K, K>> {
    let block = |i: usize| matrix.fixed_view::<K, K>(i, i).into_owned();
    (first..matrix.nrows()).step_by(K).map(block).collect()
}

fn fixed<const K: usize>(matrix: &DMatrix<f64>) -> SMatrix<f64, K, K> {
    matrix.fixed_view::<K, K>(0, 0).into_owned()
}

/// Parts whose share of the reduced equations is taken away at a time: as one product of matrices.
const PARTS_AT_A_TIME: usize = 64;

/// Eigenvalues of the reduced equations, scaled by the diagonal that they would have if poses were
/// known, mean nothing below this: elimination leaves a few dozen times the precision of numbers.
const SINGULAR: f64 = 1e-14;

/// An unknown takes part in a direction if it moves by this part of what the one does that moves
/// most.
const INVOLVED: f64 = 0.3;

/// From here on the number of a parameter means nothing by itself. What fits as well is then a valley a
/// thousand times as long as it is wide; deviations are those of a straight one, and a bend by a
/// thousandth of its length leads out of that. Terms of a polynomial stay below while there are few.
const TIED: f64 = 1000.0;

/// Solves symmetric equations after scaling their diagonal to 1.
fn solve_scaled(matrix: DMatrix<f64>, right: DVector<f64>) -> Option<DVector<f64>> {
    let n = matrix.nrows();
    if n == 0 {
        return Some(right);
    }
    let scale = DVector::from_fn(n, |i, _| 1.0 / matrix[(i, i)].max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let solution = scaled.cholesky()?.solve(&right.component_mul(&scale));
    Some(solution.component_mul(&scale))
}

/// Blocks whose equations are held at a time: enough for every thread, little for the memory.
const BLOCKS_AT_A_TIME: usize = 256;

/// Most columns that a corner depends on: parameters and poses of a camera, a panel, a target and a frame, and a shape.
const LONGEST_ROW: usize = MOST_OF_LENS + 24 + shape::COUNT;

/// Most parameters of a camera that a corner depends on.
const MOST_OF_LENS: usize =
    if MAX_PARAMETERS > MOST_TOUCHED { MAX_PARAMETERS } else { MOST_TOUCHED };

/// Of a block that a spline images, which columns it has, and which of them each of its corners has.
struct Support {
    /// The column of each parameter of the lens, if it is unknown.
    columns: Vec<Option<usize>>,
    /// The columns of the lens on which any corner depends, ascending.
    touched: Vec<usize>,
}

impl Support {
    /// `None` of another lens, or where nothing of it is unknown.
    fn of(free: &[(usize, usize)], seen: &[Projection], parameters: usize) -> Option<Self> {
        seen.first()?.knots?;
        let mut columns = vec![None; parameters - PROJECTION_PARAMETERS.len()];
        for &(parameter, column) in free {
            columns[parameter - PROJECTION_PARAMETERS.len()] = Some(column);
        }
        let knots = seen.iter().filter_map(|at| at.knots);
        let knots: BTreeSet<usize> =
            knots.flat_map(|knots| knots.iter().map(|(knot, _)| knot)).collect();
        let of_knots = knots.iter().flat_map(|&knot| [columns[2 * knot], columns[2 * knot + 1]]);
        let touched = of_knots.flatten().collect();
        Some(Self { columns, touched })
    }

    /// Whether dx and dy of each knot of a point are unknown, and its part.
    fn knots(&self, at: &Projection) -> impl Iterator<Item = (usize, usize, f64)> {
        let knots = at.knots.into_iter().flat_map(|knots| knots.iter());
        knots.flat_map(move |(knot, part)| {
            [0, 1].into_iter().filter_map(move |axis| {
                self.columns[2 * knot + axis].map(|column| (column, axis, part))
            })
        })
    }

    /// The columns of a block of n that a point depends on.
    fn places(&self, at: &Projection, n: usize, places: &mut Vec<usize>) {
        places.clear();
        let of_knots =
            self.knots(at).map(|(column, ..)| self.touched.partition_point(|&c| c < column));
        places.extend(of_knots);
        places.extend(self.touched.len()..n);
    }

    /// The derivatives of a coordinate by the knots.
    fn derivatives(&self, at: &Projection, coordinate: usize, push: &mut impl FnMut(f64)) {
        for (_, axis, part) in self.knots(at) {
            push(if axis == coordinate { at.by_image(axis) * part } else { 0.0 });
        }
    }
}

/// The normal equations of one block, with only the columns that it has.
pub(in crate::calibrate) struct Local {
    cost: f64,
    /// Shared columns; those of the frame's pose follow.
    pub columns: Vec<usize>,
    /// Rows of the lower triangle, one after the other.
    matrix: Vec<f64>,
    pub right: Vec<f64>,
    /// The corners, where they are unknown.
    pub corners: Vec<OfCorner>,
}

/// The normal equations of one frame for the shared unknowns followed by the offsets of all corners, its pose
/// eliminated.
pub(in crate::calibrate) struct OfFrame {
    locals: Vec<Local>,
    /// Number of shared unknowns.
    shared: usize,
    /// Those of the pose.
    pose: Cholesky<f64, U6>,
}

impl OfFrame {
    /// From the blocks of the frame. `None` where the pose is open.
    pub fn of(locals: Vec<Local>, shared: usize) -> Option<Self> {
        let mut pose = Matrix6::<f64>::zeros();
        for local in &locals {
            for i in 0..6 {
                let own = local.row(local.columns.len() + i)[local.columns.len()..].iter();
                own.enumerate().for_each(|(j, value)| pose[(i, j)] += value);
            }
        }
        pose.fill_upper_triangle_with_lower_triangle();
        Some(Self { locals, shared, pose: pose.cholesky()? })
    }

    /// The right side of n unknowns. The pose is at its optimum, so that nothing is left of its own.
    pub fn right(&self, n: usize) -> DVector<f64> {
        let mut right = DVector::zeros(n);
        for local in &self.locals {
            local.columns.iter().zip(&local.right).for_each(|(&row, value)| right[row] += value);
            for corner in &local.corners {
                let mut own = right.fixed_rows_mut::<3>(self.shared + 3 * corner.index);
                own += corner.right;
            }
        }
        right
    }

    /// Calls `each` for every unknown that the frame touches, with what is between it and the pose; for some more
    /// than once, with what is to be summed.
    fn with_pose(&self, mut each: impl FnMut(usize, Vector6<f64>)) {
        for local in &self.locals {
            let of_shared = local.columns.len();
            for (i, &column) in local.columns.iter().enumerate() {
                each(column, Vector6::from_fn(|pose, _| local.row(of_shared + pose)[i]));
            }
            for corner in &local.corners {
                for k in 0..3 {
                    let across = Vector6::from_fn(|pose, _| corner.cross[of_shared + pose][k]);
                    each(self.shared + 3 * corner.index + k, across);
                }
            }
        }
    }

    /// The product of the matrix with a vector of all unknowns.
    pub fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(vector.len());
        for local in &self.locals {
            for (i, &row) in local.columns.iter().enumerate() {
                for (&column, value) in local.columns.iter().zip(local.row(i)) {
                    product[row] += value * vector[column];
                    if column != row {
                        product[column] += value * vector[row];
                    }
                }
            }
            for corner in &local.corners {
                let first = self.shared + 3 * corner.index;
                let own = corner.own * vector.fixed_rows::<3>(first);
                (0..3).for_each(|k| product[first + k] += own[k]);
                for (&column, values) in local.columns.iter().zip(&corner.cross) {
                    for (k, value) in values.iter().enumerate() {
                        product[first + k] += value * vector[column];
                        product[column] += value * vector[first + k];
                    }
                }
            }
        }
        let mut pose = Vector6::zeros();
        self.with_pose(|unknown, across| pose += across * vector[unknown]);
        let pose = self.pose.solve(&pose);
        self.with_pose(|unknown, across| product[unknown] -= across.dot(&pose));
        product
    }

    /// Adds what is between the shared unknowns (rows) and the offsets of all corners (columns).
    pub fn add_across(&self, across: &mut DMatrix<f64>) {
        for local in &self.locals {
            for corner in &local.corners {
                for (&row, values) in local.columns.iter().zip(&corner.cross) {
                    for (k, value) in values.iter().enumerate() {
                        across[(row, 3 * corner.index + k)] += value;
                    }
                }
            }
        }
        let mut of_shared: BTreeMap<usize, Vector6<f64>> = BTreeMap::new();
        self.with_pose(|unknown, with_pose| {
            if unknown < self.shared {
                *of_shared.entry(unknown).or_default() += with_pose;
            }
        });
        let of_shared: Vec<_> =
            of_shared.iter().map(|(&row, of)| (row, self.pose.solve(of))).collect();
        self.with_pose(|unknown, with_pose| {
            if let Some(column) = unknown.checked_sub(self.shared) {
                of_shared.iter().for_each(|(row, of)| across[(*row, column)] -= of.dot(&with_pose));
            }
        });
    }
}

/// What a corner in a block says of its own offset.
pub(in crate::calibrate) struct OfCorner {
    /// Its place in the map.
    index: usize,
    /// For each column of the block.
    cross: Vec<[f64; 3]>,
    own: Matrix3<f64>,
    right: Vector3<f64>,
}

impl Local {
    pub(in crate::calibrate) fn of(
        problem: &Problem,
        layout: &Layout,
        block: &Block,
        whitening: &[[f64; 3]],
        loss: Loss,
        sigma: f64,
    ) -> Option<Self> {
        let camera = &problem.cameras[block.camera];
        let (rig, panel) = (&problem.frames[block.frame], &problem.panels[block.panel.index()]);
        let target = &problem.targets[panel.target].scene_from_target;
        let rig_from_camera = DMat3::from_quat(camera.camera_from_rig.rotation.conjugate());
        let scene_from_rig = DMat3::from_quat(rig.rotation.conjugate());
        let target_from_scene = DMat3::from_quat(target.rotation.conjugate());
        let free = &layout.parameters[block.camera];
        let of_camera = layout.cameras[block.camera];
        let (of_panel, of_target) =
            (layout.panels[block.panel.index()], layout.targets[panel.target]);
        let poses = of_camera.into_iter().chain(of_panel).chain(of_target);
        let poses = poses.flat_map(|first| first..first + 6);
        let of_shape = layout.shape.into_iter().flat_map(|first| first..first + shape::COUNT);
        let poses = poses.chain(of_shape);
        let chain = |seen: &Observation| {
            let turned_panel = panel.target_from_panel.rotation * problem.panel_point(block, seen);
            let turned_target =
                target.rotation * (turned_panel + panel.target_from_panel.translation);
            let turned_scene = rig.rotation * (turned_target + target.translation);
            let in_rig = turned_scene + rig.translation;
            let turned_rig = camera.camera_from_rig.rotation * in_rig;
            let in_camera = turned_rig + camera.camera_from_rig.translation;
            let at = camera.camera.project_with_derivatives(in_camera)?;
            Some((turned_panel, turned_target, turned_scene, turned_rig, at))
        };
        let support = match camera.camera.lens {
            Lens::Spline(_) if !free.is_empty() => {
                let seen = block.observations.iter().map(|seen| Some(chain(seen)?.4));
                let seen = seen.collect::<Option<Vec<Projection>>>()?;
                Support::of(free, &seen, camera.free.len())
            }
            _ => None,
        };
        let columns: Vec<usize> = match &support {
            Some(support) => support.touched.iter().copied().chain(poses).collect(),
            None => free.iter().map(|&(_, column)| column).chain(poses).collect(),
        };
        let n = columns.len() + 6;
        let matrix = vec![0.0; n * (n + 1) / 2];
        let mut local =
            Self { cost: 0.0, columns, matrix, right: vec![0.0; n], corners: Vec::new() };
        let mut rows = [[0.0; LONGEST_ROW]; 2];
        // Of a spline the columns of the block that a corner has: of its knots, and all after those of the lens.
        let mut places: Vec<usize> = Vec::new();
        for (seen, &w) in block.observations.iter().zip(whitening) {
            let bends = problem.shape.map(|shape| shape.directions(seen.panel_mm));
            let mapped = problem.map.as_ref().map(|map| map.index(block.panel, seen));
            let (turned_panel, turned_target, turned_scene, turned_rig, at) = chain(seen)?;
            let mut by_place = [DVec3::ZERO; 2];
            if let Some(support) = &support {
                support.places(&at, n, &mut places);
            }
            for (i, row) in rows.iter_mut().enumerate() {
                let mut next = 0;
                let mut push = |value: f64| {
                    row[next] = value;
                    next += 1;
                };
                match &support {
                    Some(support) => support.derivatives(&at, i, &mut push),
                    None => {
                        for &(parameter, _) in free {
                            push(at.by_parameters[parameter][i]);
                        }
                    }
                }
                // For y = exp(ω) a + t + τ a derivative j by y is a × j by ω, and j by τ.
                let mut pose = |arm: DVec3, by: DVec3| {
                    arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(&mut push);
                };
                let by_camera = DVec3::from(at.by_point[i]);
                let by_rig = rig_from_camera * by_camera;
                if of_camera.is_some() {
                    pose(turned_rig, by_camera);
                }
                let by_scene = scene_from_rig * by_rig;
                let by_target = target_from_scene * by_scene;
                if of_panel.is_some() {
                    pose(turned_panel, by_target);
                }
                if of_target.is_some() {
                    pose(turned_target, by_scene);
                }
                by_place[i] = panel.target_from_panel.rotation.conjugate() * by_target;
                if let Some(bends) = bends {
                    bends.iter().for_each(|&bend| push(by_place[i].dot(bend)));
                }
                let mut pose = |arm: DVec3, by: DVec3| {
                    arm.cross(by).to_array().into_iter().chain(by.to_array()).for_each(&mut push);
                };
                pose(turned_scene, by_rig);
            }
            let residual = seen.pixel - at.pixel;
            let count = if support.is_some() { places.len() } else { n };
            let rows = [&rows[0][..count], &rows[1][..count]];
            let weight = match support {
                Some(_) => local.add_some(&places, rows, residual, w, loss, sigma),
                None => local.add(rows, residual, w, loss, sigma),
            };
            if let Some(index) = mapped {
                let mut corner = OfCorner::new(index, rows, by_place, residual, w, weight);
                if support.is_some() {
                    corner.spread(&places, n);
                }
                local.corners.push(corner);
            }
        }
        Some(local)
    }

    /// A row of the lower triangle, up to the diagonal.
    pub(in crate::calibrate) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * (i + 1) / 2..][..=i]
    }

    /// Adds a corner's two rows in some columns, ascending; returns the weight that the loss gives it.
    fn add_some(
        &mut self,
        places: &[usize],
        [along_x, along_y]: [&[f64]; 2],
        residual: DVec2,
        w: [f64; 3],
        loss: Loss,
        sigma: f64,
    ) -> f64 {
        let r = Whitening::apply(w, residual);
        let (cost, weight) = loss.of(r.length_squared(), sigma);
        self.cost += cost;
        let [a, b, c] = w;
        for (i, &place) in places.iter().enumerate() {
            let (x, y) = (weight * a * along_x[i], weight * (b * along_x[i] + c * along_y[i]));
            self.right[place] += x * r.x + y * r.y;
            let (by_x, by_y) = (a * x + b * y, c * y);
            let row = &mut self.matrix[place * (place + 1) / 2..];
            for (j, &column) in places[..=i].iter().enumerate() {
                row[column] += by_x * along_x[j] + by_y * along_y[j];
            }
        }
        weight
    }

    /// Adds a corner's two rows; returns the weight that the loss gives it.
    fn add(
        &mut self,
        [along_x, along_y]: [&[f64]; 2],
        residual: DVec2,
        w: [f64; 3],
        loss: Loss,
        sigma: f64,
    ) -> f64 {
        let r = Whitening::apply(w, residual);
        let (cost, weight) = loss.of(r.length_squared(), sigma);
        self.cost += cost;
        let [a, b, c] = w;
        let mut rest = self.matrix.as_mut_slice();
        for (i, right) in self.right.iter_mut().enumerate() {
            let (x, y) = (weight * a * along_x[i], weight * (b * along_x[i] + c * along_y[i]));
            *right += x * r.x + y * r.y;
            let (by_x, by_y) = (a * x + b * y, c * y);
            let (row, below) = rest.split_at_mut(i + 1);
            for ((value, of_x), of_y) in row.iter_mut().zip(along_x).zip(along_y) {
                *value += by_x * of_x + by_y * of_y;
            }
            rest = below;
        }
        weight
    }
}

impl OfCorner {
    /// For all columns of a block of which it has some.
    fn spread(&mut self, places: &[usize], n: usize) {
        let mut cross = vec![[0.0; 3]; n];
        places.iter().zip(&self.cross).for_each(|(&place, values)| cross[place] = *values);
        self.cross = cross;
    }

    fn new(
        index: usize,
        [along_x, along_y]: [&[f64]; 2],
        by_place: [DVec3; 2],
        residual: DVec2,
        w: [f64; 3],
        weight: f64,
    ) -> Self {
        let r = Whitening::apply(w, residual);
        let [a, b, c] = w;
        let (x, y) = (a * by_place[0], b * by_place[0] + c * by_place[1]);
        // By the residual before it was whitened.
        let (by_x, by_y) = (weight * (a * x + b * y), weight * (c * y));
        let cross = along_x.iter().zip(along_y);
        let cross = cross.map(|(&of_x, &of_y)| (by_x * of_x + by_y * of_y).to_array());
        let own = Matrix3::from_fn(|k, l| by_x[k] * by_place[0][l] + by_y[k] * by_place[1][l]);
        let right = weight * (x * r.x + y * r.y);
        Self { index, cross: cross.collect(), own, right: right.to_array().into() }
    }
}

impl Problem {
    /// The problem after a step.
    pub(in crate::calibrate) fn after(&self, layout: &Layout, step: &Step) -> Problem {
        let mut problem = self.clone();
        for (i, camera) in problem.cameras.iter_mut().enumerate() {
            let mut values = camera.camera.parameters();
            for &(parameter, column) in &layout.parameters[i] {
                values[parameter] += step.shared[column];
            }
            camera.camera = camera.camera.with_parameters(&values);
            if let Some(first) = layout.cameras[i] {
                let change = &step.shared.as_slice()[first..first + 6];
                camera.camera_from_rig = moved(&camera.camera_from_rig, change);
            }
        }
        for (panel, first) in problem.panels.iter_mut().zip(&layout.panels) {
            if let Some(first) = *first {
                let change = &step.shared.as_slice()[first..first + 6];
                panel.target_from_panel = moved(&panel.target_from_panel, change);
            }
        }
        for (target, first) in problem.targets.iter_mut().zip(&layout.targets) {
            if let Some(first) = *first {
                let change = &step.shared.as_slice()[first..first + 6];
                target.scene_from_target = moved(&target.scene_from_target, change);
            }
        }
        if let (Some(shape), Some(first)) = (&mut problem.shape, layout.shape) {
            for (mm, change) in
                shape.coefficients_mm.iter_mut().zip(&step.shared.as_slice()[first..])
            {
                *mm += change;
            }
        }
        for (frame, step) in problem.frames.iter_mut().zip(&step.frames) {
            *frame = moved(frame, step.as_slice());
        }
        if let Some(map) = &mut problem.map {
            for (offset, step) in map.offsets_mm.iter_mut().zip(&step.corners) {
                *offset += DVec3::from_slice(step.as_slice());
            }
        }
        problem
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::calibrate::problem::bundle::{CameraUnknowns, PanelUnknowns, Prior, TargetUnknowns};
    use crate::calibrate::{PanelRef, Shape};
    use crate::camera::{Camera, Pose};

    #[derive(Clone, Copy, PartialEq)]
    enum Kind {
        Rig,
        Scene,
        Bent,
        Map { frames: usize },
    }

    /// Two cameras and two panels in three frames, every link open that may be, seen with noise; the same with a target
    /// for each panel; or one camera and a panel that is bent, or whose corners are anywhere.
    fn problem(kind: Kind) -> Problem {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let count = if matches!(kind, Kind::Rig | Kind::Scene) { 2 } else { 1 };
        let beside = |x: f64| Pose { translation: DVec3::new(x, 3.0, -2.0), ..Pose::IDENTITY };
        let cameras = (0..count).map(|i| {
            let camera = Camera::pinhole(640 + 80 * i, 480, 1.0);
            let free = vec![true; camera.parameters().len()];
            let free = free.iter().enumerate().map(|(i, _)| i < 6).collect();
            let camera_from_rig = beside(-60.0 * f64::from(i));
            CameraUnknowns {
                camera_from_rig,
                pose_free: i > 0,
                ..CameraUnknowns::alone(camera, free)
            }
        });
        let mut covariance = [[0.0; 6]; 6];
        (0..6).for_each(|i| covariance[i][i] = if i < 3 { 1e-6 } else { 1e-2 });
        let panels = (0..count).map(|i| {
            let target_from_panel = beside(70.0 * f64::from(i));
            let prior = Prior::new(beside(70.0 * f64::from(i) + 0.05), covariance);
            let prior = prior.filter(|_| i > 0);
            let target = if kind == Kind::Scene { i as usize } else { 0 };
            PanelUnknowns { target, target_from_panel, pose_free: i > 0, prior }
        });
        let turned = Pose::looking_at(DVec3::new(3.0, 7.0, 90.0), DVec3::ONE, DVec3::Y);
        let other = TargetUnknowns { scene_from_target: turned, pose_free: true };
        let targets = match kind {
            Kind::Scene => vec![TargetUnknowns::SCENE, other],
            _ => vec![TargetUnknowns::SCENE],
        };
        let moments = match kind {
            Kind::Map { frames } => frames,
            Kind::Rig | Kind::Scene | Kind::Bent => 3,
        };
        let frames = (0..moments).map(|i| {
            let (sin, cos) = (2.4 * i as f64).sin_cos();
            let eye = DVec3::new(50.0 * cos, 50.0 * sin, 300.0);
            Pose::looking_at(eye, DVec3::new(30.0, 20.0, 0.0), DVec3::Y)
        });
        let shape = (kind == Kind::Bent).then(|| Shape {
            middle_mm: DVec3::new(30.0, 20.0, 0.0),
            reach_mm: 40.0,
            coefficients_mm: std::array::from_fn(|i| 0.1 * i as f64),
        });
        let mut problem = Problem {
            cameras: cameras.collect(),
            frames: frames.collect(),
            targets,
            panels: panels.collect(),
            shape,
            ..Problem::default()
        };
        for frame in 0..moments {
            for (camera, panel) in (0..count).flat_map(|c| (0..count).map(move |p| (c, p))) {
                let seen = (0..20).map(|k| Observation {
                    row: k / 5,
                    col: k % 5,
                    panel_mm: DVec3::new(12.0 * f64::from(k % 5), 11.0 * f64::from(k / 5), 0.0),
                    pixel: DVec2::ZERO,
                    cov: None,
                });
                let panel = PanelRef::new(panel as usize, panel);
                let block =
                    Block { camera: camera as usize, frame, panel, observations: seen.collect() };
                let residuals = problem.residuals(&block).expect("all corners are in sight");
                let mut block = block;
                for (seen, residual) in block.observations.iter_mut().zip(residuals) {
                    let noise = [0; 2].map(|_| rng.random_range(-0.5..0.5));
                    seen.pixel = DVec2::from(noise) - residual;
                }
                problem.blocks.push(block);
            }
        }
        if let Kind::Map { .. } = kind {
            let mut map = CornerMap::flat(&problem);
            for offset in &mut map.offsets_mm {
                *offset = DVec3::from([0; 3].map(|_| rng.random_range(-0.1..0.1)));
            }
            problem.map = Some(map);
        }
        problem
    }

    fn whitening(problem: &Problem) -> Whitening {
        let of = |block: &Block| {
            (0..block.observations.len()).map(|k| [2.0, 0.1 * (k % 7) as f64, 1.5]).collect()
        };
        Whitening { blocks: problem.blocks.iter().map(of).collect(), common_px: None, sigma: 0.8 }
    }

    /// All residuals, whitened: those of the corners, and what is off from what was known beforehand.
    fn residuals(problem: &Problem, whitening: &Whitening) -> DVector<f64> {
        let mut all = Vec::new();
        for (block, weights) in problem.blocks.iter().zip(&whitening.blocks) {
            for (residual, &w) in problem.residuals(block).unwrap().into_iter().zip(weights) {
                all.extend(Whitening::apply(w, residual).to_array());
            }
        }
        for panel in &problem.panels {
            if let Some(prior) = &panel.prior {
                let (off, information) = prior.off(&panel.target_from_panel);
                let half = (information * whitening.sigma.powi(2)).cholesky().unwrap().l();
                all.extend((half.transpose() * -off).iter());
            }
        }
        if let Some(map) = &problem.map {
            let offsets = map.offsets_mm.iter();
            all.extend(offsets.flat_map(|&mm| (mm / map.prior_mm * whitening.sigma).to_array()));
        }
        DVector::from_vec(all)
    }

    fn step(layout: &Layout, frames: usize, values: &DVector<f64>) -> Step {
        let (shared, others) = values.as_slice().split_at(layout.shared);
        let (frames, corners) = others.split_at(6 * frames);
        let frames = frames.chunks_exact(6).map(Vector6::from_column_slice).collect();
        let corners = corners.chunks_exact(3).map(Vector3::from_column_slice).collect();
        Step { shared: DVector::from_column_slice(shared), frames, corners }
    }

    /// Eliminating frames or corners changes nothing, and every derivative is that of the residuals: cost, step and
    /// covariances are those of the whole equations, made from differences.
    #[test]
    fn equations_are_those_of_the_residuals_differences() {
        // Of few frames corners are eliminated, of many frames.
        let maps = [5, 12].map(|frames| Kind::Map { frames });
        for kind in [Kind::Rig, Kind::Scene, Kind::Bent].into_iter().chain(maps) {
            let problem = problem(kind);
            let (layout, whitening) = (Layout::of(&problem), whitening(&problem));
            let normal = Normal::of(&problem, &layout, &whitening, Loss::Squared).unwrap();
            let here = residuals(&problem, &whitening);
            let of_corners = problem.map.as_ref().map_or(0, |map| 3 * map.len());
            let frames = problem.frames.len();
            let count = layout.shared + 6 * frames + of_corners;
            let column = |i: usize| {
                // A ten-millionth of a pixel, about, whatever the unit.
                let unit = DVector::from_fn(count, |j, _| f64::from(u8::from(i == j)));
                let at = |by: f64| {
                    residuals(
                        &problem.after(&layout, &step(&layout, frames, &(&unit * by))),
                        &whitening,
                    )
                };
                let size = 1e-4 / (at(1e-6) - &here).norm().max(1e-9) * 1e-6;
                (at(size) - at(-size)) / (2.0 * size)
            };
            let columns: Vec<DVector<f64>> = (0..count).map(column).collect();
            let jacobian = DMatrix::from_columns(&columns);
            let whole = jacobian.tr_mul(&jacobian);
            let scale = DVector::from_fn(count, |i, _| whole[(i, i)].sqrt());
            let scaled = DMatrix::from_fn(count, count, |i, j| whole[(i, j)] / scale[i] / scale[j]);
            let inverse = scaled.cholesky().expect("nothing is open").inverse();
            let right = jacobian.tr_mul(&-&here).component_div(&scale);
            let expected = (&inverse * right).component_div(&scale);

            assert!((normal.cost - here.norm_squared()).abs() < 1e-9 * normal.cost);
            let found = normal.step(&layout, 0.0).unwrap();
            let frames = found.frames.iter().flat_map(|frame| frame.iter());
            let corners = found.corners.iter().flat_map(|corner| corner.iter());
            let found = found.shared.iter().chain(frames).chain(corners).copied();
            let found = DVector::from_iterator(count, found);
            for i in 0..count {
                let deviation = inverse[(i, i)].sqrt() / scale[i];
                let off = (found[i] - expected[i]).abs();
                assert!(off < 1e-4 * deviation, "unknown {i}: {off} of {deviation}");
            }
            let covariances = normal.covariances(&layout).unwrap();
            assert!(covariances.loose.is_empty());
            for i in 0..count {
                let shared = covariances.shared.diagonal();
                let frames = covariances.frames.iter().flat_map(|c| c.diagonal().data.0[0]);
                let corners = covariances.corners.iter().flat_map(|c| c.diagonal().data.0[0]);
                let all = shared.iter().copied().chain(frames).chain(corners);
                let found = all.collect::<Vec<f64>>()[i];
                let ratio = found / inverse[(i, i)] * scale[i] * scale[i];
                assert!((ratio - 1.0).abs() < 1e-3, "variance of unknown {i}: {ratio}");
            }
        }
    }
}
