//! What is given for a hand–eye calibration.

use crate::estimate::values::CameraEstimate;
use crate::input::robot::{Mounting, RobotNoise, RobotPoses};

/// The request of a hand–eye calibration, see [`Calibration::hand_eye`](crate::Calibration::hand_eye).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HandEyeRequest {
    /// The poses of the robot.
    pub robot: RobotPoses,
    /// Where the camera is mounted.
    pub mounting: Mounting,
    /// The noise of the robot, if it is known; otherwise it is estimated.
    pub noise: Option<RobotNoise>,
    /// Whether a scale of the robot's translations is estimated.
    pub scale: bool,
    /// An earlier calibration of the camera. If the camera is known, its parameters are estimated again with their
    /// earlier covariance as prior, so that its errors count.
    pub earlier: Option<CameraEstimate>,
}
