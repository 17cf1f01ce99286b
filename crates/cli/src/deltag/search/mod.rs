//! New families: from bits and a distance to a file.
//!
//! Comes in: what a family has to do, and which codes its rules refuse. Goes out: the file of a family, compared with what
//! it claims. A user meets the files in this order:
//!
//! 1. `plan` names the smallest shipped family that suffices, which spares a search.
//! 2. `parameters` are bits and distance, as in d25h7; `bounds` says how large such a family could be.
//! 3. `rules` are those of a search, by options or a file; `frontier` says what rules leave of a construction.
//! 4. `gen_family` searches, and writes what it found.
//! 5. `checkpoint` is the file from which an interrupted search goes on.

pub mod bounds;
mod checkpoint;
pub mod frontier;
pub mod gen_family;
mod parameters;
pub mod plan;
mod rules;
