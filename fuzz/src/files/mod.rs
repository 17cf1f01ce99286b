//! The file readers, used by the fuzz targets and by the test `tests/it/files/readers.rs`.
//!
//! A random mutation of a file is read, and the reader's guarantees are checked.
//!
//! 1. `reader` lists the readers.
//! 2. `good` makes a valid file for each.
//! 3. `mutate` changes it, preserving its format: `text`, `json`, `png` and `pdf` each handle one, `dice` generates
//!    random numbers.
//! 4. `read` reads it, and panics if a guarantee is violated.

mod dice;
mod good;
mod json;
mod mutate;
mod pdf;
mod png;
mod read;
mod reader;
mod text;

pub use dice::Dice;
pub use reader::{READERS, Reader};
