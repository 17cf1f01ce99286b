//! What is known of families.
//!
//! Comes in: families, by name or as files. Goes out: what they are, in words or as JSON, and whether that is true.
//!
//! 1. `list` has the families that come with the program.
//! 2. `info` tells all about one; `confusion` how far two are from each other, `false_positives` how often a tag is seen
//!    where there is none, `place_codes` what holds for codes of places only.
//! 3. `verify_family` compares what a file claims with its codes.
//! 4. `by_rank` prints tags of a linear family that its file does not list.

pub mod by_rank;
mod confusion;
pub mod false_positives;
pub mod info;
pub mod list;
mod place_codes;
pub mod verify_family;
