//! `deltille detect`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, bail, ensure};

use super::detector_options::FinderArgs;
use crate::deltille::files::detection_tables::{self, Tables};
use crate::deltille::files::images::{Images, RecordingArgs, Stems};
use crate::deltille::files::images_at_once;
use crate::output::{self, NamedFile, Overwrite, Place, detail, log};
use crate::run::{self, BAD_INPUT, FAILED, Interrupted};
use crate::values::{format, whole};
use crate::{interrupt, progress, terminal};
use deltille::clock;
use deltille::detect::{Detection, Detector, InkEstimate, Tracker};
use deltille::export::kind::Kind;
use deltille::export::named::Format;
use deltille::export::tables::ImageRecord;
use deltille::export::{DETECTION_FORMATS, DetectionFormat, atomic, detection, overlay};
use deltille::frames::{Frame, is_recording};
use deltille::photograph::Photograph;
use deltille::raster::AnyGray;
use deltille::targets::Target;
use deltille_core::words::{counted, shown};

/// Arguments of `deltille detect`.
#[derive(clap::Args)]
pub struct Args {
    /// Photographs (PNG, JPEG, TIFF, BMP, PGM, WebP or HEIC), videos (MP4, MOV, MKV, AVI, WebM or Y4M), MCAP files, and
    /// bags of ROS 1 or 2: files, folders, patterns such as 'day*/*.png', or - for a list on standard input, one path per
    /// line
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<PathBuf>,
    #[command(flatten)]
    recording: RecordingArgs,
    #[command(flatten)]
    finder: FinderArgs,
    /// Output folder, whose files are named after the images; or a file such as corners.csv for one image [default: current
    /// folder]
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Stem of the output files of one image.
    #[arg(skip)]
    stem: Option<String>,
    /// Output formats, separated by commas [default: that of the file given by -o, or json]
    #[arg(long, value_delimiter = ',', value_parser = format(DETECTION_FORMATS))]
    format: Vec<&'static DetectionFormat>,
    /// Also write <image>.overlay.jpg: corners, grid and ids drawn over the photograph
    #[arg(long)]
    overlay: bool,
    /// Include the run time of each stage in the JSON, ms (makes the output differ between runs)
    #[arg(long)]
    timing: bool,
    /// Print each result as a line of JSON on standard output as soon as it is available; files are written only if
    /// -o is given. With --stream, the ink spread is estimated from each image separately, so
    /// corners differ slightly from those of a run without it, unless --ink is a value in µm or
    /// none
    #[arg(long)]
    stream: bool,
    /// The images are successive frames of a video, as recorded, listed or sorted by name: follow the targets from frame to
    /// frame, one frame at a time, in less than half of the time of detection (without decoding). The result contains only
    /// the tags that were read in this frame
    #[arg(long, conflicts_with = "jobs")]
    track: bool,
    /// Accept incomplete JPEG files and note the damage in the result; otherwise they are errors
    #[arg(long)]
    accept_damaged: bool,
    /// Skip images that already have results (resume an interrupted run)
    #[arg(long, conflicts_with = "stream")]
    skip_existing: bool,
    #[command(flatten)]
    overwrite: Overwrite,
    /// Number of images processed in parallel [default: one per processor]
    #[arg(short, value_name = "N", value_parser = whole(1..=1024u16))]
    jobs: Option<u16>,
}

/// Detects targets in single images, or in those of a video.
struct ImageDetector {
    detector: Detector,
    tracker: Option<Mutex<Tracker>>,
}

impl ImageDetector {
    fn of(args: &Args, detector: Detector) -> Self {
        let tracker = args.track.then(|| Mutex::new(Tracker::new(detector.clone())));
        Self { detector, tracker }
    }

    fn detect(&self, image: &AnyGray, name: &str) -> Detection {
        match &self.tracker {
            Some(tracker) => tracker.lock().expect("no thread panics here").detect(image, name),
            None => self.detector.detect(image, name),
        }
    }
}

/// Outcome of an image.
enum Outcome {
    Seen(Box<Found>),
    Skipped,
}

/// Detections in an image.
struct Found {
    /// The line to print.
    line: String,
    /// The ink spread estimated from the image.
    ink: Option<InkEstimate>,
    /// Whether the requested target or grid was found.
    is_there: bool,
    /// The table row, if tables are written.
    row: Option<ImageRecord>,
}

/// A processed image.
struct Seen {
    /// Index among all images.
    index: usize,
    ink: Option<InkEstimate>,
}

/// Detects targets in all images. Images that cannot be read are reported, and the others are processed.
pub fn run(mut args: Args) -> anyhow::Result<ExitCode> {
    let images = Images::of(&args.images)?;
    args.set_place(&images)?;
    let args = args;
    let (targets, detector) = args.finder.detector()?;
    let of_one = args.format.iter().find(|format| format.is_of_one_target);
    if let Some(format) = of_one.filter(|_| targets.len() > 1) {
        let name = format.name();
        bail!("--format {name} does not support several targets; use one --target at a time");
    }
    let detector = if args.timing { detector.with_clock(clock::now) } else { detector };
    let finder = ImageDetector::of(&args, detector);
    // Detects name clashes among the named images before the work starts.
    let mut named = Stems::default();
    for image in images.named().iter().filter(|path| !is_recording(path)) {
        args.check_results(&named.claim(image)?)?;
    }
    let new_folder = args.folder().filter(|folder| !folder.exists());
    if let Some(folder) = args.folder() {
        fs::create_dir_all(folder)
            .with_context(|| format!("-o: cannot write to {}", folder.display()))?;
        output::settle(folder).context("-o")?;
    }
    let limits = args.finder.limits();
    let options = args.recording.options(limits, &images)?;
    let folder = args.tables();
    let earlier = match folder {
        Some(folder) => {
            detection_tables::check(folder, args.overwrite)?;
            if args.skip_existing {
                detection_tables::earlier(folder, &limits)?
            } else {
                Vec::new()
            }
        }
        None => Vec::new(),
    };
    let done: BTreeSet<&str> = earlier
        .iter()
        .filter(|picture| picture.found.is_ok())
        .map(|picture| picture.image.as_str())
        .collect();
    let tables = folder.map(|folder| Tables::begin(folder, &targets)).transpose()?;
    if tables.is_some() {
        // Existing rows are kept.
        interrupt::keeps_results();
    }

    let bar = progress::bar(images.count().unwrap_or(0) as u64, "images");
    // Frames of a video are processed in order.
    let jobs = if args.track { 1 } else { args.jobs.unwrap_or(0) };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(jobs.into());
    // Sequential, so that of two images with the same stem the later one is always rejected.
    let mut stems = Stems::default();
    let claimed = images.frames(&options, true).map(|frame| {
        let frame = frame?;
        stems.claim_stem(&frame.stem(), frame.path())?;
        Ok(frame)
    });
    let go_on = if args.stream { "" } else { "; resume with --skip-existing" };
    let report = Report::new(images.is_single(), terminal::is_quiet() && !args.stream, go_on);
    let seen: Mutex<Vec<Seen>> = Mutex::default();
    // Rows of images that were not processed, if they have one.
    let unseen: Mutex<Vec<(usize, Option<ImageRecord>)>> = Mutex::default();
    let threads = threads.build()?;
    images_at_once::for_each(&threads, &limits, claimed, |index, frame| {
        if interrupt::is_raised() {
            return;
        }
        let name = frame.as_ref().ok().map(Frame::name);
        let mut result = frame.and_then(|frame| {
            let stem = frame.stem();
            args.check_results(&stem)?;
            if args.skip_existing
                && args.results(&stem).iter().all(|(path, _)| path.exists())
                && (folder.is_none() || done.contains(frame.name().as_str()))
            {
                return Ok(Outcome::Skipped);
            }
            let start = Instant::now();
            let found = one_image(&args, &targets, &finder, frame)?;
            detail!(
                "{}: {:.1} ms",
                name.as_deref().unwrap_or(&stem),
                1e3 * start.elapsed().as_secs_f64()
            );
            let looked_at = Seen { index, ink: found.ink };
            seen.lock().expect("no thread panics here").push(looked_at);
            Ok(Outcome::Seen(Box::new(found)))
        });
        if let Some(tables) = &tables {
            let row = row_of(name, &mut result);
            if !matches!(result, Ok(Outcome::Seen(_))) {
                unseen.lock().expect("no thread panics here").push((index, row.clone()));
            }
            tables.add(index, row);
        }
        bar.inc(1);
        bar.suspend(|| report.add(index, result));
    });
    bar.finish_and_clear();
    let mut seen = seen.into_inner().expect("no thread panics here");
    // Sorted by image order, independent of the order of completion.
    seen.sort_unstable_by_key(|seen| seen.index);
    let mut again = None;
    if args.stream {
        note_ink_of_all(&finder.detector, &seen);
    } else if !interrupt::is_raised() {
        let unseen = unseen.into_inner().expect("no thread panics here");
        let frames = images.frames(&options, false);
        again =
            see_again(&args, &targets, &finder.detector, &seen, frames, unseen, &threads, &report)?;
    }
    if let Some(tables) = tables {
        let is_left = interrupt::is_raised();
        // An interrupted run does not replace a complete one, unless it resumes it.
        let stays = is_left && !args.skip_existing && folder.is_some_and(detection_tables::are_in);
        match again.filter(|_| !is_left) {
            _ if stays => {}
            Some(again) => again.finish(&earlier)?,
            None => tables.finish(&earlier)?,
        }
    }
    if let Some(folder) = new_folder {
        // Removes the folder only if it is empty.
        let _ = fs::remove_dir(folder);
    }
    if interrupt::is_raised() {
        return Err(Interrupted(report.status()).into());
    }
    report.end()
}

/// Notes that each image used its own ink estimate, and that the joint estimate gives different corners.
fn note_ink_of_all(detector: &Detector, seen: &[Seen]) {
    let found: Vec<Option<InkEstimate>> = seen.iter().map(|seen| seen.ink).collect();
    if let Some(ink) = detector.ink_of_all(&found) {
        let images = counted(ink.images as usize, "image");
        log!(
            "note: --stream used a separate ink estimate for each image; without it, corners are located with the \
             joint estimate, {ink} ({images}), and differ slightly"
        );
    }
}

/// Processes all images a second time with the joint ink estimate, because a single image may constrain the ink
/// poorly. Rewrites the tables, with the rows of images that were not processed.
#[expect(clippy::too_many_arguments, reason = "the state of the first pass")]
fn see_again(
    args: &Args,
    targets: &[Target],
    detector: &Detector,
    seen: &[Seen],
    frames: impl Iterator<Item = anyhow::Result<Frame>> + Send,
    unseen: Vec<(usize, Option<ImageRecord>)>,
    threads: &rayon::ThreadPool,
    report: &Report,
) -> anyhow::Result<Option<Tables>> {
    let found: Vec<Option<InkEstimate>> = seen.iter().map(|seen| seen.ink).collect();
    let known: Vec<InkEstimate> = found.iter().copied().flatten().collect();
    let Some(ink) = InkEstimate::of_all(&known).filter(|ink| ink.used) else { return Ok(None) };
    let mut tables = None;
    if let Some(detector) = detector.with_ink_of(&found) {
        let finder = ImageDetector::of(args, detector);
        let bar = progress::bar(seen.len() as u64, "images, second pass with joint ink estimate");
        let mut wanted = seen.iter().map(|seen| seen.index).peekable();
        let frames = frames.enumerate().filter(|(index, _)| wanted.next_if_eq(index).is_some());
        tables = args.tables().map(|folder| Tables::begin(folder, targets)).transpose()?;
        if let Some(table) = &tables {
            unseen.iter().for_each(|(index, row)| table.add(*index, row.clone()));
        }
        let frames = frames.map(|(_, frame)| frame);
        images_at_once::for_each(threads, &args.finder.limits(), frames, |index, frame| {
            if interrupt::is_raised() {
                return;
            }
            let index = seen[index].index;
            let name = frame.as_ref().ok().map(Frame::name);
            let again = frame.and_then(|frame| one_image(args, targets, &finder, frame));
            again.as_ref().err().iter().for_each(|error| bar.suspend(|| report.fail_again(error)));
            if let Some(tables) = &tables {
                let mut again = again.map(|found| Outcome::Seen(Box::new(found)));
                tables.add(index, row_of(name, &mut again));
            }
            bar.inc(1);
        });
        bar.finish_and_clear();
    }
    log!("ink: {ink} ({})", counted(ink.images as usize, "image"));
    Ok(tables)
}

/// Returns the table row of an image, if it has one.
fn row_of(name: Option<String>, result: &mut anyhow::Result<Outcome>) -> Option<ImageRecord> {
    match result {
        Ok(Outcome::Seen(found)) => found.row.take(),
        Ok(Outcome::Skipped) => None,
        Err(error) => Some(ImageRecord::unread(name?, run::message(error))),
    }
}

/// Prints the results of the images in order, as soon as they are available.
struct Report {
    /// Whether images that show the target are not reported.
    is_silent: bool,
    /// With a single image, its error is the error of the command.
    single: bool,
    /// How to resume after an interruption.
    go_on: &'static str,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    next: usize,
    waiting: BTreeMap<usize, anyhow::Result<Outcome>>,
    failed: usize,
    skipped: usize,
    found: usize,
    error: Option<anyhow::Error>,
}

impl Report {
    fn new(single: bool, is_silent: bool, go_on: &'static str) -> Self {
        let report = Self { single, is_silent, go_on, state: Mutex::default() };
        interrupt::set_status(report.status());
        report
    }

    /// Describes the progress so far.
    fn status(&self) -> String {
        format!("{} done{}", counted(self.done(), "image"), self.go_on)
    }

    fn add(&self, index: usize, result: anyhow::Result<Outcome>) {
        self.print(index, result);
        interrupt::set_status(self.status());
    }

    fn print(&self, index: usize, result: anyhow::Result<Outcome>) {
        let mut state = self.state.lock().expect("no thread panics here");
        state.waiting.insert(index, result);
        loop {
            let next = state.next;
            let Some(result) = state.waiting.remove(&next) else { return };
            state.next += 1;
            match result {
                Ok(Outcome::Skipped) => state.skipped += 1,
                Ok(Outcome::Seen(found)) => {
                    state.found += usize::from(found.is_there);
                    // Output that cannot be printed is lost, as with `println`.
                    if self.is_silent && found.is_there {
                        continue;
                    }
                    if let Err(error) = output::print(&found.line) {
                        state.error.get_or_insert(error);
                    }
                }
                Err(error) => {
                    state.failed += 1;
                    if self.single {
                        state.error = Some(error);
                    } else {
                        run::report(&error);
                    }
                }
            }
        }
    }

    /// Counts an image that failed in the second pass.
    fn fail_again(&self, error: &anyhow::Error) {
        run::report(error);
        self.state.lock().expect("no thread panics here").failed += 1;
    }

    fn done(&self) -> usize {
        let state = self.state.lock().expect("no thread panics here");
        state.next + state.waiting.len()
    }

    fn end(self) -> anyhow::Result<ExitCode> {
        let State { next: all, failed, skipped, found, error, .. } =
            self.state.into_inner().expect("no thread panics here");
        if let Some(error) = error {
            return Err(error);
        }
        if skipped > 0 {
            log!(
                "{skipped} of {} skipped, because they already have results",
                counted(all, "image")
            );
        }
        if failed == 0 {
            let nothing = found == 0 && skipped == 0;
            return Ok(if nothing { ExitCode::from(FAILED) } else { ExitCode::SUCCESS });
        }
        if all > 1 {
            log!("error: {failed} of {all} images failed");
        }
        Ok(ExitCode::from(if failed == all { BAD_INPUT } else { FAILED }))
    }
}

impl Args {
    /// Separates the folder and the file that `-o` names, and sets the format.
    fn set_place(&mut self, images: &Images) -> anyhow::Result<()> {
        if let Some(output) = &self.output {
            let of_one = DETECTION_FORMATS.iter().filter(|format| format.is_of_one_image());
            let endings: Vec<&str> = of_one.map(|format| format.name()).collect();
            let Place { folder, file } = output::place(output, &endings)?;
            if let Some(NamedFile { stem, ending }) = file {
                let named = DETECTION_FORMATS.iter().find(|format| format.name() == ending);
                let named = named.filter(|_| images.is_one_photograph());
                let named = named.with_context(|| {
                    format!(
                        "-o: {} must be a folder, because several files are written",
                        output.display()
                    )
                })?;
                self.stem = Some(stem);
                if self.format.is_empty() {
                    self.format.push(named);
                }
                ensure!(
                    self.format.iter().any(|format| format.name() == ending),
                    "--format does not contain {ending}, the format of -o"
                );
            }
            self.output = Some(folder);
        }
        if self.format.is_empty() {
            self.format.extend(DETECTION_FORMATS.first());
        }
        Ok(())
    }

    /// Returns the path of a result file of an image, if files are written.
    fn path(&self, stem: &str, ending: &str) -> Option<PathBuf> {
        let stem = self.stem.as_deref().unwrap_or(stem);
        Some(self.folder()?.join(format!("{stem}.{ending}")))
    }

    /// Returns the output folder; `None` with `--stream` alone.
    fn folder(&self) -> Option<&Path> {
        match &self.output {
            Some(folder) => Some(folder),
            None if self.stream => None,
            None => Some(Path::new(".")),
        }
    }

    /// Returns the folder of tables, if requested.
    fn tables(&self) -> Option<&Path> {
        self.folder().filter(|_| !self.format.iter().all(|format| format.is_of_one_image()))
    }

    /// Iterates over the requested formats with one file per image.
    fn each(&self) -> impl Iterator<Item = &'static DetectionFormat> + '_ {
        self.format.iter().copied().filter(|format| format.is_of_one_image())
    }

    /// Returns the result files of an image.
    fn results(&self, stem: &str) -> Vec<(PathBuf, Kind)> {
        let formats = self.each().map(|format| (format.name(), format.kind()));
        let overlay = self.overlay.then(|| ("overlay.jpg", Kind::own_jpeg()));
        let all = formats.chain(overlay);
        all.filter_map(|(end, kind)| Some((self.path(stem, end)?, kind))).collect()
    }

    /// Refuses to replace a target, the ground truth of a synthetic image, or any other file.
    fn check_results(&self, stem: &str) -> anyhow::Result<()> {
        let mut results = self.results(stem).into_iter();
        results.try_for_each(|(path, kind)| self.overwrite.check(&path, &kind))
    }
}

/// Detects targets in one image, writes its results, and describes them.
fn one_image(
    args: &Args,
    targets: &[Target],
    finder: &ImageDetector,
    frame: Frame,
) -> anyhow::Result<Found> {
    let limits = args.finder.limits();
    let (place, stem) = (frame.path().to_owned(), frame.stem());
    let (name, time_ns) = (frame.name(), frame.time_ns());
    let Photograph { image, notes } = frame.read(&limits, args.accept_damaged)?;
    let mut found = finder.detect(&image, &name);
    (found.file, found.time_ns) = (notes, time_ns);
    let sought: Vec<&Target> = targets.iter().collect();
    let text = |format: &&DetectionFormat| {
        let text = format.text(&found, &sought)?;
        Some((args.path(&stem, format.name())?, text.into_bytes()))
    };
    let mut files: Vec<(PathBuf, Vec<u8>)> = args.format.iter().filter_map(text).collect();
    if let Some(path) = args.path(&stem, "overlay.jpg").filter(|_| args.overlay) {
        files.push((path, overlay::jpeg(&image, &found)?));
    }
    atomic::write_together(&files)?;
    let line = if args.stream { detection::write_line(&found) } else { summary(&place, &found) };
    let is_there = match targets.is_empty() {
        false => found.grids.iter().any(|grid| grid.panel.is_some()),
        true => !found.grids.is_empty(),
    };
    let row = args.tables().map(|_| ImageRecord::of(&found));
    Ok(Found { line, ink: found.ink, is_there, row })
}

/// Describes the detections in an image in one line, and the reasons why corners or tags are
/// missing.
fn summary(path: &Path, found: &Detection) -> String {
    let corners: usize = found.grids.iter().map(|grid| grid.corners.len()).sum();
    let tags: usize = found.grids.iter().map(|grid| grid.tags.len()).sum();
    let mut line = format!(
        "{}: {}, {}",
        path.display(),
        counted(found.grids.len(), "grid"),
        counted(corners, "corner")
    );
    let mut of_targets = BTreeMap::new();
    for grid in &found.grids {
        let count = grid.target.as_ref().map(|name| of_targets.entry(name).or_insert(0));
        count.into_iter().for_each(|count| *count += grid.corners.len());
    }
    let shares = of_targets.iter().map(|(name, count)| format!("{count} of {name}"));
    let shares = shares.collect::<Vec<_>>().join(", ");
    if !shares.is_empty() {
        line += &format!(" ({shares})");
    }
    if tags > 0 {
        line += &format!(", {}", counted(tags, "tag"));
    }
    let mut lines = vec![line];
    if let Some(damage) = &found.file.damage {
        let grey = "missing pixels are grey";
        lines.push(format!("  the file is damaged ({damage}): {grey}"));
    }
    lines.extend(found.reasons.iter().map(|reason| format!("  {reason}")));
    lines.iter().map(|line| shown(line) + "\n").collect()
}
