//! The start of a bundle adjustment: initial cameras and poses without a first guess.
//!
//! Input: a calibration. Output: a problem with values near the solution ([`frames::Start`]).
//!
//! 1. `consensus` selects corners that agree with their neighbours; `first_camera` finds an ideal camera that makes
//!    them planar.
//! 2. `pose` computes the pose of a target in one image; `splined` converts a lens to a spline.
//! 3. `alone` combines these for one camera.
//! 4. `together` solves every camera separately, then combines them: `delay` (lag of each camera in
//!    frames), `symmetry` (labels of a board that looks the same after a rotation), `linked` (poses
//!    between cameras and targets that share frames), and `motion` (those that share none, from the
//!    motion of the rig).

pub(crate) mod alone;
pub(crate) mod consensus;
pub(crate) mod delay;
pub(crate) mod first_camera;
pub(crate) mod frames;
pub(crate) mod linked;
pub(crate) mod motion;
pub(crate) mod pose;
pub(crate) mod splined;
pub(crate) mod symmetry;
pub(crate) mod together;
