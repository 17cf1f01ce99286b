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
            let how = if certificate.all_compared {
                format!(
                    "any two, in any turn, differ in at least {} cells",
                    certificate.min_distance
                )
            } else {
                format!(
                    "all are in a linear code of distance {} that turning leaves as it is, checked \
                     word by word; a sample of pairs, too, differs in at least {} cells",
                    family.distance(),
                    certificate.min_distance
                )
            };
            println!(
                "{name}: holds. {} codes of {} bits; {how}; every code satisfies the rules; \
                 fingerprint {}",
                family.len(),
                family.dimension().bits(),
                family.fingerprint()
            );
        } else {
            println!("{name}: DOES NOT HOLD. {}", certificate.failures.join("; "));
            all_hold = false;
        }
    }
    Ok(if all_hold { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}
