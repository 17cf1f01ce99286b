//! `deltille guide`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use anyhow::{Context, bail, ensure};

use super::reasons::no_board;
use super::sightings::{self, GridArgs, SheetArgs};
use super::solving::{ModelChoice, projection_uncertainty};
use crate::deltille::files::images::photographs_in;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::written::{check_places, sample_of, text_file};
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, log, report, say};
use crate::run::Interrupted;
use crate::values::distance;
use deltille::calibrate::{
    Calibration, Excluded, Guide, Intrinsics, Model, NextView, PanelPrior, Reference, View, views,
};
use deltille::camera::{Camera, Lens};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::kind::Kind;
use deltille::export::sheet::Sheet;
use deltille::export::{next_view, svg};
use deltille::frames::{Frame, is_recording};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::raster::AnyGray;
use deltille::targets::Target;
use deltille_core::words::{counted, shown};

/// Interval between two passes over the folder.
const PAUSE: Duration = Duration::from_millis(400);

/// Time without changes after which an unreadable photograph is skipped for good. Programs that are
/// still writing a file pause for a shorter time, and a user would not wait longer.
const GIVEN_UP: Duration = Duration::from_secs(3);

/// Arguments of `deltille guide`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder to which another program, such as the camera's software, saves photographs
    folder: PathBuf,
    /// Target description: the .json written with the target, or a .dsc
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// Camera model to calibrate: radtan, radtan5, rational, thin-prism, kannala-brandt …, as in `deltille calibrate`
    #[arg(long, default_value = "radtan", conflicts_with = "camera")]
    model: ModelChoice,
    /// Camera file with initial values; all parameters are estimated again
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Also estimate how the board is bent, and choose views for that
    #[arg(long, conflicts_with = "shape")]
    board_shape: bool,
    /// Shortest distance at which the board is in focus, such as 30cm [default: 10 % less than that of any corner so
    /// far]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = distance)]
    nearest: Option<f64>,
    /// Farthest distance, such as 2m [default: 10 % more than that of any corner so far]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true, value_parser = distance)]
    farthest: Option<f64>,
    /// Stop at this projection uncertainty over the whole image, px [default: when the next view would lower the
    /// uncertainty by less than 3 %]
    #[arg(long, value_name = "PX", value_parser = px)]
    until: Option<f64>,
    /// Read the folder once and exit
    #[arg(long)]
    once: bool,
    /// Write the next view as JSON after every photograph: pose, outline and corners in px, and statistics
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Draw the outline in which to hold the board: an .svg to overlay on a live image, or a .png over the last
    /// photograph
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Use --target even if the camera was calibrated with a board with the same tags but a different size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, if the target uses a family that does not ship with the program
    #[arg(long)]
    family: Option<String>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Parses an uncertainty in px.
fn px(text: &str) -> Result<f64, String> {
    let px: Option<f64> = text.parse().ok().filter(|px: &f64| px.is_finite() && *px > 0.0);
    px.ok_or_else(|| "expected px greater than 0, such as 0.05".to_owned())
}

/// Proposes views one after the other until they suffice.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let mut printing: Printing = match (&args.target, args.grid.read_target()?) {
        (Some(path), _) => target_file::read_placed(path, &limits).context("--target")?,
        (None, Some((_, target))) => target.into(),
        (None, None) => bail!("--target FILE is needed, or --grid for an untagged board"),
    };
    target_file::set_family(&mut printing.target, args.family.as_deref())?;
    let target = &printing.target;
    ensure!(
        !is_recording(&args.folder),
        "{}: guide watches a folder in which photographs are saved; pass this recording to `deltille calibrate`",
        args.folder.display()
    );
    ensure!(
        args.folder.is_dir(),
        "{} is not a folder; expected the folder in which photographs are saved",
        args.folder.display()
    );
    let reference = Reference::Target(target);
    ensure!(
        !reference.is_loose(),
        "--target: the {} are independent boards; use the file of one of them",
        counted(target.panels.len(), "panel")
    );
    let sheet = args.sheet.read(&limits, &[target.identity()], std::slice::from_ref(&printing))?;
    let panels = sightings::panels(&reference, &sheet)?;
    let detector = Detector::for_targets(&[target], DetectorConfig::default());
    let detector = detector.context("--target")?;
    let near = args.camera.as_deref().map(|path| {
        camera_file::read_for("--camera", path, std::slice::from_ref(target), args.assume_target)
    });
    let near = near.transpose()?;
    let (intrinsics, size) = args.intrinsics(near)?;
    if let (Some(nearest), Some(farthest)) = (args.nearest, args.farthest) {
        ensure!(nearest < farthest, "--nearest: must be less than --farthest");
    }
    let board_shape = args.board_shape;
    ensure!(
        !board_shape || target.panels.len() == 1,
        "--board-shape supports a single board, but the target has {}",
        counted(target.panels.len(), "panel")
    );
    let places = args.places()?;
    interrupt::set_status("the most recently written files are complete");
    let session = Watch {
        guide: match size {
            Some(size) => Some(args.guide(target, size, &intrinsics)?),
            None => None,
        },
        args,
        target,
        detector,
        sheet,
        panels,
        intrinsics,
        limits,
        places,
        pictures: BTreeMap::new(),
        reported: BTreeSet::new(),
    };
    session.run()
}

impl Args {
    /// Returns the intrinsics to calibrate, and the image size if known.
    fn intrinsics(&self, near: Option<Camera>) -> anyhow::Result<(Intrinsics, Option<[u32; 2]>)> {
        if let Some(camera) = near {
            ensure!(!matches!(camera.lens, Lens::Spline(_)), "--camera: {NO_SPLINE}");
            let size = [camera.width, camera.height];
            let free = vec![true; camera.parameters().len()];
            return Ok((Intrinsics::Near { camera, free }, Some(size)));
        }
        match self.model {
            ModelChoice::Auto => bail!(
                "--model: auto needs the complete set of images; use the candidate model with the most \
                 parameters, such as rational, for the guide"
            ),
            ModelChoice::Model(Model::Spline { .. }) => bail!("--model: {NO_SPLINE}"),
            ModelChoice::Model(model) => Ok((model.into(), None)),
        }
    }

    fn guide(
        &self,
        target: &Target,
        size: [u32; 2],
        intrinsics: &Intrinsics,
    ) -> anyhow::Result<Guide> {
        let guide = Guide::new(target, size, intrinsics.clone());
        let guide = guide.context("--target has no corners; use a board or a solid")?;
        Ok(guide.within_mm(self.nearest, self.farthest))
    }

    /// Returns the paths of the next view. Rejects unusable paths before the first photograph.
    fn places(&self) -> anyhow::Result<Places> {
        let json = self.output.as_deref().map(|path| output::file(path, "next", "json"));
        let json = json.transpose()?;
        let picture = self.picture.clone();
        if let Some(path) = &picture {
            let end = path.extension().map(|end| end.to_string_lossy().to_lowercase());
            let is_png = match end.as_deref() {
                Some("svg") => false,
                Some("png") => true,
                _ => bail!("--picture: {} must end in .svg or .png", path.display()),
            };
            let folder = output::folder_of(path);
            let is_watched = folder.canonicalize().ok() == self.folder.canonicalize().ok();
            ensure!(
                !(is_png && is_watched),
                "--picture: {} would be read as a photograph; use another folder",
                path.display()
            );
            output::check_writable("--picture", path)?;
            let kind = if is_png { Kind::own_png() } else { Kind::of(svg::HEAD.as_bytes()) };
            self.overwrite.check(path, &kind).context("--picture")?;
        }
        if let Some(path) = &json {
            output::check_writable("-o", path)?;
            let sample = [text_file(name(path), sample_of(next_view::SCHEMA))];
            check_places(output::folder_of(path), &sample, self.overwrite)?;
        }
        Ok(Places { json, picture })
    }
}

/// Why splines are not supported.
const NO_SPLINE: &str = "a spline needs corners everywhere: take the images with kannala-brandt or radtan5, then \
                         calibrate them with spline";

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Output files of the next view.
struct Places {
    json: Option<PathBuf>,
    picture: Option<PathBuf>,
}

/// State of a file when it was last read.
#[derive(Clone, Copy, PartialEq)]
struct Stamp {
    bytes: u64,
    changed: Option<SystemTime>,
}

/// A photograph in the folder.
struct Picture {
    stamp: Stamp,
    /// When this state was first seen.
    since: SystemTime,
    /// Result of the photograph; `None` while it cannot be read, or may still grow.
    seen: Option<Seen>,
}

/// Content of a photograph.
enum Seen {
    /// Nothing usable; already reported.
    Nothing,
    /// The target.
    Target(Box<Detection>),
}

/// A watched folder, and the results from it.
struct Watch<'a> {
    args: Args,
    target: &'a Target,
    detector: Detector,
    sheet: Sheet,
    panels: Vec<PanelPrior>,
    intrinsics: Intrinsics,
    limits: Limits,
    places: Places,
    /// Set with the first photograph, for the most frequent image size.
    guide: Option<Guide>,
    pictures: BTreeMap<PathBuf, Picture>,
    /// Reported reasons of excluded views, while they remain excluded.
    reported: BTreeSet<String>,
}

impl Watch<'_> {
    fn run(mut self) -> anyhow::Result<ExitCode> {
        let mut is_first = true;
        if !self.args.once {
            log!(
                "waiting for photographs in {}; stop with Ctrl-C, or use --once to read the folder once",
                self.args.folder.display()
            );
        }
        loop {
            let (changed, last) = self.observe()?;
            let waits = self.pictures.values().any(|picture| picture.seen.is_none());
            // Waits for pending photographs before proposing a view.
            if (changed || is_first) && !(self.args.once && waits) {
                is_first = false;
                if self.propose(last.as_ref())? {
                    return Ok(ExitCode::SUCCESS);
                }
            }
            if self.args.once && !waits {
                let is_none_of_use =
                    !self.pictures.is_empty() && self.detections().next().is_none();
                return Ok(if is_none_of_use { ExitCode::FAILURE } else { ExitCode::SUCCESS });
            }
            std::thread::sleep(PAUSE);
            self.check_interrupt()?;
        }
    }

    fn check_interrupt(&self) -> anyhow::Result<()> {
        if !interrupt::is_raised() {
            return Ok(());
        }
        let views = counted(self.detections().count(), "view");
        Err(Interrupted(format!("{views} so far; run the command again to continue")).into())
    }

    /// Reads new files in the folder. Returns whether anything changed, and the last photograph read.
    fn observe(&mut self) -> anyhow::Result<(bool, Option<AnyGray>)> {
        let there = photographs_in(&self.args.folder)?;
        let before = self.pictures.len();
        self.pictures.retain(|path, _| there.contains(path));
        let mut changed = self.pictures.len() < before;
        let mut last = None;
        for path in there {
            self.check_interrupt()?;
            // A file that has disappeared in the meantime may reappear.
            let Ok(about) = path.metadata() else { continue };
            let stamp = Stamp { bytes: about.len(), changed: about.modified().ok() };
            let now = SystemTime::now();
            let known = self.pictures.get(&path).filter(|known| known.stamp == stamp);
            if known.is_some_and(|known| known.seen.is_some()) {
                continue;
            }
            let since = known.map_or(now, |known| known.since);
            let seen = self.read(&path, since, now, &mut last)?;
            changed |= seen.is_some();
            self.pictures.insert(path, Picture { stamp, since, seen });
        }
        Ok((changed, last))
    }

    /// Detects the target in a photograph; `None` if it cannot be read yet.
    fn read(
        &self,
        path: &Path,
        since: SystemTime,
        now: SystemTime,
        last: &mut Option<AnyGray>,
    ) -> anyhow::Result<Option<Seen>> {
        let show = name(path);
        let picture = match Frame::photograph(path.to_owned()).read(&self.limits, false) {
            Ok(photograph) => photograph.image,
            Err(error) => {
                let waited = now.duration_since(since).unwrap_or_default();
                if waited < GIVEN_UP {
                    return Ok(None);
                }
                log!("error: {error}");
                return Ok(Some(Seen::Nothing));
            }
        };
        let found = self.detector.detect(&picture, &show);
        let labelled = found.grids.iter().filter(|grid| grid.panel.is_some());
        let corners: usize = labelled.map(|grid| grid.corners.len()).sum();
        if corners == 0 {
            log!("{show}: {}", no_board(found.reasons.first()));
            return Ok(Some(Seen::Nothing));
        }
        report!("{show}: {}", counted(corners, "corner"));
        *last = Some(picture);
        Ok(Some(Seen::Target(Box::new(found))))
    }

    /// Iterates over the photographs that show the target, with their detections.
    fn detections(&self) -> impl Iterator<Item = (&Path, &Detection)> {
        self.pictures.iter().filter_map(|(path, picture)| match &picture.seen {
            Some(Seen::Target(found)) => Some((path.as_path(), found.as_ref())),
            _ => None,
        })
    }

    /// Returns the views with the guide's image size, and the reasons why others are excluded.
    fn views(&self, size_px: [u32; 2]) -> anyhow::Result<(Vec<View>, Vec<String>)> {
        let [width, height] = size_px;
        let (ours, others): (Vec<_>, Vec<_>) =
            self.detections().partition(|(_, found)| [found.width, found.height] == size_px);
        let mut out: Vec<String> = others
            .into_iter()
            .map(|(path, found)| {
                let (path, w, h) = (name(path), found.width, found.height);
                format!("{path}: excluded: it has {w} × {h} pixels, but most images have {width} × {height}")
            })
            .collect();
        let named = ours.into_iter().map(|(path, found)| {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            (stem.into_owned(), found.clone())
        });
        let mut shown = match views(&named.collect::<Vec<_>>(), &Reference::Target(self.target)) {
            Ok(shown) => shown,
            Err(error) => {
                out.push(error.to_string());
                return Ok((Vec::new(), out));
            }
        };
        sightings::put_on(&self.sheet, Some(self.target), &mut shown.views)?;
        out.extend(shown.excluded.iter().map(|(_, left)| excluded_line(left)));
        Ok((shown.views, out))
    }

    /// Returns the guide for the most frequent image size (in a tie, the first one seen), or `None` before the first
    /// photograph.
    fn sized(&mut self) -> anyhow::Result<Option<&Guide>> {
        if self.args.camera.is_none() {
            let sizes: Vec<[u32; 2]> =
                self.detections().map(|(_, found)| [found.width, found.height]).collect();
            let count = |size: &[u32; 2]| sizes.iter().filter(|other| *other == size).count();
            let most = sizes.iter().rev().copied().max_by_key(count);
            if let Some(size) = most
                && self.guide.as_ref().map(Guide::size_px) != Some(size)
            {
                self.guide = Some(self.args.guide(self.target, size, &self.intrinsics)?);
            }
        }
        Ok(self.guide.as_ref())
    }

    /// Prints and writes the next view. Returns whether no more views are needed.
    fn propose(&mut self, last: Option<&AnyGray>) -> anyhow::Result<bool> {
        let Some(guide) = self.sized()?.cloned() else {
            say!(
                "next: hold the board in the middle of the image, facing the camera, so that it fills two thirds; \
                 the first photograph determines the image size"
            );
            return Ok(false);
        };
        let (views, mut out) = self.views(guide.size_px())?;
        let count = views.len();
        let calibration = Calibration::new(self.panels.clone()).board_shape(self.args.board_shape);
        let calibration = calibration.camera("camera", views, self.intrinsics.clone());
        let estimate = calibration.solve();
        if let Ok(estimate) = &estimate {
            out.extend(estimate.excluded.iter().map(excluded_line));
        }
        self.report_once(out);
        let next = guide.next(count, estimate.as_ref().ok());
        let is_enough = next.is_enough(self.args.until);
        let views = counted(count, "view");
        match (&estimate, next.now_px) {
            (Ok(estimate), Some(now)) => {
                say!(
                    "{views}: projection uncertainty (1σ) over the whole image: {now:.4} px from noise"
                );
                if let Some(line) = estimate.cameras.first().and_then(projection_uncertainty) {
                    say!("{views}: {line}, where corners were seen");
                }
            }
            (Err(error), _) if count >= ENOUGH_TO_TELL => {
                say!("{views}: not calibrated yet: {error}")
            }
            _ => say!("{views}: not calibrated yet"),
        }
        self.write(&next, count, is_enough, last)?;
        if is_enough {
            let folder = shown(&self.args.folder.display().to_string()).into_owned();
            say!("done: calibrate with the photographs in {folder}");
            if count < FEW {
                log!(
                    "{views} are too few to test the model: the uncertainty of {} px assumes that the model fits; take more views to verify this",
                    next.now_px.map_or(String::new(), |now| format!("{now:.4}"))
                );
            }
            return Ok(true);
        }
        let expected =
            next.expected_px.map_or(String::new(), |px| format!(": {px:.4} px expected"));
        say!("next: {next}{expected}");
        Ok(false)
    }

    /// Prints why views are excluded, once for as long as they remain excluded.
    fn report_once(&mut self, out: Vec<String>) {
        for line in out.iter().filter(|line| !self.reported.contains(*line)) {
            log!("{line}");
        }
        self.reported = out.into_iter().collect();
    }

    /// Writes the requested files, each to a temporary path that is then renamed.
    fn write(
        &self,
        next: &NextView,
        views: usize,
        is_enough: bool,
        last: Option<&AnyGray>,
    ) -> anyhow::Result<()> {
        if let Some(path) = &self.places.json {
            let text = next_view::write(next, &self.target.name, views, is_enough);
            output::write(path, text.as_bytes(), self.args.overwrite).context("-o")?;
        }
        if let Some(path) = &self.places.picture {
            let is_png = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
            let bytes = match is_png {
                true => next_view::png(next, is_enough, last).context("--picture")?,
                false => next_view::svg(next, is_enough).into_bytes(),
            };
            output::write(path, &bytes, self.args.overwrite).context("--picture")?;
        }
        Ok(())
    }
}

/// Minimum number of views at which a failed calibration is reported with its cause: with fewer
/// views, a failure is expected.
const ENOUGH_TO_TELL: usize = 3;

/// Number of views below which an unsuitable model is hard to detect: each view has its own six
/// pose parameters, and a wrong model causes inconsistencies between views.
const FEW: usize = 8;

fn excluded_line(left_out: &Excluded) -> String {
    format!("{}: excluded: {}", left_out.view, left_out.reason)
}
