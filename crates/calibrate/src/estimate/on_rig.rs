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
