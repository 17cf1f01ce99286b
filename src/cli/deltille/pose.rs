//! `deltille pose`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::images::Images;
use super::limits::ImageLimits;
use super::sightings::SheetArgs;
use super::{camera_file, sightings, target_file};
use crate::calibrate::{Calibration, Diagnosis, Reference, Words, views};
use crate::cli::output::{self, Overwrite, say, tell};
use crate::cli::run::FAILED;
use crate::detect::{Detector, DetectorConfig};
use crate::export::pose;
use crate::photograph;

/// Arguments of `deltille pose`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs: files, folders, patterns, or - for a list on standard input
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    /// Description of the target: the .json that was written with it, or a .dsc
    #[arg(long, value_name = "FILE")]
    target: PathBuf,
    /// The camera, as `deltille calibrate`, ROS or OpenCV write it
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, where the target names a family that is not shipped
    #[arg(long)]
    family: Option<String>,
    /// Write the lines to a file instead of standard output
    #[arg(short, long, value_name = "FILE.ndjson")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Finds the target in each image and says where it is, a line of JSON each.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let target = target_file::read(&args.target, &limits).context("--target")?;
    let family = target_file::family(&target, args.family.as_deref())?;
    let camera = camera_file::read("--camera", &args.camera)?;
    let detector = Detector::for_target(&target, family.as_ref(), DetectorConfig::default());
    let reference = Reference::Target(&target);
    let sheet = args.sheet.read(&limits)?;
    let scale = sightings::solid_scale(&sheet, &target)?;
    let mut panels = reference.panels();
    panels.iter_mut().for_each(|panel| panel.target_from_panel.translation *= scale);
    let path =
        args.output.as_ref().map(|path| output::file(path, "poses", "ndjson")).transpose()?;
    let (mut lines, mut all, mut without, mut unread) = (String::new(), 0, 0, 0);
    for image in Images::of(&args.images)?.iter() {
        let image = image?;
        all += 1;
        let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let picture = match photograph::read_within(&image, &limits) {
            Ok(picture) => picture,
            Err(error) => {
                tell!("error: {error}");
                (without, unread) = (without + 1, unread + 1);
                continue;
            }
        };
        let seen = detector.detect(&picture, &name);
        let reason = seen.reasons.first().map(|reason| reason.to_string());
        let mut shown = views(&[(name, seen)], &reference)?.views;
        sightings::put_on(&sheet, Some(&target), &mut shown)?;
        let calibration = Calibration::new(panels.clone()).camera("", shown, camera.clone());
        let found = calibration.solve().with_context(|| image.display().to_string())?;
        if found.frames.is_empty() {
            without += 1;
            let why = found.excluded.first().map(|out| out.reason.to_string()).or(reason);
            let why = why.as_deref().unwrap_or("no target in it");
            tell!("{}: {why}", image.display());
        }
        let words = Words { estimate: &found, print_scale: None };
        let said = calibration.inspect(&found);
        // Where the lens ends is the camera's, and the same for every picture.
        let is_of_picture = |said: &&Diagnosis| !matches!(said, Diagnosis::LensEnds { .. });
        if let Some(foreign) =
            said.iter().find(|said| matches!(said, Diagnosis::ForeignCamera { .. }))
        {
            tell!("{}: {}", image.display(), words.sentence(foreign));
            without += 1;
            continue;
        }
        for diagnosis in said.iter().filter(is_of_picture) {
            tell!("{}: {}", image.display(), words.sentence(diagnosis));
        }
        for view in found.cameras.iter().flat_map(|camera| &camera.views) {
            let line = pose::write_line(&found, view, &target.name);
            match path {
                Some(_) => lines += &(line + "\n"),
                None => output::print(&(line + "\n"))?,
            }
        }
    }
    if all == 0 {
        bail!("there is no image");
    }
    if unread == all {
        bail!("no image could be read");
    }
    if let Some(path) = &path {
        output::write(path, lines.as_bytes(), args.overwrite)?;
        say!("{}: {} of {all} images show the target", path.display(), all - without);
    }
    Ok(if without > 0 { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}
