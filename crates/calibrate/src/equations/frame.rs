//! Normal equations of one frame with its pose eliminated.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Matrix6, U6, Vector6};

use super::block::Local;

/// The normal equations of one frame for the shared unknowns followed by the offsets of all corners, with its pose
/// eliminated.
pub(crate) struct OfFrame {
    locals: Vec<Local>,
    /// Number of shared unknowns.
    shared: usize,
    /// The equations of the pose.
    pose: Cholesky<f64, U6>,
}

impl OfFrame {
    /// Sums the blocks of the frame; `None` if the pose is undetermined.
    pub(crate) fn of(locals: Vec<Local>, shared: usize) -> Option<Self> {
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

    /// The right-hand side for n unknowns. The pose is at its optimum, so its own right-hand side
    /// is zero.
    pub(crate) fn right(&self, n: usize) -> DVector<f64> {
        let mut right = DVector::zeros(n);
        for local in &self.locals {
            local.columns.iter().zip(&local.right).for_each(|(&row, value)| right[row] += value);
            for (corner, _) in local.corners() {
                let mut own = right.fixed_rows_mut::<3>(self.shared + 3 * corner.index);
                own += corner.right;
            }
        }
        right
    }

    /// Calls `each` with the coupling of every touched unknown to the pose; for some unknowns more than once, with
    /// terms to be summed.
    fn with_pose(&self, mut each: impl FnMut(usize, Vector6<f64>)) {
        for local in &self.locals {
            let of_shared = local.columns.len();
            for (i, &column) in local.columns.iter().enumerate() {
                each(column, Vector6::from_fn(|pose, _| local.row(of_shared + pose)[i]));
            }
            for (corner, cross) in local.corners() {
                let of_pose = &cross[of_shared..];
                let first = self.shared + 3 * corner.index;
                (0..3).for_each(|k| each(first + k, Vector6::from_fn(|pose, _| of_pose[pose][k])));
            }
        }
    }

    /// The product of the matrix with a vector of all unknowns.
    pub(crate) fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
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
            for (corner, cross) in local.corners() {
                let first = self.shared + 3 * corner.index;
                let own = corner.own * vector.fixed_rows::<3>(first);
                (0..3).for_each(|k| product[first + k] += own[k]);
                for (&column, values) in local.columns.iter().zip(cross) {
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

    /// Adds the matrix of all unknowns.
    pub(crate) fn add_to(&self, whole: &mut DMatrix<f64>) {
        let mut with_pose = DMatrix::zeros(whole.nrows(), 6);
        self.with_pose(|unknown, across| {
            let mut row = with_pose.row_mut(unknown);
            row += across.transpose();
        });
        for local in &self.locals {
            for (i, &row) in local.columns.iter().enumerate() {
                for (&column, value) in local.columns.iter().zip(local.row(i)) {
                    whole[(row, column)] += value;
                    if column != row {
                        whole[(column, row)] += value;
                    }
                }
            }
            for (corner, cross) in local.corners() {
                let first = self.shared + 3 * corner.index;
                let mut own = whole.fixed_view_mut::<3, 3>(first, first);
                own += corner.own;
                for (&column, values) in local.columns.iter().zip(cross) {
                    for (k, value) in values.iter().enumerate() {
                        whole[(first + k, column)] += value;
                        whole[(column, first + k)] += value;
                    }
                }
            }
        }
        let solved = self.pose.solve(&with_pose.transpose());
        whole.gemm(-1.0, &with_pose, &solved, 1.0);
    }

    /// Adds the coupling between the shared unknowns (rows) and the offsets of all corners (columns).
    pub(crate) fn add_across(&self, across: &mut DMatrix<f64>) {
        for local in &self.locals {
            for (corner, cross) in local.corners() {
                for (&row, values) in local.columns.iter().zip(cross) {
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
