//! Calibrated cameras put to use.
//!
//! Comes in: photographs, and the camera or rig that took them. Goes out:
//!
//! 1. from `pose`, where a target is in each photograph;
//! 2. from `undistort`, photographs as a pinhole would have taken them, or the maps for that; for two cameras of a rig
//!    rectified, which is `deltille rectify`.

pub mod pose;
pub mod undistort;
