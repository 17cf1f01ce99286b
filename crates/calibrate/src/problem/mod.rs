//! Unknowns and observations of a bundle adjustment, without its equations.
//!
//! Input: blocks of observations, and values of the unknowns. Output: residuals, and their whitening.
//!
//! 1. `unknowns` of cameras, targets and panels, and the observations of a block; `panels` chooses the fixed panel and
//!    target.
//! 2. `shape` (of a sheet), `corner_map` (offsets of corners) and `roughness` (knots of a spline) are unknowns with
//!    priors.
//! 3. `bundle` combines them: points, residuals, and parts of the problem.
//! 4. `whitening` weights residuals by covariances and one common variance.
//! 5. `robot` links frames to the poses of a robot.
//! 6. `corner_gauge` removes from the offsets the directions that poses absorb.

pub(crate) mod bundle;
pub(crate) mod camera_prior;
pub(crate) mod corner_gauge;
pub(crate) mod corner_map;
pub(crate) mod panels;
pub(crate) mod robot;
pub(crate) mod roughness;
pub(crate) mod shape;
pub(crate) mod unknowns;
pub(crate) mod whitening;
