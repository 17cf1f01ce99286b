//! Calibrations: from detections to cameras and rigs.
//!
//! Comes in: detections, their target, and keywords. Goes out: a `Calibration` or `Rig`. Calls meet the files in this
//! order:
//!
//! 1. `keywords` are `calibrate` and `rig` as they are called.
//! 2. `solving` is what is asked for as values, and the work.
//! 3. `calibration` is the result, `calibrated_camera` one camera of it, `views` its views and what is said of them.
//! 4. `pickled` restores each of these.
//! 5. `next_view` says which view to take next.
//! 6. `comparison` says whether two results differ, and where a target is.

pub mod calibrated_camera;
pub mod calibration;
pub mod comparison;
pub mod keywords;
pub mod next_view;
mod pickled;
mod solving;
pub mod views;
