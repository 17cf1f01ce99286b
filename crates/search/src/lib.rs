//! Searches for families of codes.
//!
//! In come a number of bits, a distance, rules and a budget; out comes a [`Family`](deltille_core::family::Family).
//!
//! 1. [`best`] tries all that follows and keeps the largest; a lexicode, which takes every word in order that is far enough from
//!    those before it, is [`deltille_core::family::lexicode`].
//! 2. [`algebra`] constructs codes that a turn of the tag leaves invariant, and `joint` judges their arrangements by what local
//!    search makes of them.
//! 3. `local` exchanges codes from nothing, and `polish` those of a code that is there.
//! 4. `robust` takes codes that stand together although cells are hidden.
//! 5. `independent` finds large independent sets of graphs.

pub mod algebra;
pub mod best;
mod independent;
mod joint;
mod local;
mod polish;
mod robust;

pub use local::{Checkpoint, Search};
