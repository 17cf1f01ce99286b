//! What a report shows beside the estimate itself.
//!
//! Comes in: the estimate of a camera. Goes out: what follows from its views and its lens.
//!
//! 1. `survey` has what the views cover, and mean residuals by cell of the image.
//! 2. `corner_offsets` are those of the target's corners that would explain their residuals.
//! 3. `displacement` is the distortion of the lens over the angle from its axis.

pub(super) mod corner_offsets;
pub(super) mod displacement;
pub(super) mod survey;
