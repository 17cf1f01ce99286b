//! The programs: arguments, progress, messages and exit codes. No algorithm lives here.

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
