//! Calibration: from detections to cameras, rigs and measured targets.
//!
//! Input: detections from `see`, photographs or recordings. Output: camera files for other programs, the result as a
//! file and as a report, and diagnoses. The modules, in the order in which a command uses them:
//!
//! 1. `guide` proposes the next photograph to take.
//! 2. `one_camera` is `deltille calibrate`, and `rig` is `deltille rig`: their options and files; `rig_cameras` reads the
//!    input of each camera of a rig.
//! 3. `sightings` reads the common input: detections, the target or untagged board, and the
//!    properties of its print.
//! 4. `filming` finds the target in photographs and recordings; `reasons` says why none shows it. `detection_files` reads
//!    detections instead.
//! 5. `solving` calls the library with a given or selected model, and prints the uncertainty of the result.
//!    `constraints` are its options for fixed, equal and measured parameters; `compensation` selects the models, and compensates
//!    views for rolling shutters and clocks.
//! 6. `report_page` writes the files, and the report with the photographs that it shows; `covariance_file`, the covariance.
//! 7. `compare` tests whether two results differ significantly.

pub mod compare;
pub mod compensation;
pub mod constraints;
pub mod covariance_file;
mod detection_files;
pub mod filming;
pub mod guide;
pub mod one_camera;
mod reasons;
mod report_page;
pub mod rig;
pub mod rig_cameras;
pub mod sightings;
pub mod solving;
