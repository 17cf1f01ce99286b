//! Refinement: from approximate to final positions of corners, with covariances.
//!
//! Input: the image and the corners of a grid. Output: positions from the raw pixels, their covariances, and the
//! parameters that all corners of an image share: blur, tone curve, ink.
//!
//! 1. `clearance` finds the pixels around a corner that show nothing else; `refine_grid` chooses windows by blur.
//! 2. `refiner` starts with the polynomial of the paper, then with edges, contrast and blur (`corner_start`).
//! 3. `model` fits a blurred corner by Levenberg–Marquardt (`small_systems`). Its brightness is a `pattern`
//!    (`blurred_corner`, with ink `displaced_edges`).
//! 4. `edge_shift` measures how far edges have moved. `shared_optics` estimates the shared parameters (`optics`) from all
//!    corners together. `joint_fit` fits them, and `significance` removes those that are not significant. `correlation`
//!    corrects covariances for noise that is not white, `displaced_rows` for errors that rows of pixels have in common.

pub(crate) mod blurred_corner;
pub(crate) mod clearance;
pub(crate) mod corner_start;
pub(crate) mod correlation;
pub(crate) mod displaced_edges;
pub(crate) mod displaced_rows;
pub(crate) mod edge_shift;
pub(crate) mod joint_fit;
pub(crate) mod model;
pub(crate) mod optics;
pub(crate) mod pattern;
pub(crate) mod refine_grid;
pub(crate) mod refiner;
pub(crate) mod shared_optics;
pub(crate) mod significance;
pub(crate) mod small_systems;
