//! A camera on a rig, with its unknowns: its estimated parameters, then (ω, τ) of its pose if that was estimated.

use glam::DVec3;
use nalgebra::{DMatrix, SMatrix};

use super::values::{CameraEstimate, Estimate};
use crate::uncertainty::projection::{ObservedCovariance, by_motion, by_parameters};
use deltille_core::camera::Projection;

/// A camera and its unknowns.
#[derive(Clone, Debug)]
pub(crate) struct CameraOnRig<'a> {
    pub(crate) estimate: &'a CameraEstimate,
    /// The estimated parameters.
    pub(crate) free: Vec<usize>,
    /// The first of its unknowns among those of all cameras.
    pub(crate) column: usize,
}

/// A point in the image of a camera.
pub(crate) struct Sight {
    pub(crate) projection: Projection,
    /// Derivatives of the pixel with respect to the point, in the frame of the rig, and to the unknowns of the camera.
    pub(crate) by_point: SMatrix<f64, 2, 3>,
    pub(crate) by_camera: DMatrix<f64>,
}

impl Estimate {
    /// All cameras, with the observed covariance of all their unknowns; `None` if that is not known.
    pub(crate) fn cameras_on_rig(&self) -> Option<(Vec<CameraOnRig<'_>>, &ObservedCovariance)> {
        let observed = match self.cameras.as_slice() {
            [only] => only.projection.as_ref()?.observed.as_ref()?,
            _ => self.joint.as_ref()?,
        };
        let mut unknowns = 0;
        let cameras = self.cameras.iter().map(|estimate| {
            let camera = CameraOnRig { estimate, free: estimate.free(), column: unknowns };
            unknowns += camera.unknowns();
            camera
        });
        let cameras = cameras.collect();
        (observed.covariance.rows() == unknowns).then_some((cameras, observed))
    }
}

impl CameraOnRig<'_> {
    /// Number of its unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.free.len() + if self.estimate.pose_sd.is_some() { 6 } else { 0 }
    }

    /// Projects a point of the rig frame; `None` beyond the field of view of the lens.
    pub(crate) fn sight(&self, point: DVec3) -> Option<Sight> {
        let pose = &self.estimate.camera_from_rig;
        let place = pose.apply(point);
        let projection = self.estimate.camera.project_with_derivatives(place)?;
        let rows = projection.by_point.map(|row| pose.rotation.conjugate() * DVec3::from(row));
        let free = &self.free;
        let mut by_camera = DMatrix::zeros(2, self.unknowns());
        by_camera.columns_mut(0, free.len()).copy_from(&by_parameters(&projection, free));
        if self.estimate.pose_sd.is_some() {
            // The pose rotates points about the camera's place, before they are moved to it.
            let by_pose = by_motion(&projection, place - pose.translation);
            by_camera.columns_mut(free.len(), 6).copy_from(&by_pose);
        }
        Some(Sight { projection, by_point: SMatrix::from_fn(|i, j| rows[i][j]), by_camera })
    }
}

/// Rigs for the tests of what depends on cameras.
#[cfg(test)]
pub(super) mod simulated {
    use super::*;
    use crate::estimate::coverage::Coverage;
    use crate::matrix::Matrix;
    use deltille_core::camera::{BrownConrady, Camera, Lens, Pose};
    use glam::DQuat;

    /// Cameras side by side, which see the target everywhere. Four parameters of each are unknown, and the poses of all but the first.
    pub(in crate::estimate) fn rig(count: usize) -> Estimate {
        let lens =
            Lens::BrownConrady(BrownConrady { radial: [-0.1, 0.02, 0.0], ..Default::default() });
        let camera = |index: usize| {
            let camera = Camera::centred(1280, 960, 1000.0 + 20.0 * index as f64, lens.clone());
            let mut of = CameraEstimate::given(&index.to_string(), camera);
            of.parameters.iter_mut().take(4).for_each(|parameter| parameter.sd = Some(1.0));
            of.camera_from_rig = Pose {
                rotation: DQuat::from_scaled_axis(DVec3::new(0.01, -0.08, 0.02) * index as f64),
                translation: DVec3::new(-120.0, 4.0, 7.0) * index as f64,
            };
            of.pose_sd = (index > 0).then_some([1.0; 6]);
            of.coverage = Coverage::new(8, 6, vec![1; 48]);
            of
        };
        let cameras: Vec<CameraEstimate> = (0..count).map(camera).collect();
        let mut rig = Estimate { cameras, ..Estimate::default() };
        set_covariance(&mut rig, |_, _| 0.0);
        rig
    }

    /// Sets the observed covariance of the unknowns of a rig.
    pub(in crate::estimate) fn set_covariance(
        rig: &mut Estimate,
        of: impl Fn(usize, usize) -> f64,
    ) {
        let unknowns = 10 * rig.cameras.len() - 6;
        let covariance = Matrix::from_fn(unknowns, unknowns, of);
        let observed = ObservedCovariance { covariance, of_board: None, freedom: 10.0 };
        if let [only] = rig.cameras.as_mut_slice() {
            let alignment = Matrix::from_fn(6, unknowns, |_, _| 0.0);
            only.projection =
                Some(crate::ProjectionUncertainty::new(alignment, Vec::new(), Some(observed)));
        } else {
            rig.joint = Some(observed);
        }
    }

    /// The rig with a change of an unknown of a camera.
    pub(in crate::estimate) fn changed(
        rig: &Estimate,
        camera: usize,
        unknown: usize,
        by: f64,
    ) -> Estimate {
        let mut rig = rig.clone();
        let camera = &mut rig.cameras[camera];
        if unknown < 4 {
            let mut values = camera.camera.parameters();
            values[unknown] += by;
            camera.camera = camera.camera.with_parameters(&values);
        } else {
            let mut change = [0.0; 6];
            change[unknown - 4] = by;
            let pose = &mut camera.camera_from_rig;
            let turn = DQuat::from_scaled_axis(DVec3::from_slice(&change[..3]));
            pose.rotation = turn * pose.rotation;
            pose.translation += DVec3::from_slice(&change[3..]);
        }
        rig
    }
}
