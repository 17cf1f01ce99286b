//! The programs, run from Python's entry points.

use std::ffi::OsString;

use deltille_cli::{deltag, deltille as program, run};
use pyo3::prelude::*;

/// Runs a program with its arguments, the first being its name, and ends the process with its exit code.
///
/// The interpreter's lock is released for good: no Python code runs any more, and signals are the program's, as if it
/// had been started by itself. A signal that came would be raised by the interpreter once more, so nothing returns to it.
#[pyfunction]
pub fn _run(py: Python<'_>, name: &str, arguments: Vec<OsString>) {
    py.detach(|| {
        let code = match name {
            "deltag" => run::run_with(arguments, deltag::run),
            _ => run::run_with(arguments, program::run),
        };
        std::process::exit(run::number(code).into())
    })
}
