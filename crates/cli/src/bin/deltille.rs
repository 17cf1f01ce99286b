//! `deltille`: make, detect and verify deltille targets.

use std::process::ExitCode;

use deltille_cli::{deltille, run};

fn main() -> ExitCode {
    run::run(deltille::run)
}
