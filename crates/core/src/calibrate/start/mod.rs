//! Where a bundle adjustment starts: cameras, and where they and the target were, without any guess.
//!
//! ```text
//!   each camera by itself ─→ camera_from_target in its own views
//!   pictures of all cameras ─→ by how many frames each is late
//!   two cameras, one frame ─→ camera_from_camera: the middle one of all such frames
//!   a camera and a target of its own ─→ both, from how the rig moves
//!   from camera 0 on to all others ─→ camera_from_rig, scene_from_target, rig_from_scene(frame)
//! ```

pub(in crate::calibrate) mod alone;
pub(in crate::calibrate) mod consensus;
pub(in crate::calibrate) mod delay;
pub(in crate::calibrate) mod first_camera;
pub(in crate::calibrate) mod frames;
pub(in crate::calibrate) mod linked;
pub(in crate::calibrate) mod motion;
pub(in crate::calibrate) mod pose;
pub(in crate::calibrate) mod splined;
pub(in crate::calibrate) mod symmetry;
pub(in crate::calibrate) mod together;
