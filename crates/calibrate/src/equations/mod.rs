//! Normal equations of a problem, and its minimum.
//!
//! Comes in: a problem and its whitening. Goes out: the minimum, and covariances of all unknowns.
//!
//! 1. `layout` gives every unknown its column.
//! 2. `block` has the equations of one panel in one picture; `frame` those of a frame, its pose eliminated.
//! 3. `normal` sums blocks and eliminates the poses of frames, or the offsets of corners; and solves for a step;
//!    `step` is that change of all unknowns.
//! 4. `minimise` walks to the minimum (Levenberg–Marquardt).
//! 5. `covariances` inverts the equations; `local_share` is what one frame tells of the unknowns that all share.

pub(in crate::calibrate) mod block;
pub(in crate::calibrate) mod covariances;
pub(in crate::calibrate) mod frame;
pub(in crate::calibrate) mod layout;
pub(in crate::calibrate) mod local_share;
pub(in crate::calibrate) mod minimise;
pub(in crate::calibrate) mod normal;
pub(in crate::calibrate) mod step;
