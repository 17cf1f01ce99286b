//! Covariances of the estimate, and tests for changes that a calibration does not model.
//!
//! Input: a minimum with its covariances from noise. Output: covariances that include errors of model and board.
//!
//! 1. `agreement` computes the covariance from the scatter between frames, `board_errors` the part from errors of the
//!    board.
//! 2. `state_equations` forms equations of each view for changes of the camera, a rolling shutter and a stretched
//!    board.
//! 3. `split_halves` increases the covariance if two halves of the views differ by more than it predicts.
//! 4. `projection` is the uncertainty of projections; `information` is the information on which
//!    proposals of views are based.

pub(crate) mod agreement;
pub(crate) mod board_errors;
pub(crate) mod information;
pub(crate) mod projection;
pub(crate) mod split_halves;
pub(crate) mod state_equations;
