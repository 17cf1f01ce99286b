//! Runs the programs from Python's entry points.

use std::ffi::OsString;

use deltille_cli::{deltag, deltille as program, run};
use pyo3::prelude::*;

/// Runs a program with its arguments, the first of which is its name, and ends the process with its exit code.
///
/// The interpreter's lock is released permanently: no Python code runs afterwards, and the program handles signals as if it
/// had been started directly. The function never returns, because the interpreter would raise pending signals again.
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
