//! Codes that a turn of the tag leaves invariant, found by algebra instead of trial.
//!
//! A turn permutes the cells of a tag in m cycles of three, and one central cell stays when
//! b mod 3 = 1. In *cycle coordinates* the cycle c holds bits 3c, 3c+1, 3c+2 of a word, the turn
//! moves bit 3c+j to 3c+(j+1 mod 3), and the central cell is bit 3m. A code that this permutation
//! leaves invariant yields a family: one tag for each orbit of three words (`docs/families.md`).
//!
//! - [`residue`]: extended quadratic-residue codes, which have a symmetry of order three.
//! - [`quasicyclic`]: random invariant linear codes with further symmetries.
//! - [`cosets`]: unions of cosets of an invariant linear code, by clique search.
//! - [`ranked`]: the tags of a linear code by number, without listing them.
//! - [`arrange`]: which cycle of the code goes where on the tag decides how many words look good.

pub mod arrange;
pub mod cosets;
mod cycles;
mod linear_map;
pub mod quasicyclic;
pub mod ranked;
pub(in crate::family) mod record;
pub mod residue;
mod span;

pub use cycles::{Arrangement, CycleSpace};
pub use linear_map::LinearMap;
pub use record::AlgebraicConstruction;
pub use span::Span;
