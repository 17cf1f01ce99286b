//! `deltille accept`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, anyhow};

use super::new_views::NewViewsArgs;
use crate::interrupt;
use crate::output::{self, Overwrite, log, report};
use crate::run::{FAILED, UNDECIDED};
use deltille::calibrate::{
    Acceptance, AcceptanceError, AcceptanceRequest, Conformity, CornerLabel, KnownLength, Limit,
    Temperature,
};
use deltille::export::acceptance::{self, Tested};
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
    #[arg(long, value_name = "LENGTH[+L/N]", value_parser = limit, allow_hyphen_values = true)]
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
    // What does not depend on the photographs fails before they are read.
    let without = known.calibration.accept(&known.before, &request);
    if let Err(error @ (AcceptanceError::Uncertainty | AcceptanceError::Temperature)) = without {
        return Err(error).with_context(|| args.views.camera().display().to_string());
    }
    let views = args.views.views(&known)?;
    if interrupt::has_ended_input() {
        log!("note: interrupted; nothing was written");
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    let found = views.accept(&known.before, &request);
    let found = found.with_context(|| args.views.camera().display().to_string())?;
    for (names, why) in [
        (&found.reused, "their pose is that of an image of the calibration"),
        (&found.unmeasured, "too few corners were seen"),
    ] {
        if let Some(first) = names.first() {
            log!("note: not measured: {}, such as {first}: {why}", counted(names.len(), "image"));
        }
    }
    for of in found.missing() {
        let [from, to] = of.ends.map(|end| corner(&found, &end));
        log!(
            "warning: --lengths: the length from {from} to {to} was not measured: its ends were never seen together"
        );
    }
    if found.extrapolated > 0 {
        log!(
            "note: {} of {} are outside the calibrated part of the image, where the lens is extrapolated",
            found.extrapolated,
            counted(found.observations, "corner")
        );
    }
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let tested = Tested {
        calibration: name(args.views.camera()),
        calibration_sha256: Some(acceptance::fingerprint(&known.limits.read(args.views.camera())?)),
        target: known.printing.target.identity().to_string(),
        lengths: args.lengths.as_deref().map(name),
    };
    if let Some(path) = &path {
        let text = acceptance::write(&found, Some(&tested));
        output::write(path, text.as_bytes(), args.overwrite)?;
    }
    if let Some(page) = &page {
        let certificate = Certificate { tested, found: &found };
        output::write(page, certificate.html().as_bytes(), args.overwrite).context("--report")?;
    }
    output::print(&describe(&found))?;
    for path in path.iter().chain(&page) {
        report!("{}", output::wrote(path));
    }
    Ok(match found.verdict() {
        None | Some(Conformity::Conforms) => ExitCode::SUCCESS,
        Some(Conformity::Fails) => ExitCode::from(FAILED),
        Some(Conformity::Undecided) => ExitCode::from(UNDECIDED),
    })
}

impl Args {
    fn request(&self, target: &Target, limits: &Limits) -> anyhow::Result<AcceptanceRequest> {
        let temperature = self.temperature.zip(self.expansion);
        let temperature =
            temperature.map(|(celsius, ppm_per_k)| Temperature::new(celsius, ppm_per_k));
        let temperature = temperature.transpose().context("--temperature, --expansion")?;
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
        let known = KnownLength::on(target, [a?, b?], length.length_mm, length.sd_mm);
        known.with_context(|| format!("line {}", length.line))
    };
    let lengths =
        known_lengths::parse(&text).map_err(|problem| anyhow!(problem).context(show()))?;
    let lines: Vec<usize> = lengths.iter().map(|length| length.line).collect();
    let lengths: anyhow::Result<Vec<KnownLength>> = lengths.into_iter().map(of).collect();
    let lengths = lengths.with_context(show)?;
    if let Some(repeated) = KnownLength::repeated(&lengths) {
        let [line, first] = repeated.map(|index| lines[index]);
        let what =
            format!("line {line}: the length between these corners is already in line {first}");
        return Err(anyhow!(what).context(show()));
    }
    Ok(lengths)
}

/// How a limit is written.
const LIMIT: &str = "expected a length, or a length + L/N such as 0.05mm+L/2000";

/// Parses a limit, such as `0.05mm+L/2000`.
fn limit(text: &str) -> Result<Limit, String> {
    let (constant, per_length) = match text.split_once('+') {
        None => (text, 0.0),
        Some((constant, rest)) => {
            let divisor = rest.trim().strip_prefix(['L', 'l']).map(str::trim_start);
            let divisor =
                divisor.and_then(|rest| rest.strip_prefix('/')?.trim().parse::<f64>().ok());
            let divisor = divisor.filter(|of| of.is_finite() && *of > 0.0);
            (constant, 1.0 / divisor.ok_or(LIMIT)?)
        }
    };
    let constant_mm = parse_length_mm(constant).map_err(|_| LIMIT)?;
    match constant_mm > 0.0 {
        true => Ok(Limit { constant_mm, per_length }),
        false => Err("the limit must be positive".to_owned()),
    }
}

/// Parses a value and its standard deviation, such as `24.5±0.5`; without one, it is exact.
fn measured(text: &str) -> Result<(f64, f64), String> {
    let (value, sd) =
        ["±", "+/-", "+-"].iter().find_map(|sign| text.split_once(sign)).unwrap_or((text, "0"));
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    match (number(value), number(sd)) {
        (Some(value), Some(sd)) if sd >= 0.0 => Ok((value, sd)),
        _ => {
            Err("expected a value, or a value and its standard deviation such as 24.5±0.5"
                .to_owned())
        }
    }
}

/// The label of a corner.
fn corner(found: &Acceptance, label: &CornerLabel) -> String {
    match found.has_panels() {
        true => format!("{}, {} on panel {}", label.row, label.col, label.panel),
        false => format!("{}, {}", label.row, label.col),
    }
}

/// Describes the result, one statement per line.
fn describe(found: &Acceptance) -> String {
    let by_weight = found.by_weight();
    let Some(first) = by_weight.first() else { return String::new() };
    let part = |mm: f64| match mm > 0.0 {
        true => format!("{mm:.*}", places(mm.max(1e-6)).min(6)),
        false => "0".to_owned(),
    };
    let d = places(first.budget.combined_mm().max(1e-6)).min(6);
    let corner = |label: &CornerLabel| corner(found, label);
    let all = found.lengths.len();
    let verdict = match found.verdict() {
        Some(Conformity::Conforms) => format!("conforms: all {all} lengths"),
        Some(Conformity::Fails) => {
            format!("does not conform: {} of {all} lengths", found.count(Conformity::Fails))
        }
        Some(Conformity::Undecided) if found.count(Conformity::Undecided) == 0 => {
            format!("undecided: {} not measured", counted(found.missing().count(), "given length"))
        }
        Some(Conformity::Undecided) => {
            format!("undecided: {} of {all} lengths", found.count(Conformity::Undecided))
        }
        None => counted(all, "length"),
    };
    let (which, limit) = match found.request.limit {
        Some(limit) => {
            let mm = limit.of(first.known_mm);
            ("decisive", format!(", limit {mm:.*} mm", d.max(places(mm)).min(6)))
        }
        None => ("largest", String::new()),
    };
    let ([from, to], budget) = (first.ends.map(|end| corner(&end)), &first.budget);
    let mut text = format!(
        "{verdict}; {which} error {:+.d$} mm, expanded uncertainty {:.d$} mm{limit} (from {from} to {to} in {}, {:.1} mm)\n",
        first.error_mm(),
        budget.expanded_mm(),
        first.frame,
        first.known_mm
    );
    let parts = [
        budget.noise_mm,
        budget.lens_mm,
        budget.calibration_mm,
        budget.target_mm,
        budget.temperature_mm,
    ];
    let [noise, lens, calibration, target, temperature] = parts.map(part);
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "its standard uncertainty: {noise} mm from noise, {lens} from lens and other errors of corners, {calibration} from the \
         calibration, {target} from the target, {temperature} from temperature; k = {:.2}",
        budget.coverage_factor()
    );
    let errors = counted(all, "error");
    let _ = writeln!(
        text,
        "{} of {errors} are within their expanded uncertainty of 95 %",
        found.within()
    );
    let probing = &found.probing;
    let at = probing
        .at
        .as_ref()
        .map_or(String::new(), |(label, frame)| format!(" (corner {} in {frame})", corner(label)));
    let [largest, rms] = [probing.largest_mm, probing.rms_mm].map(part);
    let corners = counted(probing.corners, "corner");
    let _ = writeln!(text, "probing error: {largest} mm{at}; rms {rms} mm of {corners}");
    text
}
