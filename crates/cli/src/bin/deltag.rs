//! `deltag`: search, check and draw DelTag code families.

use std::process::ExitCode;

use deltille_cli::{deltag, run};

fn main() -> ExitCode {
    run::run(deltag::run)
}
