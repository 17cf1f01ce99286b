//! Whether a calibrated camera or rig measures known lengths as exactly as required.
//!
//! Input: an estimate with its covariance, and views of a target that took no part in it. Output: an
//! [`acceptance::Acceptance`].
//!
//! 1. `acceptance` has the result as values; `request`, the known lengths, the limit and the temperature.
//! 2. `triangulated` measures corners with several cameras of a rig, `in_plane` with one camera; both give the derivatives of
//!    a length with respect to all that is uncertain, which `sensitivity` turns into variances.
//! 3. `lines` selects the lengths that a frame measures.
//! 4. `run` runs 2 and 3 for all frames.

pub(crate) mod acceptance;
mod in_plane;
mod lines;
pub(crate) mod request;
pub(crate) mod run;
mod sensitivity;
#[cfg(test)]
mod tests;
mod triangulated;
