//! `deltille pose`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};

use crate::deltille::calibrate::sightings;
use crate::deltille::calibrate::sightings::{GridArgs, SheetArgs};
use crate::deltille::files::images::Images;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::output::{self, Overwrite, say, tell};
use crate::run::FAILED;
use deltille::calibrate::{Calibration, Diagnosis, Estimate, Reference, Words, views};
use deltille::camera::Camera;
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::kind::Kind;
use deltille::export::pose;
use deltille::export::sheet::Sheet;
use deltille::limits::Limits;
use deltille::photograph;
use deltille::targets::Target;

/// Arguments of `deltille pose`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs: files, folders, patterns, or - for a list on standard input
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    /// Description of the target: the .json that was written with it, or a .dsc; may be given for each of several
    /// targets
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Vec<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// The camera, as `deltille calibrate`, ROS or OpenCV write it
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// Use --target even where the camera was calibrated with a board of the same tags at another size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, where the target names a family that is not shipped
    #[arg(long)]
    family: Option<String>,
    /// Write a line for every picture, and of several targets for each: where there is no pose, camera_from_target is null, and reason says why
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
    let printed = match args.grid.read_target()? {
        Some((_, target)) => vec![target.into()],
        None => target_file::read_all_placed(&args.target, &limits).context("--target")?,
    };
    let mut targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
    target_file::set_families(&mut targets, args.family.as_deref())?;
    let sheet = args.sheet.read(&limits, &Reference::Scene(&targets).identities(), &printed)?;
    if let [_, _, ..] = targets.as_slice() {
        // Refuses what is known of one sheet alone.
        sightings::panels(&Reference::Scene(&targets), &sheet)?;
    }
    let each: Vec<&Target> = targets.iter().collect();
    let detector = Detector::for_targets(&each, DetectorConfig::default()).context("--target")?;
    let camera = camera_file::read_for("--camera", &args.camera, &targets, args.assume_target)?;
    for target in &targets {
        if let Some(ambiguity) = Reference::Target(target).label_ambiguity() {
            tell!("note: {}: {ambiguity}", target.name);
        }
    }
    let finder = Finder { detector, camera, targets, sheet, limits };
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
        let mut of_image = String::new();
        match finder.find(&image, &name)? {
            Seen::Unread(why) => {
                tell!("error: {why}");
                (without, unread) = (without + 1, unread + 1);
                for target in finder.targets.iter().filter(|_| args.every_picture) {
                    of_image += &(pose::write_none(&name, &target.name, &why) + "\n");
                }
            }
            Seen::Targets(found) => {
                let is_there = found.iter().any(Result::is_ok);
                without += usize::from(!is_there);
                for (target, found) in finder.targets.iter().zip(found) {
                    match found {
                        Ok(found) => {
                            let views = found.cameras.iter().flat_map(|camera| &camera.views);
                            let line = |view| pose::write_line(&found, view, target) + "\n";
                            of_image += &views.map(line).collect::<String>();
                        }
                        Err(why) => {
                            // Of several targets a picture need not show all.
                            if !is_there {
                                tell!("{}: {}{why}", image.display(), finder.of_target(target));
                            }
                            if args.every_picture {
                                let line = pose::write_none(&name, &target.name, &why);
                                of_image += &(line + "\n");
                            }
                        }
                    }
                }
            }
        }
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

/// Finds targets in pictures of a known camera.
struct Finder {
    detector: Detector,
    camera: Camera,
    targets: Vec<Target>,
    sheet: Sheet,
    limits: Limits,
}

/// What a picture shows.
enum Seen {
    /// Of each target its pose, or why there is none.
    Targets(Vec<Result<Estimate, String>>),
    /// The picture cannot be read, and why.
    Unread(String),
}

impl Finder {
    /// What a sentence about a target begins with where there are several.
    fn of_target(&self, target: &Target) -> String {
        match self.targets.len() {
            1 => String::new(),
            _ => format!("{}: ", target.name),
        }
    }

    fn find(&self, image: &Path, name: &str) -> anyhow::Result<Seen> {
        let picture = match photograph::read_within(image, &self.limits) {
            Ok(picture) => picture,
            Err(error) => return Ok(Seen::Unread(error.to_string())),
        };
        let seen = [(name.to_owned(), self.detector.detect(&picture, name))];
        let found = self.targets.iter().map(|target| self.pose(target, &seen, image));
        Ok(Seen::Targets(found.collect::<anyhow::Result<_>>()?))
    }

    /// The pose of a target in a picture, or why there is none.
    fn pose(
        &self,
        target: &Target,
        seen: &[(String, Detection)],
        image: &Path,
    ) -> anyhow::Result<Result<Estimate, String>> {
        let reference = Reference::Target(target);
        let mut views = views(seen, &reference)?.views;
        sightings::put_on(&self.sheet, Some(target), &mut views)?;
        let panels = sightings::panels(&reference, &self.sheet)?;
        let calibration = Calibration::new(panels).camera("", views, self.camera.clone());
        let found = calibration.located(&seen[0].1).with_context(|| image.display().to_string())?;
        let Ok(found) = found else { return Ok(found) };
        let (words, said) = (Words::new(&found, None), found.diagnose());
        // Where the lens ends is the camera's, and the same for every picture.
        for diagnosis in said.iter().filter(|said| !matches!(said, Diagnosis::LensEnds { .. })) {
            let of_target = self.of_target(target);
            tell!("{}: {of_target}{}", image.display(), words.sentence(diagnosis));
        }
        Ok(Ok(found))
    }
}
