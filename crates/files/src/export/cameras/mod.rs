//! Calibrations and their applications.
//!
//! [`calibration`] and [`rig`] write estimates with the records of `estimate`, `constraint`, `finding`, `motion` and
//! `pose_uncertainty`. [`saved`] reads them back;
//! [`sheet`] reads only their data about the print. [`camera`] writes the formats of other programs, and `format` is the table of
//! these formats. [`covariance`] writes the covariance of a calibration. [`acceptance`], [`check`], [`comparison`], [`hand_eye`], [`pose`], [`next_view`], [`timing`], [`undistortion`] and [`truth`] are the results of other commands.

pub mod acceptance;
pub mod calibration;
pub mod camera;
pub mod check;
pub mod comparison;
pub(super) mod constraint;
pub mod covariance;
pub(super) mod estimate;
pub(super) mod finding;
pub(super) mod format;
pub mod hand_eye;
pub(super) mod motion;
pub mod next_view;
pub mod pose;
pub(super) mod pose_uncertainty;
pub mod rig;
pub mod saved;
pub mod sheet;
pub mod timing;
pub mod truth;
pub mod undistortion;
