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
    /// Camera file of `deltille calibrate`, ROS or OpenCV
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
    let limits = args.limits.limits();
    let printed = match args.grid.read_target()? {
        Some((_, target)) => vec![target.into()],
        None => target_file::read_all_placed(&args.target, &limits).context("--target")?,
    };
    let mut targets: Vec<Target> = printed.iter().map(|one| one.target.clone()).collect();
    target_file::set_families(&mut targets, args.family.as_deref())?;
    let sheet = args.sheet.read(&limits, &Reference::Scene(&targets).identities(), &printed)?;
    if let [_, _, ..] = targets.as_slice() {
        // Rejects sheet options that apply to a single sheet.
        sightings::panels(&Reference::Scene(&targets), &sheet)?;
    }
    let each: Vec<&Target> = targets.iter().collect();
    let detector = Detector::for_targets(&each, DetectorConfig::default()).context("--target")?;
    let camera = camera_file::read_for("--camera", &args.camera, &targets, args.assume_target)?;
    for target in &targets {
        if let Some(ambiguity) = Reference::Target(target).label_ambiguity() {
            log!("note: {}: {ambiguity}", target.name);
        }
    }
    let finder = Finder { detector, camera, targets, sheet, limits };
    let (path, format) = match &args.output {
        Some(path) => {
            let path = output::file_of(path, "poses", &["ndjson", "csv"])?;
            let ending = path.extension().unwrap_or_default().to_string_lossy();
            let format = PoseFormat::of_extension(&ending).context("-o: no format of poses")?;
            let kind = match format {
                PoseFormat::Csv => Kind::of(format.head().as_bytes()),
                PoseFormat::JsonLines => Kind::of_schema(pose::SCHEMA),
            };
            args.overwrite.check(&path, &kind)?;
            (Some(path), format)
        }
        None => (None, PoseFormat::JsonLines),
    };
    let (mut lines, mut all, mut without, mut unread) = (format.head(), 0, 0, 0);
    let images = Images::of(&args.images)?;
    let options = args.recording.options(limits, &images)?;
    interrupt::keeps_results();
    for frame in images.frames(&options, true) {
        if interrupt::is_raised() {
            break;
        }
        let frame = frame?;
        all += 1;
        let (name, image) = (frame.name(), frame.path().to_owned());
        let time_ns = frame.time_ns();
        let mut of_image = String::new();
        match finder.find(frame, &name)? {
            Seen::Unread(why) => {
                log!("error: {why}");
                (without, unread) = (without + 1, unread + 1);
                for target in finder.targets.iter().filter(|_| args.all_images) {
                    of_image += &(format.line_without(&name, time_ns, &target.name, &why) + "\n");
                }
            }
            Seen::Targets(found) => {
                let is_there = found.iter().any(Result::is_ok);
                without += usize::from(!is_there);
                for (target, found) in finder.targets.iter().zip(found) {
                    match found {
                        Ok(found) => {
                            let views = found.cameras.iter().flat_map(|camera| &camera.views);
                            let line = |view| format.line(&found, view, time_ns, target) + "\n";
                            of_image += &views.map(line).collect::<String>();
                        }
                        Err(why) => {
                            // With several targets, an image need not show all of them.
                            if !is_there {
                                log!("{}: {}{why}", image.display(), finder.of_target(target));
                            }
                            if args.all_images {
                                let line = format.line_without(&name, time_ns, &target.name, &why);
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
    let found = all - without;
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
    Ok(if without > 0 { ExitCode::from(FAILED) } else { ExitCode::SUCCESS })
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

impl Finder {
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
