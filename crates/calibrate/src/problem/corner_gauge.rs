//! Offsets of corners without the components that poses and distances absorb.

use glam::DVec3;
use nalgebra::{DMatrix, Matrix3};

use super::bundle::Problem;
use super::corner_map::{CornerMap, MappedCorner};
use crate::input::panel::PanelRef;

impl CornerMap {
    /// The covariances of the offsets, minus the part from the directions that poses and distances
    /// absorb (the gauge). In these directions, only the prior determines the offsets, and fixes
    /// them at zero. `covariances` are 3 × 3 for each corner, from the normal equations; `sigma` is
    /// the standard deviation of a whitened coordinate, the unit in which costs are counted.
    ///
    /// These directions are a translation and a rotation of the whole target, or of each panel
    /// separately if panel poses are estimated, and a common scale if nothing else determines
    /// lengths.
    pub(crate) fn without_gauge(
        &self,
        covariances: &[Matrix3<f64>],
        sigma: f64,
        problem: &Problem,
    ) -> Vec<Matrix3<f64>> {
        let groups = self.rigid_groups(problem);
        let mut modes: Vec<Vec<DVec3>> = Vec::new();
        for group in 0..=groups.iter().copied().max().unwrap_or_default() {
            let of_group = |field: &dyn Fn(DVec3) -> DVec3| {
                let corners = self.corners.iter().zip(&groups);
                let of_corner = corners.enumerate().map(|(index, (_, &of))| match of == group {
                    true => self.on_panel(problem, index, field),
                    false => DVec3::ZERO,
                });
                of_corner.collect::<Vec<_>>()
            };
            for axis in DVec3::AXES {
                modes.push(of_group(&|_| axis));
                modes.push(of_group(&|at| axis.cross(at)));
            }
        }
        if has_free_scale(problem) {
            let corners = 0..self.len();
            modes.push(corners.map(|index| self.on_panel(problem, index, &|at| at)).collect());
        }
        let scaled = DMatrix::from_fn(3 * self.len(), modes.len(), |i, mode| {
            modes[mode][i / 3][i % 3] / self.prior_mm[i % 3]
        });
        let basis = scaled.qr().q();
        let prior = self.prior_mm / sigma;
        let of_corner = |(index, covariance): (usize, &Matrix3<f64>)| {
            let of_corner = basis.fixed_rows::<3>(3 * index);
            let held = of_corner * of_corner.transpose();
            covariance - Matrix3::from_fn(|i, j| held[(i, j)] * prior[i] * prior[j])
        };
        covariances.iter().enumerate().map(of_corner).collect()
    }

    /// The displacement of a corner, in the frame of its panel, by a vector field in the frame of
    /// the target, evaluated at the corner's current position.
    fn on_panel(&self, problem: &Problem, index: usize, field: &dyn Fn(DVec3) -> DVec3) -> DVec3 {
        let MappedCorner { panel, panel_mm, .. } = self.corners[index];
        let pose = problem.panels[panel.index()].target_from_panel;
        pose.rotation.conjugate() * field(pose.apply(panel_mm + self.offsets_mm[index]))
    }

    /// For each corner, the index of the group of panels that moves rigidly with it.
    fn rigid_groups(&self, problem: &Problem) -> Vec<usize> {
        let mut groups: Vec<(usize, Option<PanelRef>)> = Vec::new();
        let is_free = |panel: PanelRef| problem.panels[panel.index()].pose_free;
        let any_is_free = self.corners.iter().any(|corner| is_free(corner.panel));
        let of_corner = |corner: &MappedCorner| {
            let target = problem.panels[corner.panel.index()].target;
            let own = (target, any_is_free.then_some(corner.panel));
            groups.iter().position(|group| *group == own).unwrap_or_else(|| {
                groups.push(own);
                groups.len() - 1
            })
        };
        self.corners.iter().map(of_corner).collect()
    }
}

/// Whether only the plan of the target determines lengths: no distance between cameras is known.
fn has_free_scale(problem: &Problem) -> bool {
    problem.cameras.iter().filter(|camera| !camera.pose_free).count() <= 1
}
