//! From the cells of a tag in a photograph to its code.
//!
//! `tagwords` turns a reading of cells into words, [`decoder`] finds the code that is nearest to one.

pub(in crate::family) mod decoder;
pub(in crate::family) mod tagwords;

pub use decoder::{Decoded, Decoder};
pub use tagwords::TagWords;
