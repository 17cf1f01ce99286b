//! What an earlier calibration knows about its cameras.

use nalgebra::DMatrix;

use super::answer::Missing;
use crate::estimate::values::{CameraEstimate, Estimate};
use crate::problem::camera_prior::CameraPrior;
use deltille_core::camera::Lens;

/// Factor of the covariances of the errors of the board in the calibration and in the new views. If both show the same
/// board, these errors are correlated. Twice both covariances is a bound for every correlation. If the correlation itself
/// is modelled, the errors cancel, and errors of the lens model, which do not, raise false alarms in real photographs.
pub(super) const SAME_BOARD: f64 = 2.0;

/// An unknown of the cameras. The unknowns of a camera are its estimated parameters, then its pose if that was estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unknown {
    /// A parameter of a camera, by the indices of both.
    Parameter { camera: usize, index: usize },
    /// A component of (ω, τ) of `camera_from_rig`.
    Pose { camera: usize },
}

/// The earlier calibration.
pub(super) struct Earlier<'a> {
    pub cameras: &'a [CameraEstimate],
    /// All unknowns of the cameras.
    pub unknowns: Vec<Unknown>,
    /// Their covariance. Errors of the board count as often as [`SAME_BOARD`] says.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom of the covariance.
    pub freedom: f64,
    /// Ratio of its observed variances without errors of the board to those from noise, at least 1.
    pub excess: f64,
    /// Its common standard deviation, px.
    pub common_px: Option<f64>,
}

impl<'a> Earlier<'a> {
    /// Collects what is needed for a check.
    pub(super) fn of(before: &'a Estimate) -> Result<Self, Missing> {
        let cameras = before.cameras.as_slice();
        if cameras.iter().any(|camera| matches!(camera.camera.lens, Lens::Spline(_))) {
            return Err(Missing::Spline);
        }
        if cameras.is_empty() || cameras.iter().any(|camera| camera.covariance.rows() == 0) {
            return Err(Missing::Covariance);
        }
        let observed = match cameras {
            [only] => only.projection.as_ref().and_then(|known| known.observed.as_ref()),
            _ => before.joint.as_ref(),
        };
        let observed = observed.ok_or(Missing::Observed)?;
        let mut unknowns = Vec::new();
        for (camera, of) in cameras.iter().enumerate() {
            let parameters = of.free().into_iter();
            unknowns.extend(parameters.map(|index| Unknown::Parameter { camera, index }));
            let components = if of.pose_sd.is_some() { 6 } else { 0 };
            unknowns.extend((0..components).map(|_| Unknown::Pose { camera }));
        }
        let scatter = observed.without_board();
        if scatter.rows() != unknowns.len() {
            return Err(Missing::Observed);
        }
        let mut earlier = Self {
            cameras,
            unknowns,
            covariance: scatter.inner().clone(),
            freedom: observed.freedom,
            excess: 1.0,
            common_px: before.common_px,
        };
        let ratios = (0..cameras.len()).map(|camera| earlier.ratio(camera));
        let ratios = ratios.collect::<Option<Vec<f64>>>().ok_or(Missing::Covariance)?;
        earlier.excess = (ratios.iter().sum::<f64>() / ratios.len() as f64).max(1.0);
        // With few frames, single directions of the scatter are too uncertain. The covariance of the poses on a rig from
        // noise is not known; there the scatter counts twice.
        earlier.covariance += match cameras {
            [only] => only.covariance.inner() * earlier.excess,
            _ => scatter.inner().clone(),
        };
        if let Some(of_board) = &observed.of_board {
            earlier.covariance += of_board.inner() * SAME_BOARD;
        }
        Ok(earlier)
    }

    /// The mean ratio of observed variances to those from noise, of the parameters of a camera.
    fn ratio(&self, camera: usize) -> Option<f64> {
        let noise = self.cameras[camera].covariance.inner();
        let of_noise = CameraPrior::new(&self.cameras[camera].camera, noise)?;
        let observed = self.parameters(camera);
        Some(of_noise.information().component_mul(&observed).sum() / noise.nrows() as f64)
    }

    /// The covariance of the parameters of a camera.
    pub(super) fn parameters(&self, camera: usize) -> DMatrix<f64> {
        let is_own = |i: &usize| matches!(self.unknowns[*i], Unknown::Parameter { camera: of, .. } if of == camera);
        let own: Vec<usize> = (0..self.unknowns.len()).filter(is_own).collect();
        DMatrix::from_fn(own.len(), own.len(), |i, j| self.covariance[(own[i], own[j])])
    }
}
