//! Plots as SVG.
//!
//! Input: an estimate, and statistics of it. Output: a drawing, usually with its caption.
//!
//! 1. `axes` draws the frame of all plots, `panels` draws dots and arrows on the target, and `round_down` chooses round scales.
//! 2. `residuals` plots residuals by image position, radius and view; `board_residuals` plots them on the target.
//! 3. `distortion` plots the distortion of the lens, and `field` maps values over the image.
//! 4. `length_errors` plots the lengths of an acceptance test.
//! 5. `target_map` shows the measured corner offsets, and `scene` shows cameras and targets in space.

mod axes;
pub(super) mod board_residuals;
pub(super) mod distortion;
pub(super) mod field;
pub(super) mod length_errors;
mod panels;
pub(super) mod residuals;
pub(super) mod round_down;
pub(super) mod scene;
pub(super) mod target_map;
