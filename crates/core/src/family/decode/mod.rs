//! From the cells of a tag in a photograph to its code.
//!
//! `tagwords` converts readings of cells to words; [`decoder`] finds the code closest to a word.

pub(in crate::family) mod decoder;
pub(in crate::family) mod tagwords;

pub use decoder::{Decoded, Decoder};
pub use tagwords::TagWords;
