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

pub(crate) mod bundle;
pub(crate) mod corner_gauge;
pub(crate) mod corner_map;
pub(crate) mod panels;
pub(crate) mod roughness;
pub(crate) mod shape;
pub(crate) mod unknowns;
pub(crate) mod whitening;
