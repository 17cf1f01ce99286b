//! Information about families.
//!
//! Input: families, by name or as files. Output: their properties as text or JSON, and whether their claims are true.
//!
//! 1. `list` lists the families that ship with the program.
//! 2. `info` describes one family. `confusion` computes the distance between two, `false_positives` the
//!    false-positive rates, and `position_codes` covers position codes.
//! 3. `verify_family` checks the claims of a file against its codes.
//! 4. `by_rank` prints tags of a linear family beyond those listed in its file.

pub mod by_rank;
mod confusion;
pub mod false_positives;
pub mod info;
pub mod list;
mod position_codes;
pub mod verify_family;
