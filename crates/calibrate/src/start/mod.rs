//! Where a bundle adjustment starts: cameras, and where they and the target were, without any guess.
//!
//! Comes in: a calibration. Goes out: a problem with values near those that are sought ([`frames::Start`]).
//!
//! 1. `consensus` takes corners that fit to their neighbours; `first_camera` finds a camera under which these are planes.
//! 2. `pose` finds the pose of a target in one picture; `splined` is a spline that images as another lens does.
//! 3. `alone` does all that for one camera.
//! 4. `together` has every camera alone first, then: `delay` (by how many frames each is late), `symmetry` (labels of a board
//!    that looks the same after a rotation), `linked` (poses between cameras and targets that share frames), and `motion`
//!    (those that share none, from how the rig moves).

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
