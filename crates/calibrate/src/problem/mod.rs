//! Unknowns and observations of a bundle adjustment, without its equations.
//!
//! Comes in: blocks of observations, and values of the unknowns. Goes out: residuals, and their whitening.
//!
//! 1. `unknowns` are those of cameras, targets and panels, and the observations of a block; `panels` chooses which panel and
//!    which target are held.
//! 2. `shape` (of a sheet), `corner_map` (offsets of corners) and `roughness` (knots of a spline) are unknowns with priors.
//! 3. `bundle` has all of them: points, residuals, and parts of the problem.
//! 4. `whitening` weights residuals by covariances and one common deviation.
//! 5. `corner_gauge` takes directions out of the offsets that poses absorb.

pub(in crate::calibrate) mod bundle;
pub(in crate::calibrate) mod corner_gauge;
pub(in crate::calibrate) mod corner_map;
pub(in crate::calibrate) mod panels;
pub(in crate::calibrate) mod roughness;
pub(in crate::calibrate) mod shape;
pub(in crate::calibrate) mod unknowns;
pub(in crate::calibrate) mod whitening;
