//! Applications of calibrated cameras.
//!
//! Input: photographs, and the camera or rig that took them. Output:
//!
//! 1. `pose`: the pose of a target in each photograph;
//! 2. `undistort`: photographs undistorted to a pinhole projection, or the remap tables; for two cameras of a rig,
//!    rectified images (`deltille rectify`);
//! 3. `check`: whether the camera is still as calibrated;
//! 4. `hand_eye`: where the camera and the board are mounted on a robot;
//! 5. `timing`: when the rows of each camera are exposed;
//! 6. `accept`: whether lengths are measured as exactly as required.
//!
//! `new_views` reads the input of `check` and `accept`.

pub mod accept;
pub mod check;
pub mod hand_eye;
mod new_views;
pub mod pose;
pub mod timing;
pub mod undistort;
