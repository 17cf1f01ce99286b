use std::process::ExitCode;

use crate::cli::run::FAILED;
use crate::family::{Family, certify};

#[derive(clap::Args)]
pub(super) struct Args {
    /// Family files, or names of shipped families
    #[arg(required = true)]
    families: Vec<String>,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let mut all_hold = true;
    for name in &args.families {
        let family = Family::resolve(name)?;
        let certificate = certify(&family);
        if certificate.holds() {
            println!(
                "{name}: holds. {} codes of {} bits; any two, in any turn, differ in at least {} \
                 cells; every code satisfies the rules; fingerprint {}",
                family.len(),
                family.dimension().bits(),
                certificate.min_distance,
                family.fingerprint()
            );
        } else {
            println!("{name}: DOES NOT HOLD. {}", certificate.failures.join("; "));
            all_hold = false;
        }
    }
    Ok(if all_hold { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
