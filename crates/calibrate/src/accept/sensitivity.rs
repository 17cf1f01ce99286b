//! The derivatives of a measured length, and the variances that they give.

use glam::DVec3;
use nalgebra::{DMatrix, RowDVector};

use super::request::CornerLabel;

/// A corner that a frame measures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub label: CornerLabel,
    /// Its described and its measured position, in the frame of the target for one camera. A rig measures it in its own frame.
    pub known: DVec3,
    pub measured: DVec3,
}

/// What the error of a length depends on.
#[derive(Clone, Debug)]
pub(super) struct Sensitivity {
    /// Variances from noise of the corners, and from errors that are common to all corners of the calibration, mm².
    pub noise_mm2: f64,
    pub lens_mm2: f64,
    /// Derivatives with respect to the unknowns of the cameras.
    pub by_cameras: RowDVector<f64>,
    /// Derivatives with respect to offsets of corners of the target, in the frame of their panel.
    pub by_target: Vec<(CornerLabel, DVec3)>,
}

/// The corners that a frame measures.
pub(super) trait Measured {
    fn points(&self) -> &[Point];

    /// RMS residual of the corners in the images per axis, px.
    fn rms_px(&self) -> f64;

    /// The sensitivity of the length between two points, by their indices. If the length is known otherwise, the offsets of its
    /// ends from the description of the target are not errors of it.
    fn sensitivity(&self, ends: [usize; 2], is_known: bool) -> Sensitivity;
}

/// Weights of an observation: variances from noise and from other errors, px².
#[derive(Clone, Copy, Debug)]
pub(super) struct Variances {
    pub noise: nalgebra::Matrix2<f64>,
    pub other: f64,
}

impl Variances {
    /// The information of the observation, px⁻².
    pub(super) fn information(&self) -> Option<nalgebra::Matrix2<f64>> {
        (self.noise + nalgebra::Matrix2::identity() * self.other).try_inverse()
    }
}

/// g C gᵀ.
pub(super) fn variance(by: &RowDVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    (by * covariance * by.transpose())[0].max(0.0)
}
