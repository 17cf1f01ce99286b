//! `deltille detect`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::{Context, bail, ensure};
use rayon::ThreadPool;

use super::detector_options::FinderArgs;
use super::outcomes::{Found, Outcome, Report, row_of};
use crate::deltille::files::detection_tables::{self, Tables};
use crate::deltille::files::images::{Images, RecordingArgs, Stems};
use crate::deltille::files::images_at_once;
use crate::output::{self, NamedFile, Overwrite, Place, detail, log};
use crate::run::Interrupted;
use crate::values::{format, whole};
use crate::{interrupt, progress, terminal};
use deltille::clock;
use deltille::detect::{Detection, Detector, InkEstimate, Tracker};
use deltille::export::kind::Kind;
use deltille::export::named::Format;
use deltille::export::tables::ImageRecord;
use deltille::export::{DETECTION_FORMATS, DetectionFormat, atomic, detection, overlay};
use deltille::frames::{Frame, FrameOptions, is_recording};
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

/// A processed image.
struct Seen {
    /// Index among all images.
    index: usize,
    ink: Option<InkEstimate>,
}

/// Outcome of the first pass over all images.
#[derive(Default)]
struct FirstPass {
    /// Processed images, in their order.
    seen: Vec<Seen>,
    /// Indices of the other images, with their table rows if they have one.
    unseen: Vec<(usize, Option<ImageRecord>)>,
}

/// The images, and what both passes over them share.
struct Work<'a> {
    args: &'a Args,
    targets: &'a [Target],
    images: &'a Images,
    options: FrameOptions,
    threads: ThreadPool,
    report: Report,
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
    let options = args.recording.options(args.finder.limits(), &images)?;
    let earlier = args.earlier()?;
    let tables = args.begin_tables(&targets)?;
    if tables.is_some() {
        // Existing rows are kept.
        interrupt::keeps_results();
    }
    // Frames of a video are processed in order.
    let jobs = if args.track { 1 } else { args.jobs.unwrap_or(0) };
    let threads = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build()?;
    let go_on = if args.stream { "" } else { "; resume with --skip-existing" };
    let report = Report::new(images.is_single(), terminal::is_quiet() && !args.stream, go_on);
    let work = Work { args: &args, targets: &targets, images: &images, options, threads, report };
    let first = work.see(&finder, tables.as_ref(), &earlier);
    let mut again = None;
    if args.stream {
        note_ink_of_all(&finder.detector, &first.seen);
    } else if !interrupt::is_raised() {
        again = work.see_again(&finder.detector, first)?;
    }
    if let Some(tables) = tables {
        let is_left = interrupt::is_raised();
        // An interrupted run does not replace a complete one, unless it resumes it.
        let stays =
            is_left && !args.skip_existing && args.tables().is_some_and(detection_tables::are_in);
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
        return Err(Interrupted(work.report.status()).into());
    }
    work.report.end()
}

impl Work<'_> {
    /// Processes all images, except those with results if these are kept; `earlier` are the rows of their tables.
    fn see(
        &self,
        finder: &ImageDetector,
        tables: Option<&Tables>,
        earlier: &[ImageRecord],
    ) -> FirstPass {
        let done = earlier.iter().filter(|picture| picture.found.is_ok());
        let done: BTreeSet<&str> = done.map(|picture| picture.image.as_str()).collect();
        let bar = progress::bar(self.images.count().unwrap_or(0) as u64, "images");
        // Sequential, so that of two images with the same stem the later one is always rejected.
        let mut stems = Stems::default();
        let claimed = self.images.frames(&self.options, true).map(|frame| {
            let frame = frame?;
            stems.claim_stem(&frame.stem(), frame.path())?;
            Ok(frame)
        });
        let pass: Mutex<FirstPass> = Mutex::default();
        self.for_each(claimed, |index, frame| {
            let name = frame.as_ref().ok().map(Frame::name);
            let mut result = frame.and_then(|frame| self.outcome(finder, frame, &done));
            let row = row_of(name, &mut result);
            {
                let mut pass = pass.lock().expect("no thread panics here");
                match &result {
                    Ok(Outcome::Seen(found)) => pass.seen.push(Seen { index, ink: found.ink }),
                    _ => pass.unseen.push((index, row.clone())),
                }
            }
            if let Some(tables) = tables {
                tables.add(index, row);
            }
            bar.inc(1);
            bar.suspend(|| self.report.add(index, result));
        });
        bar.finish_and_clear();
        let mut pass = pass.into_inner().expect("no thread panics here");
        // Sorted by image order, independent of the order of completion.
        pass.seen.sort_unstable_by_key(|seen| seen.index);
        pass
    }

    /// Processes an image, unless it has results that are kept; `done` are the images in tables.
    fn outcome(
        &self,
        finder: &ImageDetector,
        frame: Frame,
        done: &BTreeSet<&str>,
    ) -> anyhow::Result<Outcome> {
        let Self { args, targets, .. } = self;
        let (name, stem) = (frame.name(), frame.stem());
        args.check_results(&stem)?;
        if args.skip_existing
            && args.results(&stem).iter().all(|(path, _)| path.exists())
            && (args.tables().is_none() || done.contains(name.as_str()))
        {
            return Ok(Outcome::Skipped);
        }
        let start = Instant::now();
        let found = one_image(args, targets, finder, frame)?;
        detail!("{name}: {:.1} ms", 1e3 * start.elapsed().as_secs_f64());
        Ok(Outcome::Seen(Box::new(found)))
    }

    /// Processes all images a second time with the joint ink estimate, because a single image may constrain the ink
    /// poorly. Rewrites the tables, with the rows of images that were not processed.
    fn see_again(
        &self,
        detector: &Detector,
        FirstPass { seen, unseen }: FirstPass,
    ) -> anyhow::Result<Option<Tables>> {
        let found: Vec<Option<InkEstimate>> = seen.iter().map(|seen| seen.ink).collect();
        let known: Vec<InkEstimate> = found.iter().copied().flatten().collect();
        let Some(ink) = InkEstimate::of_all(&known).filter(|ink| ink.used) else { return Ok(None) };
        let mut tables = None;
        if let Some(detector) = detector.with_ink_of(&found) {
            let finder = ImageDetector::of(self.args, detector);
            let bar =
                progress::bar(seen.len() as u64, "images, second pass with joint ink estimate");
            let mut wanted = seen.iter().map(|seen| seen.index).peekable();
            let frames = self.images.frames(&self.options, false).enumerate();
            let frames = frames.filter(|(index, _)| wanted.next_if_eq(index).is_some());
            tables = self.args.begin_tables(self.targets)?;
            if let Some(table) = &tables {
                unseen.into_iter().for_each(|(index, row)| table.add(index, row));
            }
            self.for_each(frames.map(|(_, frame)| frame), |index, frame| {
                let name = frame.as_ref().ok().map(Frame::name);
                let again =
                    frame.and_then(|frame| one_image(self.args, self.targets, &finder, frame));
                let failed = again.as_ref().err();
                failed.iter().for_each(|error| bar.suspend(|| self.report.fail_again(error)));
                if let Some(tables) = &tables {
                    let mut again = again.map(|found| Outcome::Seen(Box::new(found)));
                    tables.add(seen[index].index, row_of(name, &mut again));
                }
                bar.inc(1);
            });
            bar.finish_and_clear();
        }
        log!("ink: {ink} ({})", counted(ink.images as usize, "image"));
        Ok(tables)
    }

    /// Calls a function with each frame and its index in parallel, until the run is interrupted.
    fn for_each(
        &self,
        frames: impl Iterator<Item = anyhow::Result<Frame>> + Send,
        work: impl Fn(usize, anyhow::Result<Frame>) + Sync,
    ) {
        images_at_once::for_each(
            &self.threads,
            &self.args.finder.limits(),
            frames,
            |index, frame| {
                if !interrupt::is_raised() {
                    work(index, frame);
                }
            },
        );
    }
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

    /// Starts tables, if requested.
    fn begin_tables(&self, targets: &[Target]) -> anyhow::Result<Option<Tables>> {
        self.tables().map(|folder| Tables::begin(folder, targets)).transpose()
    }

    /// Returns the rows of existing tables if they are to be completed. Refuses to replace files that are not tables.
    fn earlier(&self) -> anyhow::Result<Vec<ImageRecord>> {
        let Some(folder) = self.tables() else { return Ok(Vec::new()) };
        detection_tables::check(folder, self.overwrite)?;
        match self.skip_existing {
            true => detection_tables::earlier(folder, &self.finder.limits()),
            false => Ok(Vec::new()),
        }
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
