//! `deltille check`.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::deltille::calibrate::filming::FilmArgs;
use crate::deltille::calibrate::rig::check_own;
use crate::deltille::calibrate::rig_cameras::{check_named, named};
use crate::deltille::calibrate::sightings::{self, GridArgs, SheetArgs};
use crate::deltille::calibrate::solving::accuracy;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, log};
use crate::run::{FAILED, UNDECIDED};
use deltille::calibrate::{
    Answer, Calibration, CameraEstimate, CameraViews, Check, Estimate, Intrinsics, Model,
    QuantityTest, Reference, Suspect,
};
use deltille::export::kind::Kind;
use deltille::export::{check, saved};
use deltille::frames::is_recording;
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille_core::words::{counted, p_value, places};

/// Arguments of `deltille check`.
#[derive(clap::Args)]
pub struct Args {
    /// The calibration of the camera or the rig: the .json of `deltille calibrate` or `deltille rig`
    #[arg(value_name = "CAMERA")]
    camera: PathBuf,
    /// New photographs of the target: files, folders, a video or a recording; or their detections (.json or .parquet) from
    /// `deltille detect`
    #[arg(required_unless_present = "cameras", value_name = "PHOTOGRAPHS")]
    photographs: Vec<PathBuf>,
    /// Camera of the rig and the folder of its photographs or detections, such as left=today/left; repeat for each
    /// camera. Images taken at the same time must have the same file name in each folder
    #[arg(
        long = "camera",
        id = "cameras",
        value_name = "NAME=FOLDER",
        value_parser = named,
        conflicts_with = "photographs"
    )]
    cameras: Vec<(String, PathBuf)>,
    #[command(flatten)]
    film: FilmArgs,
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

/// Checks a camera or a rig. The exit code is 1 if it has changed, and 3 if this cannot be determined.
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
    let mut calibration = Calibration::of(&reference, sightings::panels(&reference, &sheet)?);
    if args.board_accuracy.is_some() {
        calibration = calibration.board_accuracy_mm(args.board_accuracy);
    }
    let mut all = Vec::new();
    for camera in &before.cameras {
        // Only the selection of frames of a recording depends on the model.
        let intrinsics = Intrinsics::Unknown(camera.model.unwrap_or(Model::Radtan));
        let read = args.inputs(&camera.name).map(|inputs| {
            let film = Some((&args.film, &intrinsics));
            sightings::seen(inputs, film, &reference, &limits, args.assume_target)
        });
        let mut views = Vec::new();
        if let Some(read) = read {
            let option = format!("--camera {}", camera.name);
            let read = match args.cameras.is_empty() {
                true => read?,
                false => read.with_context(|| option.clone())?,
            };
            if read.views.is_empty() {
                log!("{}", sightings::nothing_shown(&read.detections));
            }
            check_own(&option, &read.detections, &all)?;
            all.push((&camera.name, read.detections));
            views = read.views;
        }
        sightings::take_known(&mut views, &reference);
        sightings::put_on(&sheet, Some(&printing.target), &mut views)?;
        calibration = calibration.with(CameraViews::new(&camera.name, views, intrinsics));
    }
    let found = calibration.check(&before);
    if let Some(path) = &path {
        output::write(path, check::write(&found).as_bytes(), args.overwrite)?;
    }
    output::print(&describe(&found))?;
    if interrupt::has_ended_input() {
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    Ok(match found.answer {
        Answer::Unchanged => ExitCode::SUCCESS,
        Answer::Changed => ExitCode::from(FAILED),
        _ => ExitCode::from(UNDECIDED),
    })
}

impl Args {
    /// The photographs or detections of a camera; `None` if there are none.
    fn inputs(&self, camera: &str) -> Option<&[PathBuf]> {
        match self.cameras.as_slice() {
            [] => Some(&self.photographs),
            cameras => {
                let of = cameras.iter().find(|(name, _)| name == camera);
                of.map(|(_, folder)| std::slice::from_ref(folder))
            }
        }
    }

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
        let names: Vec<&str> = before.cameras.iter().map(|camera| camera.name.as_str()).collect();
        if self.cameras.is_empty() {
            ensure!(
                names.len() == 1,
                "CAMERA: {} is a rig; give the photographs of each camera with --camera NAME=FOLDER (cameras: {})",
                path.display(),
                names.join(", ")
            );
            before.cameras[0].name.clear();
        } else {
            ensure!(
                names.len() > 1,
                "--camera: {} has one camera; give its photographs without --camera",
                path.display()
            );
            check_named("--camera", &self.cameras, &names)?;
            for (name, path) in &self.cameras {
                ensure!(
                    !is_recording(path),
                    "--camera {name}: frames of recordings are not combined here; run `deltille detect` for each camera, \
                     then give the folders of detections"
                );
            }
        }
        let targets = std::slice::from_ref(target);
        let with = &before.calibrated_with;
        camera_file::check_or_note(path, with, targets, self.assume_target)?;
        Ok(before)
    }
}

/// Describes the answer, one statement per line.
fn describe(found: &Check) -> String {
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
