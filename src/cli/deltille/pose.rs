//! `deltille pose`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};

use super::images::Images;
use super::limits::ImageLimits;
use super::sightings::SheetArgs;
use super::{camera_file, sightings, target_file};
use crate::calibrate::{Calibration, Diagnosis, Estimate, PanelPlace, Reference, Words, views};
use crate::camera::Camera;
use crate::cli::output::{self, Overwrite, say, tell};
use crate::cli::run::FAILED;
use crate::cli::wording::in_options;
use crate::detect::{Detector, DetectorConfig};
use crate::export::calibration::Sheet;
use crate::export::kind::Kind;
use crate::export::pose;
use crate::limits::Limits;
use crate::photograph;
use crate::targets::Target;

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
    /// Write a line for every picture: where there is no pose, camera_from_target is null, and reason says why
    #[arg(long)]
    every_picture: bool,
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
    let sheet = args.sheet.read(&limits)?;
    let panels = sightings::panels(&Reference::Target(&target), &sheet)?;
    let finder = Finder {
        detector: Detector::for_target(&target, family.as_ref(), DetectorConfig::default()),
        camera: camera_file::read("--camera", &args.camera)?,
        target: &target,
        sheet,
        panels,
        limits,
    };
    let path =
        args.output.as_ref().map(|path| output::file(path, "poses", "ndjson")).transpose()?;
    if let Some(path) = &path {
        args.overwrite.check(path, &Kind::of_schema(pose::SCHEMA))?;
    }
    let (mut lines, mut all, mut without, mut unread) = (String::new(), 0, 0, 0);
    for image in Images::of(&args.images)?.iter() {
        let image = image?;
        all += 1;
        let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let of_image = match finder.find(&image, &name)? {
            Found::Pose(found) => {
                let views = found.cameras.iter().flat_map(|camera| &camera.views);
                views.map(|view| pose::write_line(&found, view, &target.name) + "\n").collect()
            }
            Found::Nothing { why, is_unread } => {
                match is_unread {
                    true => tell!("error: {why}"),
                    false => tell!("{}: {why}", image.display()),
                }
                (without, unread) = (without + 1, unread + usize::from(is_unread));
                match args.every_picture {
                    true => pose::write_none(&name, &target.name, &in_options(&why)) + "\n",
                    false => String::new(),
                }
            }
        };
        match path {
            Some(_) => lines += &of_image,
            None => output::print(&of_image)?,
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

/// Finds a target in pictures of a known camera.
struct Finder<'a> {
    detector: Detector,
    camera: Camera,
    target: &'a Target,
    sheet: Sheet,
    panels: Vec<PanelPlace>,
    limits: Limits,
}

/// What was found in a picture.
enum Found {
    Pose(Box<Estimate>),
    Nothing { why: String, is_unread: bool },
}

impl Finder<'_> {
    fn find(&self, image: &Path, name: &str) -> anyhow::Result<Found> {
        let picture = match photograph::read_within(image, &self.limits) {
            Ok(picture) => picture,
            Err(error) => return Ok(Found::Nothing { why: error.to_string(), is_unread: true }),
        };
        let seen = self.detector.detect(&picture, name);
        let reason = seen.reasons.first().map(|reason| reason.to_string());
        let shown = views(&[(name.to_owned(), seen)], &Reference::Target(self.target));
        let mut views = shown?.views;
        sightings::put_on(&self.sheet, Some(self.target), &mut views)?;
        let calibration =
            Calibration::new(self.panels.iter().copied()).camera("", views, self.camera.clone());
        let found = calibration.solve().with_context(|| image.display().to_string())?;
        let words = Words::new(&found, None);
        let said = found.inspect();
        let foreign = said.iter().find(|said| matches!(said, Diagnosis::ForeignCamera { .. }));
        let why = match foreign {
            Some(foreign) => Some(words.sentence(foreign)),
            None if found.frames.is_empty() => {
                let excluded = found.excluded.first().map(|out| out.reason.to_string());
                Some(excluded.or(reason).unwrap_or_else(|| "no target in it".to_owned()))
            }
            None => None,
        };
        if let Some(why) = why {
            return Ok(Found::Nothing { why, is_unread: false });
        }
        // Where the lens ends is the camera's, and the same for every picture.
        for diagnosis in said.iter().filter(|said| !matches!(said, Diagnosis::LensEnds { .. })) {
            tell!("{}: {}", image.display(), words.sentence(diagnosis));
        }
        Ok(Found::Pose(Box::new(found)))
    }
}
