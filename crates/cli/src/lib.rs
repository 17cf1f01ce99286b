//! The programs: arguments, progress, messages and exit codes. This crate contains no algorithms.
//!
//! 1. `run`: from the command line to an exit code; `values`: parsers of option values;
//! 2. `deltag`, `deltille`: the commands;
//! 3. `wording`: option names in messages; `output`: printed lines and written files;
//! 4. `terminal`: how much is printed, and colours;
//! 5. `progress`, `interrupt`: support for long-running work; `shell`: completions and manual
//!    pages.

#![allow(unreachable_pub, reason = "programs have no public interface")]
#![allow(clippy::missing_errors_doc, reason = "errors of programs are messages for users")]

pub mod deltag;
pub mod deltille;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod run;
pub mod shell;
pub mod terminal;
mod values;
pub mod wording;
