//! The best of all methods within a time limit. It starts from the best construction on record and
//! from sources of invariant codes. It arranges them on the tag so that the number of words that
//! satisfy the rules is largest. Local search repairs and extends them.
//!
//! The result depends on the time, so it is recorded in full
//! ([`AlgebraicConstruction`](deltille_core::family::algebra::AlgebraicConstruction)) and gives the same codes again
//! without any search. With an amount of work instead of a time, the same seed gives the same codes on every machine.
//!
//! The input is a [`Best`], the request. The result is a family at least as large as the one on record.
//!
//! 1. `request`: the request, the start of a search, and the maximum number of codes;
//! 2. `budget`: the duration of a search, and its progress;
//! 3. `legs`: the division into legs, so that a search can be interrupted; `one_leg`: one of them;
//! 4. `sources`: drawing of codes, and unions of their cosets;
//! 5. `arranged`: their arrangement on the tag, the most promising first.

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
