use std::process::ExitCode;

use crate::cli::output::say;
use crate::cli::run::{BAD_INPUT, FAILED, report};
use crate::family::{Family, FamilyError, certify};

/// Told at the end of `--help`.
pub(super) const HELP: &str = "Exit code 0 when every claim of every family holds, 1 when one does \
    not, 2 when a file cannot be read as a family file.";

#[derive(clap::Args)]
pub(super) struct Args {
    /// Family files, or names of shipped families
    #[arg(required = true)]
    families: Vec<String>,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (mut all_hold, mut all_read) = (true, true);
    for name in &args.families {
        let family = match Family::resolve(name) {
            Ok(family) => family,
            Err(error) if error.is_broken_claim() => {
                say!("{name}: DOES NOT HOLD. {}", reason(&error));
                all_hold = false;
                continue;
            }
            Err(error) => {
                report(&error.into());
                all_read = false;
                continue;
            }
        };
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
            say!(
                "{name}: holds. {} codes of {} bits; {how}; every code satisfies the rules; \
                 fingerprint {}",
                family.len(),
                family.dimension().bits(),
                family.fingerprint()
            );
        } else {
            say!("{name}: DOES NOT HOLD. {}", certificate.failures.join("; "));
            all_hold = false;
        }
    }
    Ok(match (all_read, all_hold) {
        (false, _) => ExitCode::from(BAD_INPUT),
        (true, false) => ExitCode::from(FAILED),
        (true, true) => ExitCode::SUCCESS,
    })
}

/// What is wrong in a file that is named already.
fn reason(error: &FamilyError) -> &FamilyError {
    match error {
        FamilyError::In { error, .. } => error,
        other => other,
    }
}
