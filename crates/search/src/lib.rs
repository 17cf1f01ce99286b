//! Searches for families of codes.
//!
//! The input is a number of bits, a distance, rules and a budget; the result is a
//! [`Family`](deltille_core::family::Family).
//!
//! 1. [`best`] tries all of the following methods and keeps the largest result. A lexicode, which takes every word in
//!    order that is far enough from those before it, is in [`deltille_core::family::lexicode`].
//! 2. [`algebra`] constructs codes that are invariant under a rotation of the tag, and `joint` judges their
//!    arrangements by local search.
//! 3. `local` searches without initial codes, and `polish` exchanges the codes of an existing family.
//! 4. `robust` selects compatible codes with hidden cells.
//! 5. `independent` finds large independent sets of graphs.

pub mod algebra;
pub mod best;
mod independent;
mod joint;
mod local;
mod polish;
mod robust;

pub use local::{Checkpoint, Search};
