//! Which files of a folder are tables, and what they hold together.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::{CORNERS, Contents, EXTENSION, PICTURES, Read, Reader, TableError};
use crate::limits::{Limits, ReadError};

/// Why files of tables cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A folder cannot be listed.
    #[error("cannot read {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A file cannot be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file is no such table.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file; of what several contradict each other in, the first.
        path: PathBuf,
        /// What is wrong.
        source: TableError,
    },
    /// One of the two tables is not there.
    #[error("{}: the table of {lacks} is not beside it: give both, or their folder", path.display())]
    Alone {
        /// A file of the other.
        path: PathBuf,
        /// Which is not there.
        lacks: &'static str,
    },
}

/// Whether a file is named like a table.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// The tables of a folder: files in it, and in folders of the tables' names. A file of corners there has a file of
/// pictures of the same name, or was left by a run that did not come to write that.
///
/// # Errors
/// When a folder cannot be listed.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let mut files = named_in(folder)?;
    let [corners, pictures] = [CORNERS, PICTURES].map(|table| folder.join(table));
    if pictures.is_dir() {
        let done = named_in(&pictures)?;
        let names: BTreeSet<&OsStr> = done.iter().filter_map(|file| file.file_name()).collect();
        if corners.is_dir() {
            let is_done =
                |file: &PathBuf| file.file_name().is_some_and(|name| names.contains(name));
            files.extend(named_in(&corners)?.into_iter().filter(is_done));
        }
        files.extend(done);
    }
    Ok(files)
}

/// The files in a folder that are named like tables, in the order of their names.
fn named_in(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let broken = |source| FolderError::Folder { path: folder.to_owned(), source };
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(broken)? {
        let path = entry.map_err(broken)?.path();
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
///
/// # Errors
/// When a file cannot be read or is no such table, or when one of the two tables is not among them.
pub fn read(files: &[PathBuf], limits: &Limits) -> Result<Read, FolderError> {
    let wrong = |path: &Path| {
        let path = path.to_owned();
        |source| FolderError::Table { path, source }
    };
    let mut reader = Reader::new(*limits);
    let mut contents = Vec::new();
    for file in files {
        let content = limits.read(file)?;
        contents.push(reader.add(content).map_err(wrong(file))?);
    }
    let first = files.first().map_or(Path::new(""), PathBuf::as_path);
    for (wanted, lacks) in [(Contents::Pictures, PICTURES), (Contents::Corners, CORNERS)] {
        if !files.is_empty() && !contents.contains(&wanted) {
            return Err(FolderError::Alone { path: first.to_owned(), lacks });
        }
    }
    reader.finish().map_err(wrong(first))
}
