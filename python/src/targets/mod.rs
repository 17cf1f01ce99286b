//! Targets and the families of their tags.
//!
//! Input: keywords, or a target's file. Output: a `Target`, its files, and the verdict on files. Calls pass through the files
//! in this order:
//!
//! 1. `families` reads, searches and decodes families of tags.
//! 2. `boards`, `other_detectors` and `solids` are the classes that make targets.
//! 3. `paper` contains their common keywords for paper, finish and logo.
//! 4. `target` is their base class; `pickled_target` restores a target in its class.
//! 5. `making` checks the formats and keywords of files.
//! 6. `verdict` is the result of comparing a file with its target.

pub mod boards;
pub mod families;
mod making;
pub mod other_detectors;
mod paper;
pub mod pickled_target;
pub mod solids;
pub mod target;
pub mod verdict;
