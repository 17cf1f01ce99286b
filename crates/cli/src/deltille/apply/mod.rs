//! Applications of calibrated cameras.
//!
//! Input: photographs, and the camera or rig that took them. Output:
//!
//! 1. `pose`: the pose of a target in each photograph;
//! 2. `undistort`: photographs undistorted to a pinhole projection, or the remap tables; for two cameras of a rig,
//!    rectified images (`deltille rectify`).

pub mod pose;
pub mod undistort;
