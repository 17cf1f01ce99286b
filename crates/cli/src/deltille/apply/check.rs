//! `deltille check`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail, ensure};

use crate::deltille::calibrate::sightings::{self, GridArgs, SheetArgs};
use crate::deltille::calibrate::solving::accuracy;
use crate::deltille::files::images::{Images, RecordingArgs};
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::output::{self, Overwrite, log};
use crate::run::{FAILED, UNDECIDED};
use deltille::calibrate::{
    Answer, Calibration, CameraEstimate, Check, Estimate, Model, Quantity, QuantityTest, Reference,
    View, views,
};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::kind::Kind;
use deltille::export::{check, saved};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille_core::words::{counted, p_value, places};

/// Arguments of `deltille check`.
#[derive(clap::Args)]
pub struct Args {
    /// The calibration of the camera: the .json of `deltille calibrate`
    #[arg(value_name = "CAMERA")]
    camera: PathBuf,
    /// New photographs of the target: files, folders, patterns, videos or recordings; or their detections (.json or
    /// .parquet) from `deltille detect`
    #[arg(required = true, value_name = "PHOTOGRAPHS")]
    photographs: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
    /// Target description: the .json written with the target, or a .dsc
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// Use --target even if the camera was calibrated with a board with the same tags but a different size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    /// Standard deviation of the board's corners from their described positions, such as 0.05mm; 0 for an exact board
    /// [default: that of a measured target, otherwise 0.1 mm, at most 0.5 % of an edge]
    #[arg(long, value_name = "LENGTH", value_parser = accuracy)]
    board_accuracy: Option<f64>,
    /// Write the answer with all tests
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Checks a camera. The exit code is 1 if it has changed, and 3 if this cannot be determined.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path =
        args.output.as_deref().map(|path| output::file(path, "check", "json")).transpose()?;
    if let Some(path) = &path {
        args.overwrite.check(path, &Kind::of_schema(check::SCHEMA))?;
    }
    let limits = args.limits.limits();
    let mut printing = match args.grid.read_target()? {
        Some((_, target)) => Printing::from(target),
        None => {
            let path = args.target.as_deref().context("--target FILE is needed")?;
            target_file::read_placed(path, &limits).context("--target")?
        }
    };
    target_file::set_family(&mut printing.target, args.family.as_deref())?;
    let before = args.before(&printing.target)?;
    let reference = Reference::Target(&printing.target);
    let sheet =
        args.sheet.read(&limits, &reference.identities(), std::slice::from_ref(&printing))?;
    let mut views = args.views(&printing.target, &limits)?;
    sightings::take_known(&mut views, &reference);
    sightings::put_on(&sheet, Some(&printing.target), &mut views)?;
    let mut calibration = Calibration::of(&reference, sightings::panels(&reference, &sheet)?);
    if args.board_accuracy.is_some() {
        calibration = calibration.board_accuracy_mm(args.board_accuracy);
    }
    // The check ignores the model.
    let found = calibration.camera("", views, Model::Radtan).check(&before);
    if let Some(path) = &path {
        output::write(path, check::write(&found).as_bytes(), args.overwrite)?;
    }
    output::print(&describe(&found))?;
    Ok(match found.answer {
        Answer::Unchanged => ExitCode::SUCCESS,
        Answer::Changed => ExitCode::from(FAILED),
        _ => ExitCode::from(UNDECIDED),
    })
}

impl Args {
    /// Reads the calibration; a camera file without uncertainties is accepted, because its answer is `cannot tell`.
    fn before(&self, target: &Target) -> anyhow::Result<Estimate> {
        let path = &self.camera;
        let is_json = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json"));
        let mut before = match is_json {
            true => {
                let text = Limits::default().read_text(path).context("CAMERA")?;
                let mut before = saved::read_without_target(&text)
                    .with_context(|| format!("CAMERA: {}", path.display()))?;
                if camera_file::warn_if_failed(path, &text).is_some() {
                    before.cameras.iter_mut().for_each(CameraEstimate::forget_uncertainties);
                }
                before
            }
            false => {
                let file = camera_file::read_with_targets("CAMERA", path)?;
                let mut before = Estimate::default();
                before.cameras = vec![CameraEstimate::given("", file.camera)];
                before.calibrated_with = file.calibrated_with;
                before
            }
        };
        ensure!(
            before.cameras.len() == 1,
            "CAMERA: {} is a rig; check each camera with its own calibration",
            path.display()
        );
        before.cameras[0].name.clear();
        let targets = std::slice::from_ref(target);
        let with = &before.calibrated_with;
        camera_file::check_or_note(path, with, targets, self.assume_target)?;
        Ok(before)
    }

    /// Reads detections, or detects the target in photographs.
    fn views(&self, target: &Target, limits: &Limits) -> anyhow::Result<Vec<View>> {
        let reference = Reference::Target(target);
        if self.photographs.iter().all(|path| is_of_detections(path)) {
            let read =
                sightings::read_any(&self.photographs, &reference, limits, self.assume_target)?;
            if read.views.is_empty() {
                log!("{}", sightings::nothing_shown(&read.detections));
            }
            return Ok(read.views);
        }
        let detector =
            Detector::for_targets(&[target], DetectorConfig::default()).context("--target")?;
        let (mut seen, mut unread): (Vec<(String, Detection)>, usize) = (Vec::new(), 0);
        let options = self.recording.options(*limits);
        for frame in Images::of(&self.photographs)?.frames(&options, true) {
            let frame = frame?;
            let name = frame.name();
            match frame.read(limits, false) {
                Ok(photograph) => {
                    seen.push((name.clone(), detector.detect(&photograph.image, &name)));
                }
                Err(error) => {
                    log!("error: {error}");
                    unread += 1;
                }
            }
        }
        match (seen.is_empty(), unread) {
            (true, 0) => bail!("no images to process"),
            (true, _) => bail!("no image could be read"),
            _ => {}
        }
        let found = views(&seen, &reference)?.views;
        if found.is_empty() {
            log!("{}", sightings::nothing_shown(&seen));
        }
        Ok(found)
    }
}

/// Whether a path is a detection, or a folder with detections.
fn is_of_detections(path: &Path) -> bool {
    let is_one = |path: &Path| {
        path.extension()
            .is_some_and(|end| ["json", "parquet"].iter().any(|own| end.eq_ignore_ascii_case(own)))
    };
    match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().any(|entry| is_one(&entry.path())),
        Err(_) => is_one(path),
    }
}

/// Describes the answer, one statement per line.
fn describe(found: &Check) -> String {
    let names = |of: &[Quantity], between: &str| {
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
            _ => {
                let or: String =
                    found.or.iter().map(|quantity| format!(", or {quantity}")).collect();
                format!("changed: {}{or}: {of}{p}\n", names(&found.changed, " and "))
            }
        },
        _ => found.missing.iter().map(|why| format!("cannot tell: {why}\n")).collect(),
    };
    for test in &found.tests {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}", describe_test(test));
    }
    text
}

fn describe_test(test: &QuantityTest) -> String {
    let unit = test.quantity.unit();
    let digits = places(test.detectable.clamp(1e-6, 1e6)).min(4);
    let far = match test.detectable.is_finite() && test.detectable < 1e6 {
        true => format!("a change of {:.digits$} {unit} would have been found", test.detectable),
        false => "no change would have been found".to_owned(),
    };
    let change = test.change;
    format!("{}: {change:.digits$} {unit} ({}); {far}", test.quantity, p_value(test.p_value))
}
