//! Families of and for other programs.
//!
//! 1. `import` makes the file of a family from the table of another program.
//! 2. `export` writes a family as another program reads it.

pub mod export;
pub mod import;
