//! `deltille check`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::new_views::{Known, NewViewsArgs};
use crate::interrupt;
use crate::output::{self, Overwrite, report};
use crate::run::{FAILED, UNDECIDED};
use deltille::calibrate::{Answer, Check, Missing, QuantityTest, Suspect};
use deltille::export::kind::Kind;
use deltille::export::{check, saved};
use deltille_core::words::{counted, p_value, places};

/// Arguments of `deltille check`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    views: NewViewsArgs,
    /// Write the answer with all tests
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Checks a camera or a rig. The exit code is 1 if it has changed, and 3 if this cannot be determined.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path =
        args.output.as_deref().map(|path| output::file(path, "check", "json")).transpose()?;
    if let Some(path) = &path {
        args.overwrite.check(path, &Kind::of_schema(check::SCHEMA))?;
    }
    let known = args.views.known()?;
    // A camera file without uncertainties is accepted, because its image size can be checked.
    let found = args.views.views(&known)?.check(&known.before);
    if let Some(path) = &path {
        output::write(path, check::write(&found).as_bytes(), args.overwrite)?;
    }
    output::print(&describe(&found, with_uncertainties(args.views.camera(), &known, &found)))?;
    if let Some(path) = &path {
        report!("{}", output::wrote(path));
    }
    if interrupt::has_ended_input() {
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    Ok(match found.answer {
        Answer::Unchanged => ExitCode::SUCCESS,
        Answer::Changed => ExitCode::from(FAILED),
        _ => ExitCode::from(UNDECIDED),
    })
}

/// The calibration beside a camera file, if the check lacks its uncertainties.
fn with_uncertainties(camera: &Path, known: &Known, found: &Check) -> Option<PathBuf> {
    let beside = camera.with_extension("json");
    let is_lacking = found.missing == [Missing::Covariance];
    let text = is_lacking.then(|| known.limits.read_text(&beside).ok()).flatten()?;
    let calibration = saved::read_without_target(&text).ok()?;
    (known.calibration.check(&calibration).missing != found.missing).then_some(beside)
}

/// Describes the answer, one statement per line; `beside` is the calibration whose uncertainties are missing.
fn describe(found: &Check, beside: Option<PathBuf>) -> String {
    let names = |of: &[Suspect], between: &str| {
        of.iter().map(ToString::to_string).collect::<Vec<_>>().join(between)
    };
    let of = format!("{}, {}", counted(found.views, "view"), counted(found.corners, "corner"));
    let p = found.p_value.map_or(String::new(), |p| format!(", {}", p_value(p)));
    let mut text = match found.answer {
        Answer::Unchanged => format!("unchanged: {of}{p}\n"),
        Answer::Changed => match found.sizes_px {
            [from, to] if from != to => format!(
                "changed: {}: the camera has {} × {} px, the photographs {} × {} px\n",
                names(&found.changed, " and "),
                from[0],
                from[1],
                to[0],
                to[1]
            ),
            // The p-value of all quantities together may be large beside a change of one.
            _ => {
                let or: String =
                    found.or.iter().map(|quantity| format!(", or {quantity}")).collect();
                format!("changed: {}{or}: {of}\n", names(&found.changed, " and "))
            }
        },
        _ => match beside {
            Some(path) => format!(
                "cannot tell: the camera file has no uncertainties: use {}, which has them\n",
                path.display()
            ),
            None => found.missing.iter().map(|why| format!("cannot tell: {why}\n")).collect(),
        },
    };
    if let Some([a, b]) = &found.exchanged {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "exchanged: with the images of {a} and {b} exchanged, the rig agrees with them"
        );
    }
    for test in &found.tests {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}", describe_test(test));
    }
    text
}

fn describe_test(test: &QuantityTest) -> String {
    let unit = test.of.quantity.unit();
    let digits = places(test.detectable.clamp(1e-6, 1e6)).min(4);
    let far = match test.detectable.is_finite() && test.detectable < 1e6 {
        true => format!("a change of {:.digits$} {unit} would have been found", test.detectable),
        false => "no change would have been found".to_owned(),
    };
    let change = format!("{:.digits$}", test.change);
    // Without the sign of a zero.
    let is_zero = change.bytes().all(|byte| b"-0.".contains(&byte));
    let change = if is_zero { change.trim_start_matches('-') } else { &change };
    format!("{}: {change} {unit} ({}); {far}", test.of, p_value(test.p_value))
}
