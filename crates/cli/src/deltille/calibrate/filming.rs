//! Photographs and recordings of one camera or of several as input of a calibration.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, anyhow, bail, ensure};
use rayon::prelude::*;

use super::reasons::Reasons;
use crate::deltille::files::images::{Images, RecordingArgs, Stems};
use crate::deltille::files::images_at_once;
use crate::interrupt;
use crate::output::log;
use crate::progress::FrameProgress;
use crate::run::{Interrupted, message};
use crate::values::whole;
use deltille::calibrate::{
    Calibration, CameraViews, Intrinsics, Keyframe, Keyframes, Reference, views,
};
use deltille::detect::{Detection, Detector, DetectorConfig, InkEstimate, Tracker};
use deltille::export::detection;
use deltille::export::kind::Kind;
use deltille::frames::{
    Frame, FrameOptions, FrameSets, interval_ns, is_photograph, is_recording, photographs_in,
    unread_in,
};
use deltille::limits::Limits;
use deltille_core::words::counted;

/// Default number of views of a recording: the largest number with which `--model auto` works.
pub const VIEWS: u32 = 60;

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
    pub recording: RecordingArgs,
    /// Maximum number of views: frames in which the target is still, and which together determine the camera best
    /// [default: 60 of recordings, all photographs]
    #[arg(long, value_name = "N", value_parser = whole(1..=100_000u32))]
    pub views: Option<u32>,
}

/// Whether the inputs are photographs and recordings, not detections.
pub fn are_images(inputs: &[PathBuf]) -> anyhow::Result<bool> {
    let is_image = |path: &PathBuf| match path.is_dir() && !is_recording(path) {
        true => has_only_images(path),
        false => is_recording(path) || is_photograph(path),
    };
    let (images, others): (Vec<_>, Vec<_>) = inputs.iter().partition(|path| is_image(path));
    if let ([image, ..], [other, ..]) = (images.as_slice(), others.as_slice()) {
        ensure!(other.exists(), "{}: no such file or folder", other.display());
        let [image, other] = [image, other].map(|path| path.display());
        bail!("{image} contains images, and {other} does not: give either images or detections");
    }
    Ok(!images.is_empty())
}

/// Whether a folder contains photographs or recordings, but no detections.
fn has_only_images(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let ends =
        |path: &Path, end: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
    let mut paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let has_detections =
        paths.any(|path| ends(&path, "json") && is_detection(&path) || ends(&path, "parquet"));
    let images = [photographs_in(folder), unread_in(folder)].into_iter().flatten().flatten();
    !has_detections && images.count() > 0
}

/// Whether a JSON file contains a detection, and not, for example, the ground truth of a rendered photograph.
fn is_detection(path: &Path) -> bool {
    // A file that cannot be read is reported later.
    let content = Limits::default().read(path);
    content.map_or(true, |content| Kind::of(&content) == Kind::of_schema(detection::SCHEMA))
}

/// Rejects options that were given, and do not apply to detections.
pub fn check_none<const N: usize>(given: [(&str, bool); N]) -> anyhow::Result<()> {
    match given.iter().find(|(_, is_given)| *is_given) {
        Some((option, _)) => {
            bail!(
                "{option}: the inputs are detections; omit {option}, or give their photographs or recordings"
            )
        }
        None => Ok(()),
    }
}

impl FilmArgs {
    /// Rejects the options, for detections.
    pub fn check_none(&self) -> anyhow::Result<()> {
        let RecordingArgs { topic, every } = &self.recording;
        let views = self.views.is_some();
        check_none([("--topic", topic.is_some()), ("--every", *every > 1), ("--views", views)])
    }

    /// Detects the target in all frames of a camera, and returns those to use.
    pub fn see(
        &self,
        inputs: &[PathBuf],
        reference: &Reference,
        intrinsics: &Intrinsics,
        limits: &Limits,
    ) -> anyhow::Result<Given> {
        let images = Images::of(inputs)?;
        let options = self.recording.options(*limits, &images)?;
        let camera = FilmCamera { name: "", images, options, intrinsics };
        let film = Film { cameras: vec![camera], every: 1, views: self.views, limits };
        let detections = film.see(reference)?.remove(0);
        Ok(Given::of_images(detections, &inputs[0]))
    }

    /// Follows the target through all frames of a recording, for `--estimate-timing`.
    pub fn follow(
        &self,
        inputs: &[PathBuf],
        reference: &Reference,
        intrinsics: &Intrinsics,
        limits: &Limits,
    ) -> anyhow::Result<Given> {
        if let Some(other) = inputs.iter().find(|path| !is_recording(path)) {
            bail!(
                "{}: photographs have no time stamps; give a video or a recording",
                other.display()
            );
        }
        let [recording] = inputs else {
            bail!("the time stamps of several recordings cannot be compared; give one");
        };
        let images = Images::of(inputs)?;
        let options = self.recording.options(*limits, &images)?;
        let camera = FilmCamera { name: "", images, options, intrinsics };
        let film = Film { cameras: vec![camera], every: 1, views: None, limits };
        Ok(Given::of_images(film.follow(reference)?.remove(0), recording))
    }
}

impl Given {
    /// Detections in images.
    pub fn of_images(detections: Vec<(String, Detection)>, first: &Path) -> Self {
        let files = detections.iter().map(|(name, _)| PathBuf::from(name)).collect();
        Self { detections, files, first: first.to_owned() }
    }
}

/// Images to detect a target in, of one camera or of several.
pub struct Film<'a> {
    pub cameras: Vec<FilmCamera<'a>>,
    /// Of frames of several cameras, every n-th is used.
    pub every: u64,
    /// Maximum number of frames to calibrate with.
    pub views: Option<u32>,
    pub limits: &'a Limits,
}

/// The images of a camera.
pub struct FilmCamera<'a> {
    /// Name in messages; empty for a single camera.
    pub name: &'a str,
    pub images: Images,
    pub options: FrameOptions,
    pub intrinsics: &'a Intrinsics,
}

/// What was seen in all images.
#[derive(Default)]
struct Seen {
    keyframes: Vec<Keyframe>,
    /// The ink spread of every image that could be read.
    inks: Vec<Option<InkEstimate>>,
    errors: Vec<anyhow::Error>,
    /// Why images show no labels.
    reasons: Reasons,
}

impl Film<'_> {
    /// Detects the target in all images, and returns the detections of each camera to calibrate with. Ctrl-C ends the
    /// reading, not the calibration.
    pub fn see(&self, reference: &Reference) -> anyhow::Result<Vec<Vec<(String, Detection)>>> {
        let named = || self.cameras.iter().flat_map(|camera| camera.images.named());
        let recordings = named().filter(|path| is_recording(path)).count();
        ensure!(
            recordings == 0 || recordings == named().count(),
            "photographs and recordings cannot be mixed; detect the target in each, then give all detections"
        );
        let detector = detector(reference)?;
        interrupt::keeps_results();
        let Seen { keyframes, inks, .. } = match recordings {
            0 => self.photographs(&detector)?,
            _ => self.recordings(&detector)?,
        }
        .ended()?;
        let most = self.views.or((recordings > 0).then_some(VIEWS));
        let mut selected = self.selected(keyframes, reference, most)?;
        let again = detector.with_ink_of(&inks);
        if let Some(detector) = again.filter(|_| !interrupt::has_ended_input()) {
            for (camera, selected) in self.cameras.iter().zip(&mut selected) {
                self.see_again(camera, &detector, selected)?;
            }
        }
        Ok(selected)
    }

    /// Follows the target through recordings. Frames of several cameras are combined by their time stamps.
    fn recordings(&self, detector: &Detector) -> anyhow::Result<Seen> {
        let is_rig = self.cameras.len() > 1;
        let tolerance_ns = if is_rig { self.tolerance_ns()? } else { 0 };
        let every = self.cameras[0].options.every.max(1) * self.every;
        let mut trackers = vec![Tracker::new(detector.clone()); self.cameras.len()];
        let mut stems: Vec<Stems> = self.cameras.iter().map(|_| Stems::default()).collect();
        let (mut seen, mut keyframes) = (Seen::default(), Keyframes::of_every(every));
        let (mut progress, mut together) = (FrameProgress::new(None), Together::new(self));
        let frames = self.cameras.iter().map(|camera| {
            let frames = camera.images.frames(&camera.options, true);
            Box::new(frames) as Box<dyn Iterator<Item = _> + Send>
        });
        for set in FrameSets::new(frames, tolerance_ns) {
            if interrupt::is_raised() {
                break;
            }
            let mut frames = Vec::new();
            for (frame, stems) in set.into_iter().zip(&mut stems) {
                let frame = match frame.transpose() {
                    Ok(frame) => frame,
                    Err(error) => {
                        seen.errors.push(error);
                        None
                    }
                };
                if let Some(frame) = &frame {
                    stems.claim_stem(&frame.stem(), frame.path())?;
                }
                frames.push(frame);
            }
            let Some(first) = frames.iter().flatten().next() else { continue };
            let (part, mut name) = (first.part(), first.stem());
            if is_rig {
                let Some(number) = together.add(&frames) else { continue };
                if !number.is_multiple_of(self.every) {
                    continue;
                }
                name = format!("set-{number:06}");
            }
            let found = frames.into_par_iter().zip(&mut trackers).map(|(frame, tracker)| {
                frame.map(|frame| self.one(frame, |image, name| tracker.detect(image, name)))
            });
            let found: Vec<Option<anyhow::Result<Detection>>> = found.collect();
            let found: Vec<Option<Detection>> = found.into_iter().map(|one| seen.of(one)).collect();
            let shows_target = |found: &Detection| found.reasons.is_empty();
            progress.add(found.iter().flatten().any(shows_target), part);
            keyframes.add(name, found);
        }
        progress.end();
        together.report(tolerance_ns)?;
        Ok(Seen { keyframes: keyframes.finish(), ..seen })
    }

    /// Follows the target through all images of each camera, and returns the detections of all images that show it, corrected
    /// for the joint estimate of the ink. Ctrl-C ends the reading.
    pub fn follow(&self, reference: &Reference) -> anyhow::Result<Vec<Vec<(String, Detection)>>> {
        let detector = detector(reference)?;
        interrupt::keeps_results();
        let mut found = self.followed(&detector)?;
        if interrupt::is_raised() {
            log!("note: interrupted; using the frames so far");
        }
        interrupt::end_input();
        let inks = found.iter().flatten().map(|(_, one)| one.ink).collect::<Vec<_>>();
        let again = detector.with_ink_of(&inks);
        if let Some(detector) = again.filter(|_| !interrupt::has_ended_input()) {
            found = self.followed(&detector)?;
        }
        for of_camera in &mut found {
            let shows = |(_, one): &(String, Detection)| !one.grids.is_empty();
            // If none shows the target, the reasons are reported.
            if of_camera.iter().any(shows) {
                of_camera.retain(shows);
            }
        }
        Ok(found)
    }

    fn followed(&self, detector: &Detector) -> anyhow::Result<Vec<Vec<(String, Detection)>>> {
        let progress = Mutex::new(FrameProgress::new(None));
        let of_camera = |camera: &FilmCamera| {
            let (mut tracker, mut found) = (Tracker::new(detector.clone()), Vec::new());
            for frame in camera.images.frames(&camera.options, true) {
                if interrupt::is_raised() {
                    break;
                }
                let frame = frame?;
                let (stem, part) = (frame.stem(), frame.part());
                let one = self.one(frame, |image, name| tracker.detect(image, name))?;
                let mut progress = progress.lock().expect("no thread panics here");
                progress.add(one.reasons.is_empty(), part);
                found.push((stem, one));
            }
            Ok(found)
        };
        let found = self.cameras.par_iter().map(of_camera).collect();
        progress.into_inner().expect("no thread panics here").end();
        found
    }

    /// Half of the shortest interval between frames: within it, no frame has two possible partners.
    fn tolerance_ns(&self) -> anyhow::Result<i64> {
        let intervals = self.cameras.iter().map(|camera| {
            // An error is reported when the frames are read.
            interval_ns(camera.images.frames(&camera.options, false)).ok_or_else(|| {
                let why = camera.images.frames(&camera.options, false).find_map(Result::err);
                let none =
                    || anyhow!("no time stamps, by which frames of several cameras are combined");
                why.unwrap_or_else(none).context(format!("--camera {}", camera.name))
            })
        });
        let intervals = intervals.collect::<anyhow::Result<Vec<i64>>>()?;
        Ok(intervals.into_iter().min().unwrap_or(0) / 2)
    }

    /// Detects the target in photographs, several at a time. Photographs of several cameras are combined by their names.
    /// Those that cannot be read are reported.
    fn photographs(&self, detector: &Detector) -> anyhow::Result<Seen> {
        let counts = self.cameras.iter().map(|camera| camera.images.count());
        let progress = Mutex::new(FrameProgress::new(counts.sum()));
        let threads = rayon::ThreadPoolBuilder::new().build()?;
        let (mut seen, mut frames) = (Seen::default(), HashMap::new());
        for (index, camera) in self.cameras.iter().enumerate() {
            let mut stems = Stems::default();
            let images = camera.images.frames(&camera.options, true).map(|frame| {
                let frame = frame?;
                stems.claim_stem(&frame.stem(), frame.path())?;
                Ok(frame)
            });
            let found = Mutex::new(BTreeMap::new());
            images_at_once::for_each(&threads, self.limits, images, |index, frame| {
                if interrupt::is_raised() {
                    return;
                }
                let stem = frame.as_ref().map_or(String::new(), Frame::stem);
                let one = frame
                    .and_then(|frame| self.one(frame, |image, name| detector.detect(image, name)));
                if let Ok(found) = &one {
                    let mut progress = progress.lock().expect("no thread panics here");
                    progress.add(found.reasons.is_empty(), None);
                }
                found.lock().expect("no thread panics here").insert(index, (stem, one));
            });
            for (stem, one) in found.into_inner().expect("no thread panics here").into_values() {
                let Some(one) = seen.of(Some(one)) else { continue };
                let frame = *frames.entry(stem.clone()).or_insert_with(|| {
                    let none = vec![None; self.cameras.len()];
                    seen.keyframes.push(Keyframe::at_rest(stem, none));
                    seen.keyframes.len() - 1
                });
                seen.keyframes[frame].detections[index] = Some(one);
            }
        }
        progress.into_inner().expect("no thread panics here").end();
        Ok(seen)
    }

    /// Detects the target in one image.
    fn one(
        &self,
        frame: Frame,
        detect: impl FnOnce(&deltille::raster::AnyGray, &str) -> Detection,
    ) -> anyhow::Result<Detection> {
        let (name, time_ns) = (frame.name(), frame.time_ns());
        let photograph = frame.read(self.limits, false)?;
        let mut found = detect(&photograph.image, &name);
        (found.file, found.time_ns) = (photograph.notes, time_ns);
        Ok(found)
    }

    /// Returns the detections of each camera in the keyframes to calibrate with; all keyframes without a limit.
    fn selected(
        &self,
        keyframes: Vec<Keyframe>,
        reference: &Reference,
        most: Option<u32>,
    ) -> anyhow::Result<Vec<Vec<(String, Detection)>>> {
        let motion_px: BTreeMap<String, f64> =
            keyframes.iter().map(|frame| (frame.name.clone(), frame.motion_px)).collect();
        let mut cameras = vec![Vec::new(); self.cameras.len()];
        for Keyframe { name, detections, .. } in keyframes {
            for (of_camera, found) in cameras.iter_mut().zip(detections) {
                of_camera.extend(found.map(|found| (name.clone(), found)));
            }
        }
        let Some(most) = most else { return Ok(cameras) };
        let mut calibration = Calibration::of(reference, reference.panels());
        for (camera, detections) in self.cameras.iter().zip(&cameras) {
            let mut views = views(detections, reference)?.views;
            if self.cameras.len() > 1 {
                // A rig cannot use the others, see `take_known`.
                views.retain(|view| reference.labels_are_of_board(view));
            }
            let intrinsics = camera.intrinsics.clone();
            calibration = calibration.with(CameraViews::new(camera.name, views, intrinsics));
        }
        let chosen = calibration.informative_frames(&motion_px, most as usize);
        for of_camera in &mut cameras {
            of_camera.retain(|(name, _)| chosen.contains(name));
        }
        Ok(cameras)
    }

    /// Detects the target in the selected images again, with the joint estimate of the ink.
    fn see_again(
        &self,
        camera: &FilmCamera,
        detector: &Detector,
        selected: &mut [(String, Detection)],
    ) -> anyhow::Result<()> {
        let mut wanted: BTreeMap<String, &mut Detection> =
            selected.iter_mut().map(|(_, found)| (found.image.clone(), found)).collect();
        for frame in camera.images.frames(&camera.options, false) {
            let Ok(frame) = frame else { continue };
            let Some(found) = wanted.remove(&frame.name()) else { continue };
            *found = self.one(frame, |image, name| detector.detect(image, name))?;
            if wanted.is_empty() {
                break;
            }
        }
        Ok(())
    }
}

impl Seen {
    /// Records the result of an image, and returns the detection.
    fn of(&mut self, found: Option<anyhow::Result<Detection>>) -> Option<Detection> {
        match found? {
            Ok(found) => {
                self.reasons.add(&found);
                self.inks.push(found.ink);
                Some(found)
            }
            Err(error) => {
                self.errors.push(error);
                None
            }
        }
    }

    /// Reports the errors of single frames, and whether a signal ended the reading. Fails if there is nothing to calibrate
    /// with.
    fn ended(mut self) -> anyhow::Result<Self> {
        let is_empty = self.keyframes.is_empty();
        let frames = counted(self.inks.len(), "frame");
        if interrupt::is_raised() {
            ensure!(!is_empty, Interrupted(format!("no board found in {frames}")));
            log!("note: interrupted after {frames}; using these");
        }
        interrupt::end_input();
        ensure!(!is_empty || !self.errors.is_empty(), self.reasons.nothing_shown(&frames));
        let last = self.errors.pop();
        let excluded = |error: &anyhow::Error| log!("warning: excluded: {}", message(error));
        self.errors.iter().for_each(excluded);
        match last {
            Some(error) if self.inks.is_empty() => return Err(error),
            last => last.iter().for_each(excluded),
        }
        Ok(self)
    }
}

/// Statistics of the frames of several cameras.
struct Together<'a> {
    names: Vec<&'a str>,
    /// Frames of each camera without one of another camera at the same time.
    alone: Vec<usize>,
    /// First and last time stamp of each camera, ns.
    times: Vec<Option<[i64; 2]>>,
    sets: u64,
    /// Largest difference of time stamps within a set, ns.
    largest_ns: i64,
}

impl<'a> Together<'a> {
    fn new(film: &Film<'a>) -> Self {
        let names: Vec<&str> = film.cameras.iter().map(|camera| camera.name).collect();
        let count = names.len();
        Self { names, alone: vec![0; count], times: vec![None; count], sets: 0, largest_ns: 0 }
    }

    /// Counts frames of the same time, and returns the number of their set; `None` if there is only one frame.
    fn add(&mut self, frames: &[Option<Frame>]) -> Option<u64> {
        let stamps = frames.iter().map(|frame| frame.as_ref().and_then(Frame::time_ns));
        let stamps: Vec<Option<i64>> = stamps.collect();
        for (times, stamp) in self.times.iter_mut().zip(&stamps) {
            let Some(stamp) = *stamp else { continue };
            times.get_or_insert([stamp; 2])[1] = stamp;
        }
        if frames.iter().flatten().count() < 2 {
            let alone = self.alone.iter_mut().zip(frames);
            alone.for_each(|(alone, frame)| *alone += usize::from(frame.is_some()));
            return None;
        }
        let (first, last) = (stamps.iter().flatten().min(), stamps.iter().flatten().max());
        let spread = first.zip(last).map_or(0, |(first, last)| last - first);
        self.largest_ns = self.largest_ns.max(spread);
        self.sets += 1;
        Some(self.sets - 1)
    }

    /// Reports the number of sets, and of frames that are in none; fails if there is no set.
    fn report(&self, tolerance_ns: i64) -> anyhow::Result<()> {
        let [tolerance, largest] = [tolerance_ns, self.largest_ns].map(|ns| ns as f64 / 1e6);
        let cameras = || self.names.iter().zip(&self.alone);
        if self.names.len() < 2 || interrupt::is_raised() && self.sets == 0 {
            return Ok(());
        }
        let spans = self.names.iter().zip(&self.times).map(|(name, times)| match times {
            Some(times) => {
                let [from, to] = times.map(|ns| ns as f64 / 1e9);
                format!("{name} from {from:.3} to {to:.3} s")
            }
            None => format!("{name} has no images"),
        });
        ensure!(
            self.sets > 0,
            "no two images have time stamps within {tolerance:.1} ms, half of the frame interval: {}; the clocks of the \
             cameras must agree",
            spans.collect::<Vec<_>>().join(", ")
        );
        let alone: Vec<String> = cameras()
            .filter(|(_, alone)| **alone > 0)
            .map(|(name, alone)| format!("{} of {name}", counted(*alone, "image")))
            .collect();
        let alone = match alone.is_empty() {
            true => String::new(),
            false => format!("; {} without a partner, not used", alone.join(", ")),
        };
        let sets = counted(self.sets as usize, "set");
        log!(
            "{sets} of simultaneous images, at most {largest:.1} ms apart (limit {tolerance:.1} ms){alone}"
        );
        Ok(())
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
