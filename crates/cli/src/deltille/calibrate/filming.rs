//! Photographs and recordings as input of a calibration.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, bail, ensure};

use crate::deltille::files::images::{Images, RecordingArgs, Stems};
use crate::deltille::files::images_at_once;
use crate::interrupt;
use crate::output::log;
use crate::progress::FrameProgress;
use crate::run::{Interrupted, report};
use crate::values::whole;
use deltille::calibrate::{Calibration, Intrinsics, Keyframe, Keyframes, Reference, views};
use deltille::detect::{Detection, Detector, DetectorConfig, InkEstimate, Tracker};
use deltille::frames::{Frame, is_photograph, is_recording, photographs_in};
use deltille::limits::Limits;
use deltille_core::words::counted;

/// Default number of views of a recording: the largest number with which `--model auto` works.
const VIEWS: u32 = 60;

/// Detections before they are compared with a target.
pub struct Given {
    pub detections: Vec<(String, Detection)>,
    /// The file of each detection.
    pub files: Vec<PathBuf>,
    /// The first path on the command line.
    pub first: PathBuf,
}

/// Options for photographs and recordings.
#[derive(clap::Args)]
pub struct FilmArgs {
    #[command(flatten)]
    recording: RecordingArgs,
    /// Maximum number of views: frames in which the target is still, and which together determine the camera best
    /// [default: 60 of recordings, all photographs]
    #[arg(long, value_name = "N", value_parser = whole(1..=100_000u32))]
    views: Option<u32>,
}

/// Whether the inputs are photographs and recordings, not detections.
pub fn are_images(inputs: &[PathBuf]) -> anyhow::Result<bool> {
    let is_image = |path: &PathBuf| match path.is_dir() && !is_recording(path) {
        true => has_only_photographs(path),
        false => is_recording(path) || is_photograph(path),
    };
    let (images, others): (Vec<_>, Vec<_>) = inputs.iter().partition(|path| is_image(path));
    if let ([image, ..], [other, ..]) = (images.as_slice(), others.as_slice()) {
        let [image, other] = [image, other].map(|path| path.display());
        bail!(
            "{image} contains images, and {other} does not: calibrate either with images or with detections"
        );
    }
    Ok(!images.is_empty())
}

/// Whether a folder contains photographs, but no detections.
fn has_only_photographs(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let ends =
        |path: &Path, end: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let has_detections = paths.any(|path| ends(&path, "json") || ends(&path, "parquet"));
    !has_detections && photographs_in(folder).is_ok_and(|photographs| !photographs.is_empty())
}

impl FilmArgs {
    /// Detects the target in all frames, and returns those to calibrate with. Ctrl-C ends the reading, not the calibration.
    pub fn see(
        &self,
        inputs: &[PathBuf],
        reference: &Reference,
        intrinsics: &Intrinsics,
        limits: &Limits,
    ) -> anyhow::Result<Given> {
        let images = Images::of(inputs)?;
        let recordings = images.named().iter().filter(|path| is_recording(path)).count();
        ensure!(
            recordings == 0 || recordings == images.named().len(),
            "photographs and recordings cannot be calibrated together; detect the target in each, then calibrate with all detections"
        );
        let film = Film { args: self, images, limits, detector: detector(reference)? };
        interrupt::keeps_results();
        let (keyframes, inks) = match recordings {
            0 => film.photographs()?,
            _ => film.recordings()?,
        };
        let most = self.views.unwrap_or(if recordings > 0 { VIEWS } else { u32::MAX }) as usize;
        let mut detections = selected(&keyframes, reference, intrinsics, most)?;
        let again = film.detector.with_ink_of(&inks);
        if let Some(detector) = again.filter(|_| !interrupt::has_ended_input()) {
            film.see_again(&detector, &mut detections)?;
        }
        let files = detections.iter().map(|(name, _)| PathBuf::from(name)).collect();
        Ok(Given { detections, files, first: inputs[0].clone() })
    }
}

/// The detector of a target.
fn detector(reference: &Reference) -> anyhow::Result<Detector> {
    let config = DetectorConfig::default();
    if let Reference::Grid(grid) = reference {
        let size = grid.size.map(|[rows, cols]| (rows, cols));
        return Ok(Detector::for_grid(grid.kind, size, config));
    }
    let targets: Vec<_> = reference.targets().iter().collect();
    Detector::for_targets(&targets, config).context("--target")
}

/// Returns the detections of the keyframes to calibrate with.
fn selected(
    keyframes: &[Keyframe],
    reference: &Reference,
    intrinsics: &Intrinsics,
    most: usize,
) -> anyhow::Result<Vec<(String, Detection)>> {
    let all = keyframes.iter().map(|frame| (frame.name.clone(), frame.detection.clone()));
    let mut all: Vec<(String, Detection)> = all.collect();
    if all.len() <= most {
        return Ok(all);
    }
    let motion: BTreeMap<&str, f64> =
        keyframes.iter().map(|frame| (frame.name.as_str(), frame.motion_px)).collect();
    let views = views(&all, reference)?.views;
    let motion_px: Vec<f64> = views.iter().map(|view| motion[view.name.as_str()]).collect();
    let names: Vec<String> = views.iter().map(|view| view.name.clone()).collect();
    let calibration = Calibration::of(reference, reference.panels());
    let calibration = calibration.camera("camera", views, intrinsics.clone());
    let chosen = calibration.informative_views(&motion_px, most);
    let chosen: Vec<&String> = chosen.into_iter().map(|index| &names[index]).collect();
    all.retain(|(name, _)| chosen.contains(&name));
    Ok(all)
}

/// Images to detect a target in.
struct Film<'a> {
    args: &'a FilmArgs,
    images: Images,
    limits: &'a Limits,
    detector: Detector,
}

/// Keyframes, and the ink spread of every frame.
type Seen = (Vec<Keyframe>, Vec<Option<InkEstimate>>);

impl Film<'_> {
    /// Detects the target in one image.
    fn one(
        &self,
        frame: Frame,
        detect: impl FnOnce(&deltille::raster::AnyGray, &str) -> Detection,
    ) -> anyhow::Result<(String, Detection)> {
        let (name, stem, time_ns) = (frame.name(), frame.stem(), frame.time_ns());
        let photograph = frame.read(self.limits, false)?;
        let mut found = detect(&photograph.image, &name);
        (found.file, found.time_ns) = (photograph.notes, time_ns);
        Ok((stem, found))
    }

    /// Follows the target through recordings.
    fn recordings(&self) -> anyhow::Result<Seen> {
        let options = self.args.recording.options(*self.limits);
        let mut tracker = Tracker::new(self.detector.clone());
        let mut keyframes = Keyframes::of_every(options.every);
        let (mut inks, mut errors) = (Vec::new(), Vec::new());
        let (mut stems, mut progress) = (Stems::default(), FrameProgress::new(None));
        for frame in self.images.frames(&options, true) {
            let part = frame.as_ref().ok().and_then(Frame::part);
            if let Ok(frame) = &frame {
                stems.claim_stem(&frame.stem(), frame.path())?;
            }
            let found =
                frame.and_then(|frame| self.one(frame, |image, name| tracker.detect(image, name)));
            match found {
                Ok((stem, found)) => {
                    progress.add(!found.grids.is_empty(), part);
                    inks.push(found.ink);
                    keyframes.add(stem, found);
                }
                Err(error) => errors.push(error),
            }
            if interrupt::is_raised() {
                break;
            }
        }
        progress.end();
        ended(keyframes.finish(), inks, errors)
    }

    /// Detects the target in photographs, several at a time. Those that cannot be read are reported.
    fn photographs(&self) -> anyhow::Result<Seen> {
        let options = self.args.recording.options(*self.limits);
        let mut stems = Stems::default();
        let frames = self.images.frames(&options, true).map(|frame| {
            let frame = frame?;
            stems.claim_stem(&frame.stem(), frame.path())?;
            Ok(frame)
        });
        let progress = Mutex::new(FrameProgress::new(self.images.count()));
        let seen = Mutex::new(BTreeMap::new());
        let threads = rayon::ThreadPoolBuilder::new().build()?;
        images_at_once::for_each(&threads, self.limits, frames, |index, frame| {
            if interrupt::is_raised() {
                return;
            }
            let found = frame
                .and_then(|frame| self.one(frame, |image, name| self.detector.detect(image, name)));
            if let Ok((_, found)) = &found {
                let mut progress = progress.lock().expect("no thread panics here");
                progress.add(!found.grids.is_empty(), None);
            }
            seen.lock().expect("no thread panics here").insert(index, found);
        });
        progress.into_inner().expect("no thread panics here").end();
        let (mut keyframes, mut inks, mut errors) = (Vec::new(), Vec::new(), Vec::new());
        for found in seen.into_inner().expect("no thread panics here").into_values() {
            match found {
                Ok((stem, found)) => {
                    inks.push(found.ink);
                    keyframes.push(Keyframe::alone(stem, found));
                }
                Err(error) => errors.push(error),
            }
        }
        ended(keyframes, inks, errors)
    }

    /// Detects the target in the selected images again, with the joint estimate of the ink.
    fn see_again(
        &self,
        detector: &Detector,
        selected: &mut [(String, Detection)],
    ) -> anyhow::Result<()> {
        let options = self.args.recording.options(*self.limits);
        let mut wanted: BTreeMap<String, &mut Detection> =
            selected.iter_mut().map(|(name, found)| (name.clone(), found)).collect();
        for frame in self.images.frames(&options, false) {
            let Ok(frame) = frame else { continue };
            let Some(found) = wanted.remove(&frame.stem()) else { continue };
            *found = self.one(frame, |image, name| detector.detect(image, name))?.1;
            if wanted.is_empty() {
                break;
            }
        }
        Ok(())
    }
}

/// Reports the errors of single frames, and whether a signal ended the reading. Fails if there is nothing to calibrate with.
fn ended(
    keyframes: Vec<Keyframe>,
    inks: Vec<Option<InkEstimate>>,
    mut errors: Vec<anyhow::Error>,
) -> anyhow::Result<Seen> {
    let frames = counted(inks.len(), "frame");
    if interrupt::is_raised() {
        ensure!(!keyframes.is_empty(), Interrupted(format!("no board found in {frames}")));
        log!("note: interrupted after {frames}; calibrating with these");
    }
    interrupt::end_input();
    ensure!(!keyframes.is_empty() || !errors.is_empty(), "no board of this kind found in {frames}");
    let last = errors.pop();
    errors.iter().for_each(report);
    match last {
        Some(error) if inks.is_empty() => return Err(error),
        last => last.iter().for_each(report),
    }
    Ok((keyframes, inks))
}
