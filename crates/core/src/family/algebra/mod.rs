//! Codes that are invariant under a turn of the tag by 120°, constructed by algebra instead of
//! trial.
//!
//! A turn permutes the cells of a tag in m cycles of three; one central cell stays where it is when
//! b mod 3 = 1, b being the number of bits. In *cycle coordinates* cycle c holds bits 3c, 3c+1,
//! 3c+2 of a word, the turn moves bit 3c+j to 3c+(j+1 mod 3), and the central cell is bit 3m. Words
//! are `u64` with one bit for each cell, 64 at most. A code that this permutation leaves invariant yields a
//! family: one tag for each orbit of three words (`docs/families.md`).
//!
//! - `cycles`: cycle coordinates, and how cycles are placed on the cells of a tag;
//! - `span`: linear codes; `linear_map`: their syndromes; `weights`: how many words have each weight, by those of the dual where
//!   a code has too many;
//! - `cosets`: unions of cosets of a linear code; `ranked`: the tags of a linear code by number, without listing the code;
//! - `record`: the construction as its file holds it, which lists the codes again and proves their distance.
//!
//! How such codes are found is the crate `deltille-search`.

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
