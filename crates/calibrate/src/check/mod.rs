//! Whether a calibrated camera is still as calibrated, from one or a few new views of a target.
//!
//! Input: the estimate of a camera with its covariance, and new views. Output: a [`answer::Check`].
//!
//! 1. `answer` has the result as values.
//! 2. `equations` are the linear equations of the new views for changes of the camera and errors of the board, at a
//!    calibration whose prior is the earlier one.
//! 3. `hypotheses` tests in these equations which quantities have changed, and which changes would have been found.
//! 4. `run` runs 2 and 3, and decides.

pub(crate) mod answer;
mod equations;
mod hypotheses;
mod run;
