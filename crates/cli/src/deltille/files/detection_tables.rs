//! Detection tables in a folder, written by one run and read by another.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use anyhow::Context;

use crate::output::{Overwrite, log};
use deltille::export::kind::Kind;
use deltille::export::staging::Staging;
use deltille::export::tables::{CORNERS, EXTENSION, IMAGES, ImageRecord, Writer, folder};
use deltille::limits::Limits;
use deltille::targets::Target;
use deltille_core::words::counted;

/// Returns the paths of both tables in a folder.
pub fn files(folder: &Path) -> [PathBuf; 2] {
    [CORNERS, IMAGES].map(|table| folder.join(format!("{table}.{EXTENSION}")))
}

/// Tables being written. Images are written in order, regardless of the order in which they are
/// finished.
pub struct Tables {
    folder: PathBuf,
    state: Mutex<State>,
}

struct State {
    staging: Staging,
    writer: Writer<BufWriter<File>>,
    next: usize,
    /// Images finished before an earlier one; `None` if no row is to be written.
    waiting: BTreeMap<usize, Option<ImageRecord>>,
    written: BTreeSet<String>,
    error: Option<anyhow::Error>,
}

impl Tables {
    /// Creates both tables of a folder.
    pub fn begin(folder: &Path, targets: &[Target]) -> anyhow::Result<Self> {
        let cannot = || format!("cannot write to {}", folder.display());
        let staging = Staging::new(folder).with_context(cannot)?;
        let [corners, images] = files(&staging.files());
        let open = |path| Ok::<_, std::io::Error>(BufWriter::new(File::create_new(path)?));
        let writer = open(corners).and_then(|corners| Ok((corners, open(images)?)));
        let (corners, images) = writer.with_context(cannot)?;
        let state = State {
            staging,
            writer: Writer::new(corners, images, targets)?,
            next: 0,
            waiting: BTreeMap::new(),
            written: BTreeSet::new(),
            error: None,
        };
        Ok(Self { folder: folder.to_owned(), state: Mutex::new(state) })
    }

    /// Adds the result of the image at `index`; `None` if it has no row.
    pub fn add(&self, index: usize, picture: Option<ImageRecord>) {
        let mut state = self.state();
        state.waiting.insert(index, picture);
        loop {
            let next = state.next;
            let Some(picture) = state.waiting.remove(&next) else { return };
            state.next += 1;
            picture.iter().for_each(|picture| state.push(picture));
        }
    }

    /// Moves both tables into their folder, with the rows of `earlier` for images that were not processed.
    pub fn finish(self, earlier: &[ImageRecord]) -> anyhow::Result<()> {
        let mut state = self.state.into_inner().expect("no thread panics here");
        // An interruption leaves gaps.
        for picture in std::mem::take(&mut state.waiting).into_values().flatten() {
            state.push(&picture);
        }
        earlier.iter().for_each(|picture| state.push(picture));
        let State { staging, writer, error, .. } = state;
        let end = || {
            for table in writer.finish()? {
                table.into_inner()?.sync_all()?;
            }
            Ok(staging.commit()?)
        };
        error.map_or_else(end, Err).with_context(|| {
            let [corners, images] = files(&self.folder);
            format!("cannot write {} and {}", corners.display(), images.display())
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no thread panics here")
    }
}

impl State {
    fn push(&mut self, picture: &ImageRecord) {
        if self.error.is_none() && self.written.insert(picture.image.clone()) {
            self.error = self.writer.push(picture).err().map(Into::into);
        }
    }
}

/// Refuses to replace files that are not such tables.
pub fn check(folder: &Path, overwrite: Overwrite) -> anyhow::Result<()> {
    files(folder).iter().try_for_each(|path| overwrite.check(path, &Kind::own_parquet()))
}

/// Whether a folder contains both tables.
pub fn are_in(folder: &Path) -> bool {
    files(folder).iter().all(|file| file.exists())
}

/// Returns the images of an earlier run in a folder; empty without tables.
pub fn earlier(folder: &Path, limits: &Limits) -> anyhow::Result<Vec<ImageRecord>> {
    let files = files(folder);
    match files.iter().any(|file| file.exists()) {
        true => read(&files, limits),
        false => Ok(Vec::new()),
    }
}

/// Reads the images of table files.
pub fn read(files: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<ImageRecord>> {
    let read = folder::read(files, limits)?;
    if read.short > 0 {
        let have = if read.short == 1 { "has" } else { "have" };
        log!("warning: {} {have} fewer corners than were detected", counted(read.short, "image"));
    }
    Ok(read.images)
}
