//! `deltille check`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::deltille::calibrate::filming::FilmArgs;
use crate::deltille::calibrate::rig::check_own;
use crate::deltille::calibrate::rig_cameras::{CamerasArgs, Source, named, topic, topic_of_one};
use crate::deltille::calibrate::sightings::{self, GridArgs, SheetArgs};
use crate::deltille::calibrate::solving::accuracy;
use crate::deltille::files::images::RecordingArgs;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, log};
use crate::run::{FAILED, UNDECIDED};
use crate::values::whole;
use deltille::calibrate::{
    Answer, Calibration, CameraEstimate, CameraViews, Check, Estimate, Intrinsics, Missing, Model,
    QuantityTest, Reference, Suspect,
};
use deltille::export::check;
use deltille::export::kind::Kind;
use deltille::frames::is_bag;
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
    /// `deltille detect`. For a rig, a recording of all cameras
    #[arg(required_unless_present = "cameras", value_name = "PHOTOGRAPHS")]
    photographs: Vec<PathBuf>,
    /// Camera of the rig and its video, recording, folder of photographs or folder of detections, such as left=today/left;
    /// repeat for each camera. Photographs and detections of the same time must have the same file name in each folder
    #[arg(
        long = "camera",
        id = "cameras",
        value_name = "NAME=PATH",
        value_parser = named,
        conflicts_with = "photographs"
    )]
    cameras: Vec<(String, PathBuf)>,
    /// Topic of the images in an MCAP file or a bag; for a rig, that of each camera, such as left=/left/image_raw
    #[arg(long, value_name = "[NAME=]TOPIC", value_parser = topic)]
    topic: Vec<(Option<String>, String)>,
    /// Read only every N-th frame of recordings; for a rig, every N-th set of simultaneous frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=1_000_000u64))]
    every: u64,
    /// Maximum number of views [default: 60 of recordings, all photographs]
    #[arg(long, value_name = "N", value_parser = whole(1..=100_000u32))]
    views: Option<u32>,
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
    if let [missing] = calibration.check(&before).missing.as_slice()
        && !matches!(missing, Missing::Views { .. })
    {
        log!("note: only the image size can be checked: {missing}");
    }
    let mut seen = args.seen(&before, &reference, &limits)?;
    let mut all = Vec::new();
    for camera in &before.cameras {
        let mut views = Vec::new();
        if let Some(OfCamera { option, read }) = seen.remove(&camera.name) {
            if read.views.is_empty() {
                log!("{}", sightings::nothing_shown(&read.detections));
            }
            check_own(&option, &read.detections, &all)?;
            all.push((&camera.name, read.detections));
            views = read.views;
        }
        sightings::take_known(&mut views, &reference);
        sightings::put_on(&sheet, Some(&printing.target), &mut views)?;
        calibration = calibration.with(CameraViews::new(&camera.name, views, of_model(camera)));
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

/// The new views of a camera.
struct OfCamera {
    /// The option that names them, for messages.
    option: String,
    read: sightings::Read,
}

/// The unknown intrinsics of a camera: only the selection of frames of a recording depends on the model.
fn of_model(camera: &CameraEstimate) -> Intrinsics {
    Intrinsics::Unknown(camera.model.unwrap_or(Model::Radtan))
}

impl Args {
    /// Reads the new views of each camera that has some.
    fn seen(
        &self,
        before: &Estimate,
        reference: &Reference,
        limits: &Limits,
    ) -> anyhow::Result<BTreeMap<String, OfCamera>> {
        let Self { photographs, cameras, topic, every, views, .. } = self;
        let (every, views, assume) = (*every, *views, self.assume_target);
        if let [camera] = before.cameras.as_slice() {
            let topic = topic_of_one(topic)?;
            let film = FilmArgs { recording: RecordingArgs { topic, every }, views };
            let read =
                sightings::seen(photographs, &film, &of_model(camera), reference, limits, assume)?;
            let only = OfCamera { option: "PHOTOGRAPHS".to_owned(), read };
            return Ok([(camera.name.clone(), only)].into());
        }
        let (recording, camera) = (photographs.first().cloned(), cameras.clone());
        let of_rig = CamerasArgs { recording, camera, topic: topic.clone(), every, views };
        let names: Vec<&str> = before.cameras.iter().map(|camera| camera.name.as_str()).collect();
        let sources = of_rig.of_calibrated(&names)?;
        let of = |source: &Source| {
            let camera = before.cameras.iter().find(|camera| camera.name == source.name);
            camera.map_or(Intrinsics::Unknown(Model::Radtan), of_model)
        };
        let intrinsics: Vec<Intrinsics> = sources.iter().map(of).collect();
        let given = of_rig.read(&sources, reference, &intrinsics, limits)?;
        let read = sources.into_iter().zip(given).map(|(Source { name, option, .. }, given)| {
            let read = sightings::views_of(given, reference, assume);
            let read = read.with_context(|| option.clone())?;
            Ok((name, OfCamera { option, read }))
        });
        read.collect()
    }

    /// Reads the calibration; a camera file without uncertainties is accepted, because its answer is `cannot tell`.
    fn before(&self, target: &Target) -> anyhow::Result<Estimate> {
        let path = &self.camera;
        let mut before = camera_file::read_estimate("CAMERA", path)?;
        let names: Vec<&str> = before.cameras.iter().map(|camera| camera.name.as_str()).collect();
        match (self.cameras.is_empty(), self.photographs.as_slice()) {
            (false, _) => ensure!(
                names.len() > 1,
                "--camera: {} has one camera; give its photographs without --camera",
                path.display()
            ),
            (true, [recording]) if is_bag(recording) => {}
            (true, _) => ensure!(
                names.len() == 1,
                "CAMERA: {} is a rig; give an MCAP file or a bag with --topic for each camera, or the images of each camera with \
                 --camera NAME=PATH (cameras: {})",
                path.display(),
                names.join(", ")
            ),
        }
        if let [camera] = before.cameras.as_mut_slice() {
            camera.name.clear();
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
