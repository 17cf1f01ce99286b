//! The programs: arguments, progress, messages and exit codes. No algorithm lives here.
//!
//! 1. `run`: from the command line to an exit code; `values`: numbers and lengths of options;
//! 2. `deltag`, `deltille`: the commands;
//! 3. `wording`: names of options in messages; `output`: where lines and files go;
//! 4. `progress`, `interrupt`: long work; `shell`: completions and manual pages.

#![allow(unreachable_pub, reason = "programs have no interface")]
#![allow(clippy::missing_errors_doc, reason = "errors of programs are sentences for people")]

pub mod deltag;
pub mod deltille;
pub mod interrupt;
pub mod output;
pub mod progress;
pub mod run;
pub mod shell;
mod values;
pub mod wording;
