//! The readers of files, one by one, used by the fuzz targets and by the test `tests/it/files/readers.rs`.
//!
//! Comes in: chance. Goes out: a file that was changed, and whether its reader keeps what must hold.
//!
//! 1. `reader` names the readers.
//! 2. `good` makes a file that each reads without complaint.
//! 3. `mutate` changes it, keeping its form: `text`, `json`, `png` and `pdf` each know one, `dice` is the chance.
//! 4. `read` reads it, and panics where something holds that must not.

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
