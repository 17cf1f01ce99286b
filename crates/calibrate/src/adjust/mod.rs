//! Adjustment of the observations that belong together.
//!
//! Comes in: a problem near its minimum. Goes out: a minimum whose weights and excluded corners are consistent with its residuals
//! ([`reweighting::Settled`]), and what outliers have in common.
//!
//! 1. `reweighting` estimates weights and unknowns in turn, and excludes single outlier corners.
//! 2. `lack_of_fit` finds patterns in residuals, `view_consistency` frames that contradict the camera of all others.
//! 3. `wrong_views` excludes panels, views, and panels in views by these; `finding` records what the excluded have in common.
//! 4. `added_unknowns` goes on with more: smoothness of a spline, shape of the board, offsets of corners.

pub(crate) mod added_unknowns;
pub(crate) mod finding;
pub(crate) mod lack_of_fit;
pub(crate) mod reweighting;
pub(crate) mod view_consistency;
pub(crate) mod wrong_views;
