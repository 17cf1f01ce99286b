//! Where a bundle adjustment starts: cameras, and where they and the target were, without any guess.
//!
//! ```text
//!   each camera by itself ─→ camera_from_target in its own views
//!   pictures of all cameras ─→ by how many frames each is late
//!   two cameras, one frame ─→ camera_from_camera: the middle one of all such frames
//!   a camera and a target of its own ─→ both, from how the rig moves
//!   from camera 0 on to all others ─→ camera_from_rig, scene_from_target, rig_from_scene(frame)
//! ```

mod alone;
mod delay;
mod first_camera;
mod linked;
mod motion;
mod splined;
mod symmetry;
mod together;

use super::calibration::Calibration;
use super::error::CalibrationError;
use super::excluded::Excluded;
use super::problem::Problem;

pub(super) use alone::enough;
pub(super) use delay::in_order;
pub(super) use first_camera::evenly;
pub use symmetry::LabelRotation;
pub(super) use together::middle;

/// A problem whose values are near those that are sought.
pub(super) struct Start {
    pub problem: Problem,
    /// Its frames.
    pub frames: Vec<Frame>,
    /// What takes no part, with its place among the frames as they were given.
    pub excluded: Vec<(usize, Excluded)>,
    /// By how many frames each camera is late.
    pub delays: Vec<i32>,
    /// How the labels of each camera were rotated, where a symmetry of the board leaves that open.
    pub rotations: Vec<Option<LabelRotation>>,
}

/// A moment at which pictures were taken.
pub(super) struct Frame {
    pub name: String,
    /// Its place among the frames as they were given.
    pub place: usize,
    /// The camera and the index of each of its views.
    pub views: Vec<(usize, usize)>,
}

impl Start {
    /// # Errors
    /// Where no start is found, or the views cannot determine what is sought.
    pub(super) fn of(calibration: &Calibration) -> Result<Self, CalibrationError> {
        match calibration.is_single() {
            true => alone::start(calibration),
            false => together::start(calibration),
        }
    }
}
