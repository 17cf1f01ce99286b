//! Normal equations of a problem, and its minimum.
//!
//! Comes in: a problem and its whitening. Goes out: the minimum, and covariances of all unknowns.
//!
//! 1. `layout` gives every unknown its column.
//! 2. `block` has the equations of one panel in one picture; `frame` those of a frame, its pose eliminated.
//! 3. `normal` sums blocks and eliminates the poses of frames, or the offsets of corners; and solves for a step;
//!    `step` is that change of all unknowns.
//!    `cholesky` factors and inverts large matrices by blocks.
//! 4. `minimise` walks to the minimum (Levenberg–Marquardt).
//! 5. `covariances` inverts the equations; `local_share` is what one frame tells of the unknowns that all share.

pub(crate) mod block;
mod cholesky;
pub(crate) mod covariances;
pub(crate) mod frame;
pub(crate) mod layout;
pub(crate) mod local_share;
pub(crate) mod minimise;
pub(crate) mod normal;
pub(crate) mod step;
