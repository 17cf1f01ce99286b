//! Normal equations of the links between frames and a robot.

use nalgebra::{DMatrix, DVector};

use super::block::Local;
use super::layout::Layout;
use crate::problem::bundle::Problem;
use crate::problem::robot::{Link, Robot};

/// The derivatives of a link with respect to X, Z and the scale.
pub(super) fn by_shared(robot: &Robot, link: &Link) -> DMatrix<f64> {
    let mut by = DMatrix::zeros(6, robot.columns());
    by.columns_mut(0, 6).copy_from(&link.by_mount);
    by.columns_mut(6, 6).copy_from(&link.by_ground);
    if robot.scale_free {
        by.column_mut(12).copy_from(&link.by_scale);
    }
    by
}

impl Local {
    /// The equations of the link of a frame; `None` if it has none.
    pub(super) fn of_robot(problem: &Problem, layout: &Layout, frame: usize) -> Option<Self> {
        let (robot, first) = (problem.robot.as_ref()?, layout.robot?);
        let link = robot.link(&problem.frames[frame], robot.poses[frame].as_ref()?);
        let count = robot.columns();
        let mut rows = DMatrix::zeros(6, count + 6);
        rows.columns_mut(0, count).copy_from(&by_shared(robot, &link));
        rows.columns_mut(count, 6).copy_from(&link.by_frame);
        let roots = robot.weights().map(f64::sqrt);
        rows.row_iter_mut().zip(&roots).for_each(|(mut row, root)| row *= *root);
        let residual = -link.off.component_mul(&roots);
        let residual = DVector::from_column_slice(residual.as_slice());
        Some(Self::of_rows((first..first + count).collect(), &rows, &residual))
    }
}
