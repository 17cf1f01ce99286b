//! From approximate to final positions of corners, with covariances.
//!
//! Comes in: the image and the corners of a grid. Goes out: positions from the raw pixels, their covariances, and what all
//! corners of an image share: blur, tone curve, ink.
//!
//! 1. `clearance` finds the pixels around a corner that show nothing else; `refine_grid` chooses windows by blur.
//! 2. `refiner` starts with the polynomial of the paper, then with edges, contrast and blur (`corner_start`).
//! 3. `corner_model` fits a blurred corner (`blurred_corner`) by Levenberg–Marquardt (`small_systems`).
//! 4. `shared_optics` estimates from all corners together what they share (`optics`); `correlation` corrects covariances for noise that is not white.

pub(in crate::detect) mod blurred_corner;
pub(in crate::detect) mod clearance;
pub(in crate::detect) mod corner_model;
pub(in crate::detect) mod corner_start;
pub(in crate::detect) mod correlation;
pub(in crate::detect) mod optics;
pub(in crate::detect) mod refine_grid;
pub(in crate::detect) mod refiner;
pub(in crate::detect) mod shared_optics;
pub(in crate::detect) mod small_systems;
