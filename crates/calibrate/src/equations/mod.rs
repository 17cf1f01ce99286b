//! Normal equations of a problem, and its minimum.
//!
//! Input: a problem and its whitening. Output: the minimum, and covariances of all unknowns.
//!
//! 1. `layout` assigns a column to every unknown.
//! 2. `block` forms the equations of one panel in one image, `frame` those of a frame with its pose eliminated,
//!    `robot` those of its link to a robot.
//! 3. `normal` sums blocks, and eliminates the poses of frames or the offsets of corners. `cholesky` factors and inverts
//!    large matrices by blocks; `factor` solves for a step, a change of all unknowns (`step`).
//! 4. `minimise` iterates to the minimum (Levenberg–Marquardt).
//! 5. `covariances` inverts the equations; `local_share` computes the contribution of one frame to the shared unknowns.

pub(crate) mod block;
mod cholesky;
mod coupling;
pub(crate) mod covariances;
pub(crate) mod factor;
pub(crate) mod frame;
pub(crate) mod layout;
pub(crate) mod local_share;
pub(crate) mod minimise;
pub(crate) mod normal;
mod robot;
pub(crate) mod step;
