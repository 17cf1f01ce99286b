//! Statistics that the report shows beside the estimate.
//!
//! Input: the estimate of a camera. Output: statistics of its views and its lens.
//!
//! 1. `survey` computes coverage and mean residuals by cell of the image.
//! 2. `corner_offsets` computes the offsets of target corners that would explain their residuals.
//! 3. `displacement` computes the distortion of the lens against the angle from its axis.

pub(super) mod corner_offsets;
pub(super) mod displacement;
pub(super) mod survey;
