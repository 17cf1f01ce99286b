//! Plots as SVG.
//!
//! Comes in: an estimate, and what was measured of it. Goes out: a drawing, and mostly its caption.
//!
//! 1. `axes` has the frame of all plots over the image, `panels` draws dots and arrows on the target; `round_down` chooses
//!    the scales of arrows.
//! 2. `residuals` are over the image, the radius and the views, `board_residuals` on the target.
//! 3. `distortion` is that of the lens, `field` a map of values over the image.
//! 4. `target_map` shows where the corners are, `scene` cameras and targets in space.

mod axes;
pub(super) mod board_residuals;
pub(super) mod distortion;
pub(super) mod field;
mod panels;
pub(super) mod residuals;
pub(super) mod round_down;
pub(super) mod scene;
pub(super) mod target_map;
