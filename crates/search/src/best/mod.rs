//! The best of all methods within a time limit: the best construction on record, and sources of invariant
//! codes, arranged on the tag so that as many words as possible satisfy the rules, then repaired and
//! extended by local search.
//!
//! How far it gets depends on the time, so what it found is recorded in full
//! ([`AlgebraicConstruction`](deltille_core::family::algebra::AlgebraicConstruction)) and gives the same codes again
//! without any search. With an amount of work instead of a time the same seed gives the same codes on every machine.
//!
//! Comes in: a [`Best`], what is asked for. Goes out: a family, at least as large as what is on record.
//!
//! 1. `request` is what is asked for, what a search starts from, and how many codes there can be.
//! 2. `budget` is how long it goes on, and how far it has come.
//! 3. `legs` divides it into legs, so that it can be interrupted; `one_leg` is one of them.
//! 4. `sources` draws codes, and unions of their cosets.
//! 5. `arranged` arranges these on the tag, the most promising first.

mod arranged;
mod budget;
mod legs;
mod one_leg;
mod request;
mod sources;

pub use budget::Budget;
pub use legs::Checkpoint;
pub use request::{Best, Start};
pub use sources::DRAWS;
