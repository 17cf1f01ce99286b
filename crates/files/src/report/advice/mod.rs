//! Advice on how to improve a calibration.
//!
//! 1. `piece`: a piece of advice and its importance;
//! 2. `views_taken`: advice on how to take the photographs;
//! 3. `rules`: all advice, in order: also on the lens model, the parameters and the errors.

mod piece;
mod rules;
mod views_taken;

pub use piece::{Advice, Weight};
pub use rules::advice;
