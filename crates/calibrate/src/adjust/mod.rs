//! Adjustment of the observations that agree with each other.
//!
//! Input: a problem near its minimum. Output: a minimum whose weights and excluded corners are consistent with its
//! residuals ([`reweighting::Settled`]), and the findings about outliers.
//!
//! 1. `reweighting` estimates weights and unknowns alternately, and excludes single outlier corners.
//! 2. `lack_of_fit` finds patterns in residuals, `view_consistency` frames that contradict the camera of all others.
//! 3. `wrong_views` uses these to exclude panels, views, and panels in views; `finding` records
//!    what the excluded corners have in common.
//! 4. `added_unknowns` continues with more unknowns: smoothness of a spline, shape of the board, offsets of corners.

pub(crate) mod added_unknowns;
pub(crate) mod finding;
pub(crate) mod lack_of_fit;
pub(crate) mod reweighting;
pub(crate) mod view_consistency;
pub(crate) mod wrong_views;
