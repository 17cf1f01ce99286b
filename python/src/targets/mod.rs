//! Targets and the families of their tags.
//!
//! Comes in: what is asked for, by keywords, or a target's file. Goes out: a `Target`, its files, and whether they are
//! what it describes. Calls meet the files in this order:
//!
//! 1. `families` are codes of tags: read, searched, decoded.
//! 2. `boards`, `other_detectors` and `solids` are the classes that are asked for a target.
//! 3. `paper` is what all of them are told about paper, finish and logo.
//! 4. `target` is what they become; `pickled_target` gives one back its class.
//! 5. `making` reads the formats and keywords of its files.
//! 6. `verdict` says whether a file is what the target describes.

pub mod boards;
pub mod families;
mod making;
pub mod other_detectors;
mod paper;
pub mod pickled_target;
pub mod solids;
pub mod target;
pub mod verdict;
