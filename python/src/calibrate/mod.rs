//! Calibrates cameras and rigs from detections.
//!
//! Input: detections, their target, and keywords. Output: a `Calibration` or `Rig`. Calls pass through the files in this
//! order:
//!
//! 1. `keywords` contains the functions `calibrate` and `rig`.
//! 2. `solving` checks their arguments, and solves; `solved` is the result with its file, report and diagnoses.
//! 3. `calibration` is the result in Python, `calibrated_camera` one of its cameras, `views` its views and diagnoses,
//!    `joint_covariance` the covariance of all unknowns.
//! 4. `pickled` restores each of these after pickling.
//! 5. `next_view` proposes the next view.
//! 6. `comparison` tests whether two calibrations differ, and estimates the pose of a target.
//! 7. `checking` tests whether cameras are still as calibrated, from a few new detections.
//! 8. `accepting` measures known lengths, with the arguments of `checking`.
//! 9. `timing` estimates rolling shutters and the clocks of a rig.
//! 10. `robots` locates a camera and a board on a robot.

pub mod accepting;
pub mod calibrated_camera;
pub mod calibration;
pub mod checking;
pub mod comparison;
pub mod joint_covariance;
pub mod keywords;
pub mod next_view;
mod pickled;
pub mod robots;
mod solved;
mod solving;
pub mod timing;
pub mod views;
