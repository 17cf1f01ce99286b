//! From approximate to final positions of corners, with covariances.
//!
//! Comes in: the image and the corners of a grid. Goes out: positions from the raw pixels, their covariances, and what all
//! corners of an image share: blur, tone curve, ink.
//!
//! 1. `clearance` finds the pixels around a corner that show nothing else; `refine_grid` chooses windows by blur.
//! 2. `refiner` starts with the polynomial of the paper, then with edges, contrast and blur (`corner_start`).
//! 3. `model` fits a blurred corner (`blurred_corner`) by Levenberg–Marquardt (`small_systems`).
//! 4. `shared_optics` estimates from all corners together what they share (`optics`): `joint_fit` fits them, `significance`
//!    leaves out what differs from nothing by no more than chance; `correlation` corrects covariances for noise that is not
//!    white.

pub(crate) mod blurred_corner;
pub(crate) mod clearance;
pub(crate) mod corner_start;
pub(crate) mod correlation;
pub(crate) mod joint_fit;
pub(crate) mod model;
pub(crate) mod optics;
pub(crate) mod refine_grid;
pub(crate) mod refiner;
pub(crate) mod shared_optics;
pub(crate) mod significance;
pub(crate) mod small_systems;
