//! The start of a bundle adjustment: initial cameras and poses without a first guess.
//!
//! Input: a calibration. Output: a problem with values near the solution ([`frames::Start`]).
//!
//! 1. `consensus` selects corners that agree with their neighbours; `first_camera` finds an ideal camera that makes
//!    them planar.
//! 2. `pose` computes the pose of a target in one image; `splined` converts a lens to a spline.
//! 3. `single_camera` combines these for one camera.
//! 4. `rig` solves every camera separately, then combines them: `delay` (lag of each camera in
//!    frames), `symmetry` (labels of a board that looks the same after a rotation), `relative_poses` (poses
//!    between cameras and targets that share frames), and `rig_motion` (those that share none, from the
//!    motion of the rig).

pub(crate) mod consensus;
pub(crate) mod delay;
pub(crate) mod first_camera;
pub(crate) mod frames;
pub(crate) mod pose;
pub(crate) mod relative_poses;
pub(crate) mod rig;
pub(crate) mod rig_motion;
pub(crate) mod single_camera;
pub(crate) mod splined;
pub(crate) mod symmetry;
