//! Codes that are invariant under a rotation of the tag by 120°, constructed by algebra instead of trial.
//!
//! A rotation permutes the cells of a tag in m cycles of three. If b mod 3 = 1 for b bits, one central cell is fixed.
//! In *cycle coordinates*, cycle c contains bits 3c, 3c+1, 3c+2 of a word, the rotation moves bit 3c+j to 3c+(j+1 mod
//! 3), and the central cell is bit 3m. Words are `u64` with one bit per cell, 64 at most. A code that is invariant
//! under this permutation yields a family: one tag for each orbit of three words (`docs/families.md`).
//!
//! - `cycles`: cycle coordinates, and the placement of cycles on the cells of a tag;
//! - `span`: linear codes; `linear_map`: their syndromes; `weights`: the weight distribution of a code, from that of
//!   the dual if the code has too many words;
//! - `cosets`: unions of cosets of a linear code; `ranked`: the tags of a linear code by number, without listing the
//!   code;
//! - `record`: the construction as stored in the family file; the codes can be listed again and
//!   their distance proved from it.
//!
//! The crate `deltille-search` finds such codes.

mod cosets;
mod cycles;
mod linear_map;
mod ranked;
mod record;
mod span;
mod weights;

pub use cosets::CosetUnion;
pub use cycles::{Arrangement, CycleSpace, Placing, cycles_in};
pub use linear_map::LinearMap;
pub use ranked::Ranked;
pub use record::{AlgebraicConstruction, arranged, has_free_centre, stride_of};
pub use span::Span;
pub use weights::weights;
