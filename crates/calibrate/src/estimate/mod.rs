//! The result of a calibration, as values.
//!
//! Comes in: what was settled on. Goes out: a [`values::Estimate`].
//!
//! 1. `values` are cameras, targets, frames, views and corners with residuals.
//! 2. `target_map` (measured corners), `coverage` (where corners were seen), `lens_end` and `image_circle` (up to where a lens
//!    is good) are parts of it.
//! 3. `uncertainty_map` is how sure a camera is over its image.
//! 4. `assemble` makes the estimate.

pub(crate) mod assemble;
pub(crate) mod coverage;
pub(crate) mod image_circle;
pub(crate) mod lens_end;
pub(crate) mod target_map;
pub(crate) mod uncertainty_map;
pub(crate) mod values;
