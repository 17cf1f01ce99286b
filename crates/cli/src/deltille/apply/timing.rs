//! `deltille timing`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, ensure};

use crate::deltille::calibrate::rig_cameras::{
    CamerasArgs, Source, follow, named, topic, topic_of_one,
};
use crate::deltille::calibrate::{compensation, sightings};
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, log, report};
use deltille::calibrate::{Estimate, Reference, TimedCamera, timing};
use deltille::export::kind::Kind;
use deltille::export::timing as timing_file;

/// Arguments of `deltille timing`.
#[derive(clap::Args)]
pub struct Args {
    /// The calibrated camera or rig: the .json of `deltille calibrate` or `deltille rig`, or a camera file
    #[arg(value_name = "CAMERA")]
    camera: PathBuf,
    /// A video, an MCAP file or a bag in which the target moves; for a rig, a recording of all cameras. Or detections of all
    /// frames with their time stamps, from `deltille detect --track`
    #[arg(
        required_unless_present = "cameras",
        value_name = "RECORDING",
        conflicts_with = "cameras"
    )]
    recording: Option<PathBuf>,
    /// Camera of the rig and its video, recording or folder of detections, such as left=left.mp4; repeat for each camera
    #[arg(long = "camera", id = "cameras", value_name = "NAME=PATH", value_parser = named)]
    cameras: Vec<(String, PathBuf)>,
    /// Topic of the images in an MCAP file or a bag; for a rig, that of each camera, such as left=/left/image_raw
    #[arg(long, value_name = "[NAME=]TOPIC", value_parser = topic)]
    topic: Vec<(Option<String>, String)>,
    /// Target description: the .json written with the target, or a .dsc
    #[arg(long, value_name = "FILE")]
    target: PathBuf,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    /// Use --target even if the camera was calibrated with a board with the same tags but a different size
    #[arg(long)]
    assume_target: bool,
    /// Write the result
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Estimates when the rows of each camera are exposed.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let path =
        args.output.as_deref().map(|path| output::file(path, "timing", "json")).transpose()?;
    if let Some(path) = &path {
        args.overwrite.check(path, &Kind::of_schema(timing_file::SCHEMA))?;
    }
    let limits = args.limits.limits();
    let mut printing = target_file::read_placed(&args.target, &limits).context("--target")?;
    target_file::set_given_family(std::slice::from_mut(&mut printing), args.family.as_deref())?;
    let known = camera_file::read_estimate("CAMERA", &args.camera)?;
    let targets = std::slice::from_ref(&printing.target);
    camera_file::check_or_note(&args.camera, &known.calibrated_with, targets, args.assume_target)?;
    let sources = args.sources(&known)?;
    let reference = Reference::Target(&printing.target);
    let given = follow(&sources, &reference, &limits)?;
    let mut cameras = Vec::new();
    for (source, given) in sources.iter().zip(given) {
        let of = known.cameras.iter().find(|of| known.cameras.len() == 1 || of.name == source.name);
        let of = of.context("no camera")?;
        let read = sightings::views_of(given, &reference, args.assume_target);
        let read = read.and_then(sightings::shown).with_context(|| source.option.clone())?;
        let times =
            compensation::times_ns(&read.detections).with_context(|| source.option.clone())?;
        let mut views = read.views;
        sightings::take_known(&mut views, &reference);
        let camera = TimedCamera::of(of, views, &times);
        cameras.push(camera.with_context(|| source.option.clone())?);
    }
    let panels: Vec<_> = reference.panels().iter().map(|of| of.target_from_panel).collect();
    let found = timing(&cameras, &panels)?;
    if let Some(path) = &path {
        output::write(path, timing_file::write(&found).as_bytes(), args.overwrite)?;
    }
    found.warnings().iter().for_each(|said| log!("warning: {said}"));
    output::print(&compensation::describe(&found))?;
    if let Some(path) = &path {
        report!("{}", output::wrote(path));
    }
    if interrupt::has_ended_input() {
        return Ok(ExitCode::from(interrupt::exit_code()));
    }
    Ok(ExitCode::SUCCESS)
}

impl Args {
    /// The recording of each camera, in the order of the cameras.
    fn sources(&self, known: &Estimate) -> anyhow::Result<Vec<Source>> {
        let names: Vec<&str> = known.cameras.iter().map(|of| of.name.as_str()).collect();
        let (recording, camera, topic) =
            (self.recording.clone(), self.cameras.clone(), self.topic.clone());
        if let ([_], Some(path)) = (names.as_slice(), &recording) {
            let topic = topic_of_one(&topic)?;
            return Ok(vec![Source::alone(path.clone(), topic)]);
        }
        ensure!(
            names.len() > 1,
            "--camera: {} has one camera; give its recording without --camera",
            self.camera.display()
        );
        let recording = recording.into_iter().collect();
        let of_rig = CamerasArgs { recording, camera, topic, every: 1, views: None };
        let mut sources = of_rig.of_calibrated(&names)?;
        sources.sort_by_key(|source| names.iter().position(|name| *name == source.name));
        Ok(sources)
    }
}
