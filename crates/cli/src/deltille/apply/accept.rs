//! `deltille accept`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow};

use super::new_views::NewViewsArgs;
use crate::interrupt;
use crate::output::{self, Overwrite, log};
use crate::run::{FAILED, UNDECIDED};
use deltille::calibrate::{
    Acceptance, AcceptanceRequest, Conformity, CornerLabel, KnownLength, Limit, Temperature,
};
use deltille::export::acceptance;
use deltille::export::kind::Kind;
use deltille::known_lengths;
use deltille::limits::Limits;
use deltille::report::Certificate;
use deltille::targets::{Target, parse_length_mm};
use deltille_core::words::{counted, places};

/// Arguments of `deltille accept`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    views: NewViewsArgs,
    /// Largest permitted error of a length L, such as 0.1mm or 0.05mm+L/2000; without it, errors are reported and not judged
    #[arg(long, value_name = "LENGTH[+L/N]", value_parser = limit)]
    limit: Option<Limit>,
    /// Table of lengths on the target that were measured by other means: CSV with the columns row_a, col_a, row_b, col_b,
    /// length_mm, sd_mm, and panel_a, panel_b for several panels [default: lengths between corners as described]
    #[arg(long, value_name = "FILE.csv")]
    lengths: Option<PathBuf>,
    /// Temperature of the target and its standard deviation, °C, such as 24.5±0.5 or 24.5+-0.5. Lengths are known at 20 °C
    #[arg(long, value_name = "CELSIUS±SD", value_parser = measured, requires = "expansion")]
    temperature: Option<(f64, f64)>,
    /// Coefficient of linear expansion of the target and its standard deviation, ppm/K, such as 23.8±1 for aluminium
    #[arg(long, value_name = "PPM±SD", value_parser = measured, requires = "temperature")]
    expansion: Option<(f64, f64)>,
    /// Write a certificate of one page of A4
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Write all lengths with their uncertainties
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Measures lengths. The exit code is 1 if an error exceeds the limit, and 3 if this cannot be decided.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path =
        args.output.as_deref().map(|path| output::file(path, "acceptance", "json")).transpose()?;
    if let Some(path) = &path {
        args.overwrite.check(path, &Kind::of_schema(acceptance::SCHEMA))?;
    }
    let page = args.report.as_deref().map(|page| output::page(page, "acceptance", args.overwrite));
    let page = page.transpose()?;
    let known = args.views.known()?;
    let request = args.request(&known.printing.target, &known.limits)?;
    let found = args.views.views(&known)?.accept(&known.before, &request);
    let found = found.with_context(|| args.views.camera().display().to_string())?;
    if !found.reused.is_empty() {
        log!(
            "note: not used, because they were used for the calibration: {}, such as {}",
            counted(found.reused.len(), "image"),
            found.reused[0]
        );
    }
    if let Some(path) = &path {
        output::write(path, acceptance::write(&found).as_bytes(), args.overwrite)?;
    }
    if let Some(page) = &page {
        let name =
            |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let certificate = Certificate {
            calibration: name(args.views.camera()),
            target: known.printing.target.name.to_string(),
            lengths: args.lengths.as_deref().map(name),
            temperature: request.temperature,
            found: &found,
        };
        output::write(page, certificate.html().as_bytes(), args.overwrite).context("--report")?;
    }
    output::print(&describe(&found))?;
    if interrupt::has_ended_input() {
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    Ok(match found.verdict() {
        None | Some(Conformity::Conforms) => ExitCode::SUCCESS,
        Some(Conformity::Fails) => ExitCode::from(FAILED),
        Some(Conformity::Undecided) => ExitCode::from(UNDECIDED),
    })
}

impl Args {
    fn request(&self, target: &Target, limits: &Limits) -> anyhow::Result<AcceptanceRequest> {
        let temperature = self.temperature.zip(self.expansion).map(|(celsius, ppm)| Temperature {
            above_reference_k: celsius.0 - Temperature::REFERENCE_C,
            sd_k: celsius.1,
            expansion_per_k: ppm.0 * 1e-6,
            expansion_sd_per_k: ppm.1 * 1e-6,
        });
        let lengths = self.lengths.as_deref().map(|path| known_lengths(path, target, limits));
        let lengths = lengths.transpose().context("--lengths")?.unwrap_or_default();
        Ok(AcceptanceRequest { lengths, limit: self.limit, temperature })
    }
}

/// Reads the table of measured lengths, whose ends must be corners of the target.
fn known_lengths(
    path: &Path,
    target: &Target,
    limits: &Limits,
) -> anyhow::Result<Vec<KnownLength>> {
    let show = || path.display().to_string();
    let text = limits.read_text(path)?;
    let of = |length: known_lengths::Length| {
        let ends = length.ends.map(|(panel, row, col)| {
            let end = CornerLabel::on(target, panel, row, col);
            end.with_context(|| format!("line {}", length.line))
        });
        let [a, b] = ends;
        Ok(KnownLength { ends: [a?, b?], length_mm: length.length_mm, sd_mm: length.sd_mm })
    };
    let lengths =
        known_lengths::parse(&text).map_err(|problem| anyhow!(problem).context(show()))?;
    let lengths: anyhow::Result<Vec<KnownLength>> = lengths.into_iter().map(of).collect();
    lengths.with_context(show)
}

/// Parses a limit, such as `0.05mm+L/2000`.
fn limit(text: &str) -> Result<Limit, String> {
    let (constant, per_length) = match text.split_once('+') {
        None => (text, 0.0),
        Some((constant, rest)) => {
            let divisor = rest.trim().strip_prefix(['L', 'l']).map(str::trim_start);
            let divisor =
                divisor.and_then(|rest| rest.strip_prefix('/')?.trim().parse::<f64>().ok());
            let divisor = divisor.filter(|of| of.is_finite() && *of > 0.0);
            (
                constant,
                1.0 / divisor
                    .ok_or("expected a length, or a length + L/N such as 0.05mm+L/2000")?,
            )
        }
    };
    let constant_mm = parse_length_mm(constant).map_err(|error| error.to_string())?;
    match constant_mm > 0.0 {
        true => Ok(Limit { constant_mm, per_length }),
        false => Err("the limit must be positive".to_owned()),
    }
}

/// Parses a value and its standard deviation, such as `24.5±0.5`; without one, it is exact.
fn measured(text: &str) -> Result<(f64, f64), String> {
    let (value, sd) = text.split_once('±').or_else(|| text.split_once("+-")).unwrap_or((text, "0"));
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    match (number(value), number(sd)) {
        (Some(value), Some(sd)) if sd >= 0.0 => Ok((value, sd)),
        _ => {
            Err("expected a value, or a value and its standard deviation such as 24.5±0.5"
                .to_owned())
        }
    }
}

/// Describes the result, one statement per line.
fn describe(found: &Acceptance) -> String {
    let Some(largest) = found.largest() else { return String::new() };
    let digits = |mm: f64| places(mm.max(1e-6)).min(6);
    let d = digits(largest.budget.combined_mm());
    let verdict = match found.verdict() {
        Some(Conformity::Conforms) => "conforms: ",
        Some(Conformity::Fails) => "does not conform: ",
        Some(Conformity::Undecided) => "undecided: ",
        None => "",
    };
    let limit = found
        .limit
        .map_or(String::new(), |limit| format!(", limit {:.d$} mm", limit.of(largest.known_mm)));
    let [from, to] = largest.ends.map(|end| format!("{}, {}", end.row, end.col));
    let mut text = format!(
        "{verdict}largest error of {}: {:+.d$} mm, expanded uncertainty {:.d$} mm{limit} (from {from} to {to} in {}, {:.1} mm)\n",
        counted(found.lengths.len(), "length"),
        largest.error_mm(),
        largest.budget.expanded_mm(),
        largest.frame,
        largest.known_mm
    );
    let budget = &largest.budget;
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "its standard uncertainty: {:.d$} mm from noise, {:.d$} from lens and other errors of corners, {:.d$} from the calibration, \
         {:.d$} from the target, {:.d$} from temperature; k = {:.2}",
        budget.noise_mm,
        budget.lens_mm,
        budget.calibration_mm,
        budget.target_mm,
        budget.temperature_mm,
        budget.coverage_factor()
    );
    let _ = writeln!(
        text,
        "{} of {} are within their expanded uncertainty of 95 %",
        found.within(),
        counted(found.lengths.len(), "error")
    );
    let probing = &found.probing;
    let d = digits(probing.rms_mm);
    let at = probing.at.as_ref().map_or(String::new(), |(label, frame)| {
        format!(" (corner {}, {} in {frame})", label.row, label.col)
    });
    let _ = writeln!(
        text,
        "probing error: {:.d$} mm{at}; rms {:.d$} mm of {}",
        probing.largest_mm,
        probing.rms_mm,
        counted(probing.corners, "corner")
    );
    text
}
