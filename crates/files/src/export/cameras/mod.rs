//! Calibrations, and what follows from them.
//!
//! [`calibration`] and [`rig`] write estimates by the records of `estimate`, `finding` and `motion`; [`saved`] reads them back,
//! [`sheet`] what they say of the print. [`camera`] writes the formats of other programs, of which `format` has the table;
//! [`comparison`], [`pose`], [`next_view`], [`undistortion`] and [`truth`] are results of other commands.

pub mod calibration;
pub mod camera;
pub mod comparison;
pub(super) mod estimate;
pub(super) mod finding;
pub(super) mod format;
pub(super) mod motion;
pub mod next_view;
pub mod pose;
pub mod rig;
pub mod saved;
pub mod sheet;
pub mod truth;
pub mod undistortion;
