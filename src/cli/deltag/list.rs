use std::process::ExitCode;

use crate::cli::output::say;
use crate::family::{self, places, shipped_names};

#[derive(clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_: Args) -> anyhow::Result<ExitCode> {
    say!("{:<12} {:>4} {:>8} {:>8}  fingerprint", "family", "bits", "distance", "codes");
    for name in shipped_names() {
        let family = family::resolve(name)?;
        say!(
            "{:<12} {:>4} {:>8} {:>8}  {}",
            family.name(),
            family.dimension().bits(),
            family.distance(),
            family.len(),
            family.fingerprint()
        );
    }
    say!(
        "{:<12} {:>4}   place codes of {} boards: `deltag info {0}`",
        places::NAME,
        9,
        places::BOARDS
    );
    Ok(ExitCode::SUCCESS)
}
