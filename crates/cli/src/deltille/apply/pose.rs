//! `deltille pose`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};

use crate::deltille::calibrate::sightings;
use crate::deltille::calibrate::sightings::{GridArgs, SheetArgs};
use crate::deltille::files::images::{Images, RecordingArgs};
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, log, say};
use crate::run::{FAILED, Interrupted};
use deltille::calibrate::{Calibration, Diagnosis, Estimate, Messages, Reference, views};
use deltille::camera::Camera;
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::kind::Kind;
use deltille::export::pose::{self, PoseFormat};
use deltille::export::sheet::Sheet;
use deltille::frames::Frame;
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille_core::words::counted;

/// Arguments of `deltille pose`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs, videos, MCAP files and bags: files, folders, patterns, or - for a list on standard input
    #[arg(required = true, value_name = "IMAGES")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
    /// Target description: the .json written with the target, or a .dsc; repeatable for several targets
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Vec<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// Camera file of `deltille calibrate`, OpenCV, ROS, Kalibr (FILE:cam0), COLMAP (FILE:1) or mrcal
    #[arg(long, value_name = "FILE")]
    camera: PathBuf,
    /// Use --target even if the camera was calibrated with a board with the same tags but a different size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    /// Write a line for every image and target; without a pose, `camera_from_target` is null and
    /// `reason` says why
    #[arg(long, alias = "every-picture")]
    all_images: bool,
    /// Write to a file instead of standard output: lines of JSON, or a .csv
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Detects the target in each image and writes its pose as a line of JSON or CSV.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let finder = args.finder()?;
    let (path, format) = args.file()?;
    let (mut lines, mut all, mut found, mut unread) = (format.head(), 0, 0, 0);
    let images = Images::of(&args.images)?;
    let options = args.recording.options(finder.limits, &images)?;
    interrupt::keeps_results();
    for frame in images.frames(&options, true) {
        if interrupt::is_raised() {
            break;
        }
        let (seen, of_image) = finder.lines(frame?, format, args.all_images)?;
        all += 1;
        found += usize::from(seen.is_there());
        unread += usize::from(matches!(seen, Seen::Unread(_)));
        match path {
            Some(_) => lines += &of_image,
            None => output::print(&of_image)?,
        }
    }
    if interrupt::is_raised() && found == 0 {
        return Err(Interrupted(format!("target found in 0 of {}", counted(all, "image"))).into());
    }
    if all == 0 {
        bail!("no images to process");
    }
    if unread == all {
        bail!("no image could be read");
    }
    if let Some(path) = &path {
        output::write(path, lines.as_bytes(), args.overwrite)?;
        say!("{}: target found in {found} of {}", path.display(), counted(all, "image"));
    }
    if interrupt::is_raised() {
        return Err(Interrupted(format!("poses of the first {}", counted(all, "image"))).into());
    }
    Ok(if found < all { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
}

impl Args {
    /// Reads the targets, the sheet and the camera.
    fn finder(&self) -> anyhow::Result<Finder> {
        let limits = self.limits.limits();
        let (printed, _) = self.grid.or_targets(&self.target, &limits)?;
        let mut targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
        target_file::set_families(&mut targets, self.family.as_deref())?;
        let scene = Reference::Scene(&targets);
        let sheet = self.sheet.read(&limits, &scene.identities(), &printed)?;
        if targets.len() > 1 {
            // Rejects sheet options that apply to a single sheet.
            sightings::panels(&scene, &sheet)?;
        }
        let each: Vec<&Target> = targets.iter().collect();
        let detector = Detector::for_targets(&each, DetectorConfig::default());
        let detector = detector.context("--target")?;
        let camera = camera_file::read_for("--camera", &self.camera, &targets, self.assume_target)?;
        for target in &targets {
            if let Some(ambiguity) = Reference::Target(target).label_ambiguity() {
                log!("note: {}: {ambiguity}", target.name);
            }
        }
        Ok(Finder { detector, camera, targets, sheet, limits })
    }

    /// Returns the output file, if there is one, and its format.
    fn file(&self) -> anyhow::Result<(Option<PathBuf>, PoseFormat)> {
        let Some(path) = &self.output else { return Ok((None, PoseFormat::JsonLines)) };
        let path = output::file_of(path, "poses", &["ndjson", "csv"])?;
        let ending = path.extension().unwrap_or_default().to_string_lossy();
        let format = PoseFormat::of_extension(&ending).context("-o: no format of poses")?;
        let kind = match format {
            PoseFormat::Csv => Kind::of(format.head().as_bytes()),
            PoseFormat::JsonLines => Kind::of_schema(pose::SCHEMA),
        };
        self.overwrite.check(&path, &kind)?;
        Ok((Some(path), format))
    }
}

/// Finds targets in images of a known camera.
struct Finder {
    detector: Detector,
    camera: Camera,
    targets: Vec<Target>,
    sheet: Sheet,
    limits: Limits,
}

/// Result of one image.
enum Seen {
    /// The pose of each target, or the reason why there is none.
    Targets(Vec<Result<Estimate, String>>),
    /// The image could not be read, with the reason.
    Unread(String),
}

impl Seen {
    /// Whether any target was found.
    fn is_there(&self) -> bool {
        matches!(self, Self::Targets(found) if found.iter().any(Result::is_ok))
    }
}

impl Finder {
    /// Returns the result of an image and its lines; with `all_images`, also lines of targets without a pose. Reports why
    /// there are none.
    fn lines(
        &self,
        frame: Frame,
        format: PoseFormat,
        all_images: bool,
    ) -> anyhow::Result<(Seen, String)> {
        let (name, image, time_ns) = (frame.name(), frame.path().to_owned(), frame.time_ns());
        let without = |target: &Target, why: &str| match all_images {
            true => format.line_without(&name, time_ns, &target.name, why) + "\n",
            false => String::new(),
        };
        let seen = self.find(frame, &name)?;
        let mut lines = String::new();
        match &seen {
            Seen::Unread(why) => {
                log!("error: {why}");
                lines.extend(self.targets.iter().map(|target| without(target, why)));
            }
            Seen::Targets(found) => {
                for (target, found) in self.targets.iter().zip(found) {
                    match found {
                        Ok(found) => {
                            let views = found.cameras.iter().flat_map(|camera| &camera.views);
                            let line = |view| format.line(found, view, time_ns, target) + "\n";
                            lines.extend(views.map(line));
                        }
                        Err(why) => {
                            // With several targets, an image need not show all of them.
                            if !seen.is_there() {
                                log!("{}: {}{why}", image.display(), self.of_target(target));
                            }
                            lines += &without(target, why);
                        }
                    }
                }
            }
        }
        Ok((seen, lines))
    }

    /// Prefix of messages about a target, if there are several.
    fn of_target(&self, target: &Target) -> String {
        match self.targets.len() {
            1 => String::new(),
            _ => format!("{}: ", target.name),
        }
    }

    fn find(&self, frame: Frame, name: &str) -> anyhow::Result<Seen> {
        let image = frame.path().to_owned();
        let picture = match frame.read(&self.limits, false) {
            Ok(photograph) => photograph.image,
            Err(error) => return Ok(Seen::Unread(error.to_string())),
        };
        let seen = [(name.to_owned(), self.detector.detect(&picture, name))];
        let found = self.targets.iter().map(|target| self.pose(target, &seen, &image));
        Ok(Seen::Targets(found.collect::<anyhow::Result<_>>()?))
    }

    /// Computes the pose of a target in an image, or returns the reason why there is none.
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
        let (words, said) = (Messages::new(&found, None), found.diagnose());
        // The limit of the lens is a property of the camera, equal for all images.
        for diagnosis in
            said.iter().filter(|said| !matches!(said, Diagnosis::NonMonotonicLens { .. }))
        {
            let of_target = self.of_target(target);
            log!("{}: {of_target}{}", image.display(), words.sentence(diagnosis));
        }
        Ok(Ok(found))
    }
}
