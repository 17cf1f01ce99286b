//! Reading and writing the files of calibration targets: artwork, targets, photographs, detections
//! and calibrations.
//!
//! | module | purpose |
//! |---|---|
//! | [`clock`] | the monotonic clock of the machine |
//! | [`limits`] | bounds on the size of files that are read; guards against panics and endless
//! loops in third-party readers |
//! | [`family_file`] | families by name or from their files |
//! | [`target_file`] | targets from their files, with their families |
//! | [`camera_file`] | cameras from their files |
//! | [`known_lengths`] | lengths on a target that were measured by other means |
//! | [`robot_poses`] | poses of a robot from their files |
//! | [`photograph`] | photographs in common formats as grey images |
//! | `exif_notes` | the camera in the EXIF metadata of a photograph |
//! | `remap` | photographs undistorted or rectified |
//! | `known_print` | known properties of a print (scale, bend, panel poses), applied to views |
//! | [`logo`] | logos from SVG |
//! | [`export`] | artwork, targets and results to files and back, one module for each format |
//! | [`report`] | a calibration or an acceptance test as an HTML page |

pub mod camera_file;
pub mod clock;
#[cfg(feature = "photographs")]
mod exif_notes;
pub mod export;
pub mod family_file;
pub mod known_lengths;
mod known_print;
pub mod limits;
#[cfg(feature = "logo")]
pub mod logo;
#[cfg(feature = "photographs")]
pub mod photograph;
#[cfg(feature = "photographs")]
pub mod remap;
#[cfg(feature = "report")]
pub mod report;
pub mod robot_poses;
pub mod target_file;

pub use known_print::SheetUseError;
