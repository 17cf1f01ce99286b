//! The assignment of columns of the normal equations to unknowns.

use nalgebra::{DVector, SMatrix, Vector3, Vector6};

use crate::problem::bundle::Problem;
use crate::problem::shape;

/// The columns of the kept unknowns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    /// For each camera, the unknown parameters in ascending order, and their columns, which are contiguous. Equal
    /// parameters share a column.
    pub parameters: Vec<Vec<(usize, usize)>>,
    /// First of the six columns of a camera's pose.
    pub cameras: Vec<Option<usize>>,
    /// First of the six columns of a panel's pose.
    pub panels: Vec<Option<usize>>,
    /// First of the six columns of a target's pose.
    pub targets: Vec<Option<usize>>,
    /// First of the columns of the sheet's shape.
    pub shape: Option<usize>,
    /// First of the columns of the links to a robot: the poses X and Z, and the scale.
    pub robot: Option<usize>,
    /// Number of columns of the shared unknowns: all of the above.
    pub shared: usize,
    /// First of the columns of the frames' poses; `None` if they are eliminated.
    pub frames: Option<usize>,
    /// First of the columns of the corners' offsets; `None` if they are eliminated or known.
    pub corners: Option<usize>,
    /// Number of columns.
    pub count: usize,
}

impl Layout {
    pub(crate) fn of(problem: &Problem) -> Self {
        let mut count = 0;
        let mut take = |columns: usize| {
            count += columns;
            count - columns
        };
        let mut parameters = Vec::new();
        let mut cameras = Vec::new();
        for camera in &problem.cameras {
            let groups = camera.groups().into_iter().map(|group| (group, take(1)));
            let columns =
                groups.flat_map(|(group, column)| group.into_iter().map(move |i| (i, column)));
            let mut columns: Vec<(usize, usize)> = columns.collect();
            columns.sort_unstable();
            parameters.push(columns);
            cameras.push(camera.pose_free.then(|| take(6)));
        }
        let panels = problem.panels.iter().map(|p| p.pose_free.then(|| take(6))).collect();
        let targets = problem.targets.iter().map(|t| t.pose_free.then(|| take(6))).collect();
        let shape = problem.shape.map(|_| take(shape::COUNT));
        let robot = problem.robot.as_ref().map(|robot| take(robot.columns()));
        let shared = take(0);
        let of_frames = 6 * problem.frames.len();
        let of_corners = problem.map.as_ref().map(|map| 3 * map.len());
        let (frames, corners) = match of_corners {
            None => (None, None),
            Some(of_corners) if of_corners <= of_frames => (None, Some(take(of_corners))),
            Some(_) => (Some(take(of_frames)), None),
        };
        Self { parameters, cameras, panels, targets, shape, robot, shared, frames, corners, count }
    }
}

impl Layout {
    /// Splits a vector of kept unknowns and the vectors of parts into those of frames and of corners.
    pub(super) fn split(
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
