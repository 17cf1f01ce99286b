//! Sections of the page: a headline with tables and plots.
//!
//! Input: the report. Output: HTML.
//!
//! 1. `numbers` rounds values according to their standard deviations and aligns them in columns.
//! 2. `key_figures` makes the row of boxes at the top.
//! 3. `exactness` plots residuals and projection uncertainty.
//! 4. `models` compares lens models, and `parameters` lists the estimated parameters.
//! 5. `views` lists all views and shows the worst as images; `rig` lists poses of cameras, panels and targets, and the frames.

pub(super) mod exactness;
pub(super) mod key_figures;
pub(super) mod models;
mod numbers;
pub(super) mod parameters;
pub(super) mod rig;
pub(super) mod views;
