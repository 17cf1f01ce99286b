use std::process::ExitCode;

use super::place_codes;
use crate::cli::output::say;
use crate::cli::run::{BAD_INPUT, FAILED, report};
use crate::family::{self, Certificate, FamilyFileError, certify};
use crate::words::counted;

/// Told at the end of `--help`.
pub(super) const HELP: &str = "Checked are the codes (distance, rules, fingerprint, statistics) and the \
    construction: an algebraic one, and a lexicode of up to 25 bits, is written down again; what is \
    not repeated is named. Seeds and texts are taken as they are. Exit code 0 when all that is \
    checked holds for every family, 1 when something does not, 2 when a file cannot be read as a \
    family file.";

#[derive(clap::Args)]
pub(super) struct Args {
    /// Family files, or names of shipped families
    #[arg(required = true)]
    families: Vec<String>,
}

pub(super) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (mut all_hold, mut all_read) = (true, true);
    for name in &args.families {
        let family = match family::resolve(name) {
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
        if family.is_of_places() {
            all_hold &= place_codes::verify(&family)?;
            continue;
        }
        let certificate = certify(&family);
        if certificate.holds() {
            let how = proof_of(&certificate, family.distance());
            let unchecked = match certificate.unchecked.as_str() {
                "" => String::new(),
                what => format!("; not checked: {what}"),
            };
            say!(
                "{name}: holds. {} codes of {} bits; {how}; every code satisfies the rules; \
                 fingerprint {}{unchecked}",
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

/// How far apart the codes of a family that claims a distance are, and how that is known.
pub(super) fn proof_of(certificate: &Certificate, claimed: u32) -> String {
    let found = certificate.min_distance;
    let cells = counted(found as usize, "cell");
    if !certificate.all_compared {
        return format!(
            "all are in a linear code of distance {claimed} that turning leaves as it is, checked word \
             by word; a sample of pairs, too, differs in at least {cells}"
        );
    }
    let known = format!("any two, in any turn, differ in at least {cells}");
    match found > claimed {
        true => format!("{known}, more than the {claimed} asked for"),
        false => known,
    }
}

/// What is wrong in a file that is named already.
fn reason(error: &FamilyFileError) -> &dyn std::fmt::Display {
    match error {
        FamilyFileError::In { error, .. } => error,
        other => other,
    }
}
