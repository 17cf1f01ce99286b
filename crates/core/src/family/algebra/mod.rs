//! Codes that are invariant under a turn of the tag by 120°, constructed by algebra instead of
//! trial.
//!
//! A turn permutes the cells of a tag in m cycles of three; one central cell stays where it is when
//! b mod 3 = 1, b being the number of bits. In *cycle coordinates* cycle c holds bits 3c, 3c+1,
//! 3c+2 of a word, the turn moves bit 3c+j to 3c+(j+1 mod 3), and the central cell is bit 3m. Words
//! are `u64` with one bit for each cell, 64 at most. A code that this permutation leaves invariant yields a
//! family: one tag for each orbit of three words (`docs/families.md`).
//!
//! - [`residue`]: extended quadratic-residue codes (extended cyclic codes), which have a symmetry of order three.
//! - [`bch`]: extended BCH codes of length 64, which have one, too, and fix one position.
//! - [`quasicyclic`]: random invariant linear codes with a further quasi-cyclic symmetry.
//! - [`cosets`]: unions of cosets of an invariant linear code, found by clique search over syndromes.
//! - [`ranked`]: the tags of a linear code by number, computed without listing the code.
//! - [`weights`]: how many words have each weight, by those of the dual where a code has too many.
//! - [`arrange`]: the assignment of code cycles to tag cycles, by simulated annealing; it decides
//!   how many words satisfy the rules on complexity.

pub mod arrange;
pub mod bch;
mod clique;
pub mod cosets;
mod cycles;
mod linear_map;
pub mod quasicyclic;
pub mod ranked;
pub(in crate::family) mod record;
pub mod residue;
mod span;
pub mod weights;

pub(in crate::family) use cycles::Placing;
pub use cycles::{Arrangement, CycleSpace};
pub use linear_map::LinearMap;
pub use record::AlgebraicConstruction;
pub use span::Span;
