//! Calibrations: from detections to cameras, rigs and measured targets.
//!
//! Comes in: detections of `see`, or photographs for `guide`. Goes out: cameras for other programs, the result as a file
//! and as a page, and what is wrong with it. A command meets the files in this order:
//!
//! 1. `guide` says which photograph to take next.
//! 2. `one_camera` is `deltille calibrate`, `rig` is `deltille rig`: their options, and their files.
//! 3. `sightings` reads what both calibrate from: detections, the target or the untagged board, how it was printed.
//! 4. `solving` calls the library with a model that is given or chosen, and says how sure the result is.
//! 5. `report_page` is the page about it, with the photographs that it shows.
//! 6. `compare` says whether two results differ by more than chance.

pub mod compare;
pub mod guide;
pub mod one_camera;
mod report_page;
pub mod rig;
pub mod sightings;
mod solving;
