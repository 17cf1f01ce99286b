use std::process::ExitCode;

use serde_json::json;

use super::position_codes;
use crate::output::{self, ResultFormat, line, say};
use crate::run::{BAD_INPUT, FAILED, report};
use deltille::family::{self, Certificate, Family, FamilyFileError, Robust, certify};
use deltille_core::words::counted;

/// Text at the end of `--help`.
pub const HELP: &str = "Checks the codes (distance, rules, fingerprint, statistics) and the construction. Algebraic \
    constructions, and lexicodes of up to 25 bits, are recomputed; the output names every claim that is not checked. \
    Seeds and free-text fields are not checked. Exit code 0 if all checks pass for every family, 1 if one fails, 2 \
    if a file cannot be read as a family file.";

#[derive(clap::Args)]
pub struct Args {
    /// Family files, or names of shipped families
    #[arg(required = true)]
    families: Vec<String>,
    #[command(flatten)]
    result_format: ResultFormat,
}

pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let (mut all_hold, mut all_read) = (true, true);
    let mut results = Vec::new();
    for name in &args.families {
        let mut certificate = None;
        let (holds, what) = match family::resolve(name) {
            Ok(family) if family.is_position_family() => position_codes::verify(&family),
            Ok(family) => verify(&family, certificate.insert(certify(&family))),
            Err(error) if error.is_broken_claim() => (false, reason(&error).to_string()),
            Err(error) => {
                report(&error.into());
                all_read = false;
                continue;
            }
        };
        all_hold &= holds;
        if args.result_format.is_json() {
            results.push(json!({
                "family": name, "valid": holds, "text": line(&what).trim_end(),
                "distance": certificate.as_ref().map(|found| found.min_distance),
                "mirror_distance": certificate.and_then(|found| found.mirror_distance),
            }));
        } else if holds {
            say!("{name}: verified. {what}");
        } else {
            say!("{name}: FAILED. {what}");
        }
    }
    if args.result_format.is_json() {
        output::print_json(&results)?;
    }
    Ok(match (all_read, all_hold) {
        (false, _) => ExitCode::from(BAD_INPUT),
        (true, false) => ExitCode::from(FAILED),
        (true, true) => ExitCode::SUCCESS,
    })
}

/// Checks the claims of a family; returns whether they are true, and a description.
fn verify(family: &Family, certificate: &Certificate) -> (bool, String) {
    if !certificate.is_valid() {
        return (false, certificate.failures.join("; "));
    }
    let how = proof_of(certificate, family.distance());
    let unchecked = match certificate.unchecked.as_str() {
        "" => String::new(),
        what => format!("; not checked: {what}"),
    };
    let (bits, fingerprint) = (family.dimension().bits(), family.fingerprint());
    let what = format!(
        "{} codes of {bits} bits; {how}; every code satisfies the rules; fingerprint {fingerprint}{unchecked}",
        family.len()
    );
    let before = family.beginnings().iter().map(|before| {
        format!("; the first {} codes have fingerprint {}", before.codes, before.fingerprint)
    });
    let what: String = std::iter::once(what).chain(before).collect();
    (true, what)
}

/// Describes the minimum distance of a family, and how it was established.
pub fn proof_of(certificate: &Certificate, claimed: u32) -> String {
    let found = certificate.min_distance;
    let cells = counted(found as usize, "cell");
    if !certificate.all_compared {
        return format!(
            "all codes are in a linear code of distance {claimed} that is closed under rotation, checked word by \
             word; in a sample of pairs, any two also differ in at least {cells}"
        );
    }
    let known = format!("any two codes, in any rotation, differ in at least {cells}");
    let known = match found > claimed {
        true => format!("{known}, more than the required {claimed}"),
        false => known,
    };
    let hidden = |found: &Robust| {
        let least = counted(found.distance as usize, "cell");
        format!("; with any {} hidden, in at least {least}", found.to.name())
    };
    let known: String =
        std::iter::once(known).chain(certificate.robust.iter().map(hidden)).collect();
    match certificate.mirror_distance {
        Some(cells) => format!("{known}; mirrored codes differ in {cells}"),
        None => known,
    }
}

/// Returns the error without the file name, which the caller has already printed.
fn reason(error: &FamilyFileError) -> &dyn std::fmt::Display {
    match error {
        FamilyFileError::In { error, .. } => error,
        other => other,
    }
}
