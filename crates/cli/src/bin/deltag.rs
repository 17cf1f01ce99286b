//! `deltag`: search, check and draw DelTag code families.

use std::process::ExitCode;

use deltille::cli::{deltag, run};

fn main() -> ExitCode {
    run::run(deltag::run)
}
