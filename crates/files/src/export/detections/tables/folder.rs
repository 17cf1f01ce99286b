//! Finds the tables in a folder and reads them together.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::{fs, io};

use super::{CORNERS, Contents, EARLIER_IMAGES, EXTENSION, IMAGES, Read, Reader, TableError};
use crate::limits::{Limits, ReadError};

/// Error of reading files of tables.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FolderError {
    /// A folder cannot be listed.
    #[error("cannot read {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A file cannot be read, or is too large.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file is not a valid table.
    #[error("{}: {source}", path.display())]
    Table {
        /// The file; the first one if several contradict each other.
        path: PathBuf,
        /// The problem.
        source: TableError,
    },
    /// One of the two tables is missing.
    #[error("{}: the `{lacks}` table is missing: give both files or their folder", path.display())]
    Alone {
        /// A file of the other table.
        path: PathBuf,
        /// The missing table.
        lacks: &'static str,
    },
}

/// Whether a file has the name of a table.
pub fn is_named(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Returns the tables of a folder: files in it, and in subfolders with the names of the tables. A file of corners in a subfolder
/// has a file of images with the same name, unless it was left behind by an interrupted run.
///
/// # Errors
/// Returns an error if a folder cannot be listed.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let mut files = named_in(folder)?;
    let corners = folder.join(CORNERS);
    let images = [IMAGES, EARLIER_IMAGES].map(|table| folder.join(table));
    if let Some(images) = images.into_iter().find(|images| images.is_dir()) {
        let done = named_in(&images)?;
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

/// The files in a folder with names of tables, sorted by name.
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

/// The path of the other table: `images` in place of `corners`, or vice versa.
pub fn beside(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let swapped =
        |from, to| name.contains(from).then(|| path.with_file_name(name.replace(from, to)));
    let pairs = [
        (CORNERS, IMAGES),
        (IMAGES, CORNERS),
        (CORNERS, EARLIER_IMAGES),
        (EARLIER_IMAGES, CORNERS),
    ];
    pairs.into_iter().filter_map(|(from, to)| swapped(from, to)).find(|other| other.is_file())
}

/// Reads tables from their files.
///
/// # Errors
/// Returns an error if a file cannot be read or is not a valid table, or if one of the two tables is missing.
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
    for (wanted, lacks) in [(Contents::Images, IMAGES), (Contents::Corners, CORNERS)] {
        if !files.is_empty() && !contents.contains(&wanted) {
            return Err(FolderError::Alone { path: first.to_owned(), lacks });
        }
    }
    reader.finish().map_err(wrong(first))
}
