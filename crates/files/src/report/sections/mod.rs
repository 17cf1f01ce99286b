//! Sections of the page: a headline with tables and plots.
//!
//! Comes in: the report. Goes out: HTML.
//!
//! 1. `numbers` rounds values to their deviations, and aligns them in columns.
//! 2. `key_figures` is the row of boxes at the top.
//! 3. `exactness` has the plots of residuals and of the uncertainty of projections.
//! 4. `models` compares lenses, `parameters` lists what was estimated.
//! 5. `views` lists them, the worst as pictures; `rig` has the poses of cameras, panels, targets and frames.

pub(super) mod exactness;
pub(super) mod key_figures;
pub(super) mod models;
mod numbers;
pub(super) mod parameters;
pub(super) mod rig;
pub(super) mod views;
