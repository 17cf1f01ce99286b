//! Exchange of families with other programs.
//!
//! 1. `import` creates a family file from a table of another program.
//! 2. `export` writes a family in the format of another program.

pub mod export;
pub mod import;
