//! `deltille guide`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, SystemTime};

use anyhow::{Context, bail, ensure};

use super::sightings::{self, GridArgs, SheetArgs};
use super::solving::ModelChoice;
use crate::deltille::files::images::photographs_in;
use crate::deltille::files::limits::ImageLimits;
use crate::deltille::files::written::{check_places, sample_of, text_file};
use crate::deltille::files::{camera_file, target_file};
use crate::interrupt;
use crate::output::{self, Overwrite, say, tell};
use crate::run::Interrupted;
use crate::values::distance;
use deltille::calibrate::{
    Calibration, Excluded, Guide, Intrinsics, Model, NextView, PanelPlace, Reference, View, views,
};
use deltille::camera::{Camera, Lens};
use deltille::detect::{Detection, Detector, DetectorConfig};
use deltille::export::kind::Kind;
use deltille::export::sheet::Sheet;
use deltille::export::{next_view, svg};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::photograph;
use deltille::raster::AnyGray;
use deltille::targets::Target;
use deltille_core::words::{counted, shown};

/// How long the folder is left alone between two looks.
const PAUSE: Duration = Duration::from_millis(400);

/// A photograph that cannot be read is given up when it has not changed for so long: programs that write one pause
/// less, and nobody waits longer for an answer.
const GIVEN_UP: Duration = Duration::from_secs(3);

/// Arguments of `deltille guide`.
#[derive(clap::Args)]
pub struct Args {
    /// Folder that another program, such as a camera's, fills with photographs
    folder: PathBuf,
    /// Description of the target: the .json that was written with it, or a .dsc
    #[arg(long, required_unless_present = "grid", value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    grid: GridArgs,
    /// What of the camera is to be found: radtan, radtan5, rational, thin-prism, kannala-brandt …, as for
    /// `deltille calibrate`
    #[arg(long, default_value = "radtan", conflicts_with = "camera")]
    model: ModelChoice,
    /// The camera as it is nearly, to begin with: its file; all its parameters are found anew
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Find how the sheet of the board is bent, too, so that views are chosen for that as well
    #[arg(long, conflicts_with = "shape")]
    board_shape: bool,
    /// Nearest distance at which the board can be held and is in focus, such as 30cm [default: half the
    /// board's diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = distance)]
    nearest: Option<f64>,
    /// Farthest distance, such as 2m [default: none]
    #[arg(long, value_name = "LENGTH", value_parser = distance)]
    farthest: Option<f64>,
    /// End when projections are as sure as this over the whole image, px [default: when the next view would lower
    /// the uncertainty by less than 3 %]
    #[arg(long, value_name = "PX", value_parser = px)]
    until: Option<f64>,
    /// Look at the folder once, and end
    #[arg(long)]
    once: bool,
    /// Write the next view as JSON: pose, outline and corners in px, figures; again after every photograph
    #[arg(short, long, value_name = "FILE.json")]
    output: Option<PathBuf>,
    /// Draw the outline in which to hold the board: an .svg to lay over a live picture, or a .png over the last
    /// photograph
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Use --target even where the camera was calibrated with a board of the same tags at another size
    #[arg(long)]
    assume_target: bool,
    #[command(flatten)]
    sheet: SheetArgs,
    /// Family file, where the target names a family that is not shipped
    #[arg(long)]
    family: Option<String>,
    #[command(flatten)]
    limits: ImageLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// An uncertainty in px.
fn px(text: &str) -> Result<f64, String> {
    let px: Option<f64> = text.parse().ok().filter(|px: &f64| px.is_finite() && *px > 0.0);
    px.ok_or_else(|| "write pixels, more than 0, such as 0.05".to_owned())
}

/// Proposes one view after the other until they are enough.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let mut printing: Printing = match (&args.target, args.grid.read_target()?) {
        (Some(path), _) => target_file::read_placed(path, &limits).context("--target")?,
        (None, Some((_, target))) => target.into(),
        (None, None) => bail!("give --target FILE, or --grid for an untagged board"),
    };
    target_file::set_family(&mut printing.target, args.family.as_deref())?;
    let target = &printing.target;
    ensure!(
        args.folder.is_dir(),
        "{}: is no folder: name the one that fills",
        args.folder.display()
    );
    let reference = Reference::Target(target);
    ensure!(
        !reference.is_loose(),
        "--target: {} are boards that lie about: give the file of one of them",
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
        "--board-shape: is of a single board, and the target has {}",
        counted(target.panels.len(), "panel")
    );
    let places = args.places()?;
    interrupt::stands("what was written last is whole");
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
        told: BTreeSet::new(),
    };
    session.run()
}

impl Args {
    /// What is known of the camera, and the size of its pictures where that is.
    fn intrinsics(&self, near: Option<Camera>) -> anyhow::Result<(Intrinsics, Option<[u32; 2]>)> {
        if let Some(camera) = near {
            ensure!(!matches!(camera.lens, Lens::Spline(_)), "--camera: {NO_SPLINE}");
            let size = [camera.width, camera.height];
            let free = vec![true; camera.parameters().len()];
            return Ok((Intrinsics::Near { camera, free }, Some(size)));
        }
        match self.model {
            ModelChoice::Auto => bail!(
                "--model: auto chooses when the pictures are there: take them by the richest one that may be chosen, \
                 such as rational"
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
        let guide = guide.context("--target: it has no corners: name a board or a solid")?;
        Ok(guide.within_mm(self.nearest, self.farthest))
    }

    /// Where the next view is written, as it was asked for. What would be refused is refused before the first
    /// photograph.
    fn places(&self) -> anyhow::Result<Places> {
        let json = self.output.as_deref().map(|path| output::file(path, "next", "json"));
        let json = json.transpose().context("-o")?;
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
                "--picture: {} would be taken for a photograph: name a file in another folder",
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

/// Why a spline is not guided.
const NO_SPLINE: &str = "a spline needs corners everywhere: take the pictures by kannala-brandt or radtan5, and \
                         calibrate the same pictures by spline";

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Files of the next view.
struct Places {
    json: Option<PathBuf>,
    picture: Option<PathBuf>,
}

/// A file as it was when it was looked at.
#[derive(Clone, Copy, PartialEq)]
struct Stamp {
    bytes: u64,
    changed: Option<SystemTime>,
}

/// A photograph in the folder.
struct Picture {
    stamp: Stamp,
    /// When it was found to be as it is.
    since: SystemTime,
    /// What came of it; `None` as long as it cannot be read, or may still grow.
    seen: Option<Seen>,
}

/// What a photograph showed.
enum Seen {
    /// Nothing that can be used, as was told.
    Nothing,
    /// The target.
    Target(Box<Detection>),
}

/// A folder that is watched, and what is known from it.
struct Watch<'a> {
    args: Args,
    target: &'a Target,
    detector: Detector,
    sheet: Sheet,
    panels: Vec<PanelPlace>,
    intrinsics: Intrinsics,
    limits: Limits,
    places: Places,
    /// From the first photograph on, of the size that most have.
    guide: Option<Guide>,
    pictures: BTreeMap<PathBuf, Picture>,
    /// What was told of views that take no part, as long as they do not.
    told: BTreeSet<String>,
}

impl Watch<'_> {
    fn run(mut self) -> anyhow::Result<ExitCode> {
        let mut is_first = true;
        loop {
            let (changed, last) = self.look()?;
            let waits = self.pictures.values().any(|picture| picture.seen.is_none());
            // A view that may still come is waited for, before others are asked for.
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
        Err(Interrupted(format!("{views} so far; start again to go on with them")).into())
    }

    /// Looks at what is new in the folder; whether that changes anything, and the photograph that was looked at last.
    fn look(&mut self) -> anyhow::Result<(bool, Option<AnyGray>)> {
        let there = photographs_in(&self.args.folder)?;
        let before = self.pictures.len();
        self.pictures.retain(|path, _| there.contains(path));
        let mut changed = self.pictures.len() < before;
        let mut last = None;
        for path in there {
            self.check_interrupt()?;
            // Whatever was taken away meanwhile comes back or does not.
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

    /// What a photograph shows; `None` where it cannot be read yet.
    fn read(
        &self,
        path: &Path,
        since: SystemTime,
        now: SystemTime,
        last: &mut Option<AnyGray>,
    ) -> anyhow::Result<Option<Seen>> {
        let show = name(path);
        let picture = match photograph::read_within(path, &self.limits) {
            Ok(picture) => picture,
            Err(error) => {
                let waited = now.duration_since(since).unwrap_or_default();
                if waited < GIVEN_UP {
                    return Ok(None);
                }
                tell!("error: {error}");
                return Ok(Some(Seen::Nothing));
            }
        };
        let found = self.detector.detect(&picture, &show);
        let labelled = found.grids.iter().filter(|grid| grid.panel.is_some());
        let corners: usize = labelled.map(|grid| grid.corners.len()).sum();
        if corners == 0 {
            let why = found.reasons.first().map_or(String::new(), |why| format!(": {why}"));
            tell!("{show}: no board{why}");
            return Ok(Some(Seen::Nothing));
        }
        say!("{show}: {}", counted(corners, "corner"));
        *last = Some(picture);
        Ok(Some(Seen::Target(Box::new(found))))
    }

    /// Photographs that show the target, with what they show.
    fn detections(&self) -> impl Iterator<Item = (&Path, &Detection)> {
        self.pictures.iter().filter_map(|(path, picture)| match &picture.seen {
            Some(Seen::Target(found)) => Some((path.as_path(), found.as_ref())),
            _ => None,
        })
    }

    /// The views of the photographs that have the guide's size, and why others take no part.
    fn views(&self, size_px: [u32; 2]) -> anyhow::Result<(Vec<View>, Vec<String>)> {
        let [width, height] = size_px;
        let (ours, others): (Vec<_>, Vec<_>) =
            self.detections().partition(|(_, found)| [found.width, found.height] == size_px);
        let mut out: Vec<String> = others
            .into_iter()
            .map(|(path, found)| {
                let (path, w, h) = (name(path), found.width, found.height);
                format!("{path}: left out: it has {w} × {h} pixels, most have {width} × {height}")
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
        out.extend(shown.left_out.iter().map(|(_, left)| told(left)));
        Ok((shown.views, out))
    }

    /// The guide for the size that most photographs have, of two the one that comes first; none before there is one.
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

    /// Tells and writes the next view; whether no more are needed.
    fn propose(&mut self, last: Option<&AnyGray>) -> anyhow::Result<bool> {
        let Some(guide) = self.sized()?.cloned() else {
            say!(
                "next: hold the board in the middle of the picture, facing the camera, so that it fills two thirds; \
                 the size of the first photograph tells the rest"
            );
            return Ok(false);
        };
        let (views, mut out) = self.views(guide.size_px())?;
        let count = views.len();
        let calibration = Calibration::new(self.panels.clone()).board_shape(self.args.board_shape);
        let calibration = calibration.camera("camera", views, self.intrinsics.clone());
        let estimate = calibration.solve();
        if let Ok(estimate) = &estimate {
            out.extend(estimate.excluded.iter().map(told));
        }
        self.tell_once(out);
        let next = guide.next(count, estimate.as_ref().ok());
        let is_enough = next.is_enough(self.args.until);
        let views = counted(count, "view");
        match (&estimate, next.now_px) {
            (Ok(_), Some(now)) => {
                say!("{views}: projections are known to {now:.4} px over the image")
            }
            (Err(error), _) if count >= ENOUGH_TO_TELL => say!("{views}: no camera yet: {error}"),
            _ => say!("{views}: no camera yet"),
        }
        self.write(&next, count, is_enough, last)?;
        if is_enough {
            let folder = shown(&self.args.folder.display().to_string()).into_owned();
            say!("enough: calibrate the photographs of {folder}");
            if count < FEW {
                tell!(
                    "{views} are few: what is known to {} px is so if the model fits, which shows in more",
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

    /// Tells why views take no part, each as long as it takes none once.
    fn tell_once(&mut self, out: Vec<String>) {
        for line in out.iter().filter(|line| !self.told.contains(*line)) {
            tell!("{line}");
        }
        self.told = out.into_iter().collect();
    }

    /// Writes the files that were asked for, each beside its place and renamed.
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

/// From so many views on it is said why there is no camera: before, there are too few.
const ENOUGH_TO_TELL: usize = 3;

/// Fewer views than these hardly tell a model that does not fit from one that does: each has six coordinates of its
/// own, and a wrong model shows in what views disagree about.
const FEW: usize = 8;

fn told(left_out: &Excluded) -> String {
    format!("{}: left out: {}", left_out.view, left_out.reason)
}
