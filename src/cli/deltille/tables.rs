//! Tables of detections in a folder: what is written of a run, and what is read of one.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use anyhow::{Context, ensure};

use crate::cli::output::{Overwrite, tell};
use crate::export::kind::Kind;
use crate::export::staging::Staging;
use crate::export::tables::{
    self, CORNERS, Contents, EXTENSION, PICTURES, Picture, Reader, Writer,
};
use crate::limits::Limits;
use crate::targets::Target;
use crate::words::counted;

/// The files of both tables in a folder.
pub fn files(folder: &Path) -> [PathBuf; 2] {
    [CORNERS, PICTURES].map(|table| folder.join(format!("{table}.{EXTENSION}")))
}

/// Tables on their way to a folder. Pictures are written in their order, whichever is done first.
pub struct Tables {
    folder: PathBuf,
    state: Mutex<State>,
}

struct State {
    staging: Staging,
    writer: Writer<BufWriter<File>>,
    next: usize,
    /// Done before one that comes earlier; `None` where no row is to be written.
    waiting: BTreeMap<usize, Option<Picture>>,
    written: BTreeSet<String>,
    error: Option<anyhow::Error>,
}

impl Tables {
    /// Begins both tables of a folder.
    pub fn begin(folder: &Path, targets: &[Target]) -> anyhow::Result<Self> {
        let cannot = || format!("cannot write to {}", folder.display());
        let staging = Staging::new(folder).with_context(cannot)?;
        let [corners, pictures] = files(&staging.files());
        let open = |path| Ok::<_, std::io::Error>(BufWriter::new(File::create_new(path)?));
        let writer = open(corners).and_then(|corners| Ok((corners, open(pictures)?)));
        let (corners, pictures) = writer.with_context(cannot)?;
        let state = State {
            staging,
            writer: Writer::new(corners, pictures, targets)?,
            next: 0,
            waiting: BTreeMap::new(),
            written: BTreeSet::new(),
            error: None,
        };
        Ok(Self { folder: folder.to_owned(), state: Mutex::new(state) })
    }

    /// Adds what came of the picture of a number; `None` where it has no row.
    pub fn add(&self, index: usize, picture: Option<Picture>) {
        let mut state = self.state();
        state.waiting.insert(index, picture);
        loop {
            let next = state.next;
            let Some(picture) = state.waiting.remove(&next) else { return };
            state.next += 1;
            picture.iter().for_each(|picture| state.push(picture));
        }
    }

    /// Puts both tables into their folder, with rows of `earlier` of pictures that were not looked at.
    pub fn finish(self, earlier: &[Picture]) -> anyhow::Result<()> {
        let mut state = self.state.into_inner().expect("no thread panics here");
        // After an interruption there are gaps.
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
            let [corners, pictures] = files(&self.folder);
            format!("cannot write {} and {}", corners.display(), pictures.display())
        })
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect("no thread panics here")
    }
}

impl State {
    fn push(&mut self, picture: &Picture) {
        if self.error.is_none() && self.written.insert(picture.image.clone()) {
            self.error = self.writer.push(picture).err().map(Into::into);
        }
    }
}

/// Refuses to replace what is no such table.
pub fn check(folder: &Path, overwrite: Overwrite) -> anyhow::Result<()> {
    files(folder).iter().try_for_each(|path| overwrite.check(path, &Kind::own_parquet()))
}

/// Whether a folder has both.
pub fn are_in(folder: &Path) -> bool {
    files(folder).iter().all(|file| file.exists())
}

/// The pictures of an earlier run into a folder; none where it has no tables.
pub fn earlier(folder: &Path, limits: &Limits) -> anyhow::Result<Vec<Picture>> {
    let files = files(folder);
    match files.iter().any(|file| file.exists()) {
        true => Ok(read(&files, limits)?.pictures),
        false => Ok(Vec::new()),
    }
}

/// Whether a file is named like a table.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// The tables of a folder: files in it, and in folders of the tables' names. A file of corners there has a file of
/// pictures of the same name, or was left by a run that did not come to write that.
pub fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = files_of(folder)?;
    let [corners, pictures] = [CORNERS, PICTURES].map(|table| folder.join(table));
    if pictures.is_dir() {
        let done = files_of(&pictures)?;
        let names: BTreeSet<&OsStr> = done.iter().filter_map(|file| file.file_name()).collect();
        if corners.is_dir() {
            let is_done =
                |file: &PathBuf| file.file_name().is_some_and(|name| names.contains(name));
            files.extend(files_of(&corners)?.into_iter().filter(is_done));
        }
        files.extend(done);
    }
    Ok(files)
}

/// The files in a folder that are named like tables, in the order of their names.
fn files_of(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let show = || format!("cannot read {}", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(show)? {
        let path = entry.with_context(show)?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if is_named(&path) && !hidden && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// The file of the other table beside one: `pictures` where it says `corners`, or the other way round.
pub fn beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let swapped =
        |from, to| name.contains(from).then(|| path.with_file_name(name.replace(from, to)));
    let other = swapped(CORNERS, PICTURES).or_else(|| swapped(PICTURES, CORNERS));
    other.filter(|other| other.is_file())
}

/// Reads tables from their files.
pub fn read(files: &[PathBuf], limits: &Limits) -> anyhow::Result<tables::Read> {
    let mut reader = Reader::new(*limits);
    let mut contents = Vec::new();
    for file in files {
        let content = limits.read(file)?;
        contents.push(reader.add(content).with_context(|| file.display().to_string())?);
    }
    if let Some(first) = files.first() {
        let lacks = |wanted, name| {
            let show = first.display();
            ensure!(
                contents.contains(&wanted),
                "{show}: the table of {name} is not beside it: give both, or their folder"
            );
            Ok(())
        };
        lacks(Contents::Pictures, PICTURES)?;
        lacks(Contents::Corners, CORNERS)?;
    }
    let read = reader.finish().with_context(|| match files {
        [first, ..] => first.display().to_string(),
        [] => String::new(),
    })?;
    if read.short > 0 {
        let have = if read.short == 1 { "has" } else { "have" };
        tell!(
            "warning: {} {have} fewer corners than were found in it",
            counted(read.short, "picture")
        );
    }
    Ok(read)
}
