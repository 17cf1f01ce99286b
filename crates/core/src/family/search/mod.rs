//! Codes by trial.
//!
//! In come a number of bits, a distance, rules and a budget; out comes a family. [`best`] tries all that follows and keeps the
//! largest: [`lexicode`] takes every word in order that is far enough from those before it, `local` exchanges codes from
//! nothing and `polish` those of a code that is there, `joint` judges arrangements of algebraic codes by what local search makes of
//! them, `robust` takes codes that stand together although cells are hidden. `independent` finds large independent sets of
//! graphs.

pub mod best;
pub(in crate::family) mod independent;
pub(in crate::family) mod joint;
pub mod lexicode;
mod local;
pub(in crate::family) mod polish;
pub(in crate::family) mod robust;

pub use local::{Checkpoint, Search};
