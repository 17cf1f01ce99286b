//! Covariances of what was found, and what views say of changes that a calibration does not allow for.
//!
//! Comes in: a minimum with its covariances for noise. Goes out: covariances that also have errors of model and board.
//!
//! 1. `agreement` is the covariance from the scatter between frames; `board_errors` what errors of the board add.
//! 2. `state_equations` are equations of each view for changes of the camera, a rolling shutter and a stretched board.
//! 3. `halves` raises the covariance where halves of the views differ by more.
//! 4. `projection` is how sure a camera is of where it projects a point; `known_so_far` what proposals of views start from.

pub(crate) mod agreement;
pub(crate) mod board_errors;
pub(crate) mod halves;
pub(crate) mod known_so_far;
pub(crate) mod projection;
pub(crate) mod state_equations;
