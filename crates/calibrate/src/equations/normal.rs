//! Normal equations of a problem, with the poses of the frames eliminated.
//!
//! ```text
//!     ⎡ A   B ⎤ ⎡ kept  ⎤   ⎡ a ⎤      A: cameras and panels, dense
//!     ⎣ Bᵀ  C ⎦ ⎣ parts ⎦ = ⎣ c ⎦      C: a 6 × 6 block for each frame
//!
//!     (A − Σ B C⁻¹ Bᵀ) kept = a − Σ B C⁻¹ c,     part = C⁻¹ (c − Bᵀ kept)
//! ```
//!
//! If the corners of the target are unknown, too, frames are coupled only through corners, and
//! corners only through frames. Either frames or corners are eliminated, whichever have more
//! unknowns.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use rayon::prelude::*;

use super::block::{Local, OfCorner};
use super::cholesky::{fill_upper_blocks, subtract_product};
use super::coupling::Coupling;
use super::layout::Layout;
use super::step::Step;
use crate::input::loss::Loss;
use crate::problem::bundle::Problem;
use crate::problem::corner_map::CornerMap;
use crate::problem::whitening::Whitening;
use deltille_core::damping::Damping;

/// The equations of a group of eliminated unknowns: a frame, or a corner.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub c: DMatrix<f64>,
    pub right: DVector<f64>,
}

/// The normal equations at a point, and the cost of the residuals there.
#[derive(Clone, Debug)]
pub(crate) struct Normal {
    pub cost: f64,
    /// Number of the columns of the shared unknowns, which come first.
    pub(super) shared: usize,
    pub(super) a: DMatrix<f64>,
    pub(super) right: DVector<f64>,
    pub(super) b: Coupling,
    /// Frames, or corners.
    pub(super) parts: Vec<Part>,
}

impl Normal {
    /// Forms the equations; `None` if a camera cannot image a corner.
    pub(crate) fn of(
        problem: &Problem,
        layout: &Layout,
        whitening: &Whitening,
        loss: Loss,
    ) -> Option<Self> {
        let n = layout.count;
        let (count, size) = match (layout.frames, &problem.map) {
            (Some(_), Some(map)) => (map.len(), 3),
            _ => (problem.frames.len(), 6),
        };
        let part = Part { c: DMatrix::zeros(size, size), right: DVector::zeros(size) };
        let mut normal = Self {
            cost: 0.0,
            shared: layout.shared,
            a: DMatrix::zeros(n, n),
            right: DVector::zeros(n),
            b: Coupling::of(problem, layout, size, count),
            parts: vec![part; count],
        };
        let blocks: Vec<_> = problem.blocks.iter().zip(&whitening.blocks).collect();
        let most = blocks.iter().map(|(block, _)| block.observations.len()).max().unwrap_or(0);
        for some in blocks.chunks((CORNERS_AT_A_TIME / most.max(1)).max(1)) {
            let locals = some.par_iter().map(|(block, whitening_of)| {
                Local::of(problem, layout, block, whitening_of, loss, whitening.sigma)
            });
            // The sum is in the order of the blocks, so it does not depend on the number of threads.
            let locals = locals.collect::<Vec<Option<Local>>>();
            for ((block, _), local) in some.iter().zip(locals) {
                normal.add(layout, &local?, block.frame);
            }
        }
        for frame in 0..problem.frames.len() {
            if let Some(local) = Local::of_robot(problem, layout, frame) {
                normal.add(layout, &local, frame);
            }
        }
        if let Some(map) = &problem.map {
            normal.add_map(map, layout, whitening.sigma);
        }
        normal.a.fill_upper_triangle_with_lower_triangle();
        for (panel, first) in problem.panels.iter().zip(&layout.panels) {
            if let (Some(prior), Some(first)) = (&panel.prior, *first) {
                let (off, information) = prior.off(&panel.target_from_panel);
                normal.add_prior(off, information, first, whitening.sigma);
            }
        }
        for (camera, parameters) in problem.cameras.iter().zip(&layout.parameters) {
            if let Some(roughness) = &camera.roughness {
                let (matrix, right) = (&mut normal.a, &mut normal.right);
                normal.cost +=
                    roughness.add(&camera.camera, parameters, whitening.sigma, matrix, right);
            }
            if let Some(prior) = &camera.prior {
                let (matrix, right) = (&mut normal.a, &mut normal.right);
                normal.cost +=
                    prior.add(&camera.camera, parameters, whitening.sigma, matrix, right);
            }
        }
        normal.cost.is_finite().then_some(normal)
    }

    /// Adds the prior of a pose; `sigma` is the standard deviation of a whitened coordinate, the unit in which costs
    /// are counted.
    fn add_prior(
        &mut self,
        off: Vector6<f64>,
        information: Matrix6<f64>,
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

    /// Adds the prior of the corner offsets.
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

    /// Adds a block to the lower triangle of the kept unknowns only: its columns ascend, and its last six are those of
    /// the frame's pose.
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
            for (&row, value) in local.columns.iter().zip(of_shared) {
                self.b.rows[(row, 6 * frame + i)] += value;
            }
            let part = &mut self.parts[frame];
            for (j, value) in of_frame.iter().enumerate() {
                part.c[(i, j)] += value;
                if j < i {
                    part.c[(j, i)] += value;
                }
            }
            part.right[i] += right;
        }
        for (corner, cross) in local.corners() {
            self.add_corner(layout, &local.columns, corner, cross, frame);
        }
    }

    /// Adds the contribution of a block to the equations of a corner's offset.
    fn add_corner(
        &mut self,
        layout: &Layout,
        columns: &[usize],
        corner: &OfCorner,
        cross: &[[f64; 3]],
        frame: usize,
    ) {
        let (of_shared, of_frame) = cross.split_at(columns.len());
        if let (Some(moved), &[_, _, _, x, y, z]) = (&mut self.b.moved, of_frame) {
            moved.add(frame, corner.index, [x, y, z]);
        }
        for k in 0..3 {
            if let Some(first) = layout.corners {
                let row = first + 3 * corner.index + k;
                for (&column, values) in columns.iter().zip(of_shared) {
                    self.a[(row, column)] += values[k];
                }
                for (i, values) in of_frame.iter().enumerate() {
                    self.b.rows[(row, 6 * frame + i)] += values[k];
                }
                for l in 0..=k {
                    self.a[(row, first + 3 * corner.index + l)] += corner.own[(k, l)];
                }
                self.right[row] += corner.right[k];
            } else {
                let part = &mut self.parts[corner.index];
                for (&row, values) in columns.iter().zip(of_shared) {
                    self.b.rows[(row, 3 * corner.index + k)] += values[k];
                }
                for l in 0..3 {
                    part.c[(k, l)] += corner.own[(k, l)];
                }
                part.right[k] += corner.right[k];
            }
        }
    }

    /// Releases the memory of large equations, which must be formed again before they are used.
    pub(crate) fn release_if_large(&mut self) {
        if self.right.len() >= LARGE {
            (self.a, self.b) = (DMatrix::zeros(0, 0), Coupling::default());
        }
    }

    /// Whether [`Self::release_if_large`] released the equations.
    pub(crate) fn is_released(&self) -> bool {
        self.a.nrows() < self.right.len()
    }

    /// The reduction of the cost along a step as predicted by the equations.
    pub(crate) fn predicted(&self, layout: &Layout, step: &Step) -> f64 {
        let parts = self.parts.iter().map(|part| &part.right).collect::<Vec<_>>();
        let (frames, corners) = layout.split(&self.right, &parts);
        let of_frames = frames.iter().zip(&step.frames).map(|(right, step)| right.dot(step));
        let of_corners = corners.iter().zip(&step.corners).map(|(right, step)| right.dot(step));
        let shared = self.right.rows(0, self.shared).dot(&step.shared);
        shared + of_frames.chain(of_corners).sum::<f64>()
    }

    /// B and B C⁻¹ of some parts.
    pub(super) fn through(
        &self,
        inverses: &[DMatrix<f64>],
        parts: Range<usize>,
    ) -> [DMatrix<f64>; 2] {
        let between = self.b.between(parts.clone());
        let mut through = DMatrix::zeros(between.nrows(), between.ncols());
        for (index, inverse) in inverses[parts].iter().enumerate() {
            let (first, size) = (index * inverse.nrows(), inverse.nrows());
            let b = between.columns(first, size);
            through.columns_mut(first, size).gemm(1.0, &b, inverse, 0.0);
        }
        [between, through]
    }

    /// The inverses of the damped equations of the parts; `None` if a part is undetermined.
    pub(super) fn inverses(&self, damping: Damping) -> Option<Vec<DMatrix<f64>>> {
        let inverse = |Part { c, .. }: &Part| {
            let mut c = c.clone();
            (0..c.nrows()).for_each(|i| c[(i, i)] = damping.grown(c[(i, i)]));
            Some(c.cholesky()?.inverse())
        };
        self.parts.iter().map(inverse).collect()
    }

    /// The reduced equations after elimination of the parts. `None` if the pose of a frame is undetermined.
    pub(crate) fn reduced(&self, damping: Damping) -> Option<Reduced> {
        let (mut matrix, mut right) = (self.a.clone(), self.right.clone());
        (0..matrix.nrows()).for_each(|i| matrix[(i, i)] = damping.grown(matrix[(i, i)]));
        let inverses = self.inverses(damping)?;
        for first in (0..self.parts.len()).step_by(PARTS_AT_A_TIME) {
            let parts = first..(first + PARTS_AT_A_TIME).min(self.parts.len());
            let [between, through] = self.through(&inverses, parts.clone());
            for (index, Part { right: of_part, .. }) in self.parts[parts.clone()].iter().enumerate()
            {
                let size = of_part.len();
                right -= through.columns(size * index, size) * of_part;
            }
            subtract_product(&mut matrix, &through, &between.transpose());
        }
        fill_upper_blocks(&mut matrix);
        Some(Reduced { matrix, right, inverses })
    }
}

/// The reduced equations S kept = s, and the inverses of the eliminated parts.
pub(crate) struct Reduced {
    pub matrix: DMatrix<f64>,
    pub right: DVector<f64>,
    pub(super) inverses: Vec<DMatrix<f64>>,
}

/// Number of parts that are subtracted from the reduced equations in one matrix product.
pub(super) const PARTS_AT_A_TIME: usize = 64;

/// Number of kept unknowns from which on a step is computed with the factor of similar equations: with fewer, forming
/// and factoring the reduced equations takes less time.
pub(super) const LARGE: usize = 1000;

/// Number of corners whose equations are in memory at the same time, rounded to whole blocks. It is
/// enough work for every thread and needs little memory.
const CORNERS_AT_A_TIME: usize = 40_000;

#[cfg(test)]
mod tests;
