//! Whether a calibrated camera or rig is still as calibrated, from one or a few new views of a target.
//!
//! Input: an estimate with its covariance, and new views. Output: a [`answer::Check`].
//!
//! 1. `answer` has the result as values; `earlier` collects what the earlier calibration knows.
//! 2. `views` forms the normal equations of the new views for changes of the cameras and errors of the board.
//! 3. `equations` adds the covariance of unchanged cameras.
//! 4. `hypotheses` tests in these equations which quantities have changed, and which changes would have been found.
//! 5. `run` runs 2 to 4, and decides.

pub(crate) mod answer;
mod earlier;
mod equations;
mod hypotheses;
mod run;
mod views;
