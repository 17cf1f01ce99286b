//! Input images of a command: files, folders, patterns, recordings, and lists on standard input.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, anyhow, bail, ensure};

use crate::output::log;
use crate::values::whole;
use deltille::frames::{
    self, Frame, FrameOptions, Frames, FramesError, is_bag, is_heic, is_recording,
};
use deltille::limits::Limits;
use deltille_core::words::counted;

/// The error of an empty list.
const NO_LIST: &str = "-: standard input contains no file names; write one path per line";

/// Options for recordings.
#[derive(clap::Args)]
pub struct RecordingArgs {
    /// Topic of the images in an MCAP file or a bag; needed if several topics contain images
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Read only every N-th frame of videos, MCAP files and bags
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole(1..=1_000_000u64))]
    pub every: u64,
}

impl RecordingArgs {
    /// Returns the options for these images, with these limits. Fails if they apply to recordings, and there is none.
    pub fn options(&self, limits: Limits, images: &Images) -> anyhow::Result<FrameOptions> {
        let has = |is_it: fn(&Path) -> bool| {
            images.listed.is_some() || images.named.iter().any(|path| is_it(path))
        };
        if let Some(topic) = &self.topic {
            ensure!(has(is_bag), "--topic {topic}: no input is an MCAP file or a bag");
        }
        ensure!(
            self.every == 1 || has(is_recording),
            "--every {}: no input is a video, an MCAP file or a bag",
            self.every
        );
        let mut options = FrameOptions::default();
        options.topic.clone_from(&self.topic);
        options.every = self.every;
        options.limits = limits;
        Ok(options)
    }
}

/// Images in the order of the arguments; a list on standard input is read as it arrives.
pub struct Images {
    named: Vec<PathBuf>,
    /// The list on standard input, if it is among the arguments.
    listed: Option<List>,
}

/// A list on standard input.
struct List {
    /// Number of named images before it.
    after: usize,
    /// The lines, once they were read.
    read: Mutex<Vec<PathBuf>>,
}

impl Images {
    /// Expands folders and patterns. Folders of bags and recordings are images until [`frames`](Self::frames) opens them.
    pub fn of(arguments: &[PathBuf]) -> anyhow::Result<Self> {
        let mut images = Self { named: Vec::new(), listed: None };
        for argument in arguments {
            if argument.as_os_str() == "-" {
                let list = List { after: images.named.len(), read: Mutex::default() };
                if images.listed.replace(list).is_some() {
                    bail!("-: standard input is given twice");
                }
            } else if argument.is_dir() && !is_recording(argument) {
                images.named.extend(in_folder(argument)?);
            } else if argument.exists() {
                images.named.push(argument.clone());
            } else {
                images.named.extend(matching(argument)?);
            }
        }
        Ok(images)
    }

    /// Returns the photographs and recordings that are known in advance.
    pub fn named(&self) -> &[PathBuf] {
        &self.named
    }

    /// Returns the number of images, if known.
    pub fn count(&self) -> Option<usize> {
        let is_known = self.listed.is_none() && !self.named.iter().any(|path| is_recording(path));
        is_known.then_some(self.named.len())
    }

    /// Whether there is a single photograph or recording.
    pub fn is_single(&self) -> bool {
        self.listed.is_none() && self.named.len() == 1
    }

    /// Whether there is a single photograph, so that a result can be one file.
    pub fn is_one_photograph(&self) -> bool {
        self.is_single() && self.count().is_some()
    }

    /// Iterates over all paths; an unreadable line ends the list with an error.
    pub fn iter(&self) -> impl Iterator<Item = anyhow::Result<PathBuf>> + Send + '_ {
        let after = self.listed.as_ref().map_or(0, |list| list.after);
        let (before, after) = self.named.split_at(after);
        let listed = self.listed.iter().flat_map(List::iter);
        before.iter().cloned().map(Ok).chain(listed).chain(after.iter().cloned().map(Ok))
    }

    /// Iterates over the frames of all images. The first pass notes recordings that end early.
    pub fn frames<'a>(
        &'a self,
        options: &'a FrameOptions,
        is_first_pass: bool,
    ) -> impl Iterator<Item = anyhow::Result<Frame>> + Send + 'a {
        let opened =
            self.iter().flat_map(move |path| match path.map(|path| of_path(path, options)) {
                Ok(frames) => frames,
                Err(error) => Box::new(std::iter::once(Err(error))),
            });
        opened.filter(move |frame| {
            let error = frame.as_ref().err().and_then(|error| error.downcast_ref());
            let Some(early @ FramesError::Incomplete { .. }) = error else { return true };
            if is_first_pass {
                log!("note: {early}");
            }
            false
        })
    }
}

impl List {
    fn iter(&self) -> Box<dyn Iterator<Item = anyhow::Result<PathBuf>> + Send + '_> {
        let read = || self.read.lock().unwrap_or_else(PoisonError::into_inner);
        let again = read().clone();
        if !again.is_empty() {
            return Box::new(again.into_iter().map(Ok));
        }
        let lines = std::io::BufReader::new(std::io::stdin()).lines();
        let mut paths = lines.filter_map(move |line| match line {
            Ok(line) if line.trim().is_empty() => None,
            Ok(line) => {
                let path = PathBuf::from(line.trim_end_matches('\r'));
                read().push(path.clone());
                Some(Ok(path))
            }
            Err(error) => Some(Err(error).context("-: the list on standard input")),
        });
        let mut is_empty = true;
        Box::new(std::iter::from_fn(move || {
            let next = paths.next();
            let is_missing = std::mem::replace(&mut is_empty, false) && next.is_none();
            if is_missing { Some(Err(anyhow!(NO_LIST))) } else { next }
        }))
    }
}

/// Opens a path that is not a folder of photographs.
fn of_path(
    path: PathBuf,
    options: &FrameOptions,
) -> Box<dyn Iterator<Item = anyhow::Result<Frame>> + Send> {
    match Frames::open(path, options) {
        Ok(frames) => Box::new(frames.map(|frame| Ok(frame?))),
        Err(error) => Box::new(std::iter::once(Err(error.into()))),
    }
}

/// Returns the images directly inside a folder, sorted by name; fails if there are none. Notes files that are not read.
fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let images = photographs_in(folder)?;
    let (images, heic) = without_converted(images);
    if let Some(first) = heic.first() {
        let skipped = counted(heic.len(), "HEIC photograph");
        log!(
            "note: {skipped} such as {} not read; files of other formats have the same names",
            first.display()
        );
    }
    let unread = frames::unread_in(folder).unwrap_or_default();
    let [first, ..] = unread.as_slice() else {
        if images.is_empty() {
            return Err(FramesError::EmptyFolder { path: folder.to_owned() }.into());
        }
        return Ok(images);
    };
    let skipped = format!("{} such as {}", counted(unread.len(), "file"), first.display());
    if images.is_empty() {
        bail!(
            "{}: no photograph that can be read, but {skipped}; pass recordings by name",
            folder.display()
        );
    }
    log!("note: {skipped} not read; pass recordings by name");
    Ok(images)
}

/// Separates HEIC photographs that were converted: a file of another format has the same name.
fn without_converted(images: Vec<PathBuf>) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let others = images.iter().filter(|path| !is_heic(path)).map(|path| path.with_extension(""));
    let others: BTreeSet<PathBuf> = others.collect();
    let is_read = |path: &PathBuf| !is_heic(path) || !others.contains(&path.with_extension(""));
    images.into_iter().partition(is_read)
}

/// Returns the images directly inside a folder, sorted by name; may be empty.
pub fn photographs_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    frames::photographs_in(folder).with_context(|| format!("cannot read {}", folder.display()))
}

/// Returns the files that match a pattern with `*`, `?` or `[…]`; fails for other arguments, which do not exist.
fn matching(argument: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let Some(pattern) = argument.to_str().filter(|text| text.contains(['*', '?', '['])) else {
        bail!("{}: no such file or folder", argument.display());
    };
    let paths = glob::glob(pattern).with_context(|| format!("{pattern}: invalid pattern"))?;
    let images: Vec<PathBuf> = paths.flatten().filter(|path| path.is_file()).collect();
    if images.is_empty() {
        bail!("{pattern}: no file matches");
    }
    Ok(images)
}

/// Returns the stem of an image's result files.
pub fn stem(image: &Path) -> anyhow::Result<String> {
    match image.file_stem() {
        Some(stem) => Ok(stem.to_string_lossy().into_owned()),
        None => bail!("{} is not a valid file name", image.display()),
    }
}

/// Unique stems of result files, one per image.
#[derive(Default)]
pub struct Stems {
    taken: BTreeMap<String, PathBuf>,
}

impl Stems {
    /// Returns the stem of an image's result files; fails if another image has the same.
    pub fn claim(&mut self, image: &Path) -> anyhow::Result<String> {
        let stem = stem(image)?;
        self.claim_stem(&stem, image)?;
        Ok(stem)
    }

    /// Fails if another image has the same stem.
    pub fn claim_stem(&mut self, stem: &str, image: &Path) -> anyhow::Result<()> {
        if let Some(other) = self.taken.insert(stem.to_owned(), image.to_owned()) {
            bail!(
                "{} and {} have the same name without extension, {stem}, by which results are named: rename one of them",
                other.display(),
                image.display()
            );
        }
        Ok(())
    }
}
