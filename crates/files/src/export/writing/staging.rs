//! Staging: a set of files that appears as one unit.
//!
//! All files are first written to a temporary folder `.deltille-writing-…` beside their final
//! paths, and flushed to the disk. Then the empty file `complete` is added, after which the set
//! counts as written. Finally each file is moved to its path, and the folder is removed.
//!
//! A process that is killed before `complete` leaves the earlier files unchanged. A process that is killed later leaves all new
//! files, some perhaps still in the temporary folder. [`settle`] removes incomplete sets and finishes complete ones; all writers to
//! a folder call it first, and so do readers of targets and cameras. A lock on the folder serialises processes that move files in
//! it. A lock on the temporary folder distinguishes a folder in use from a leftover. Systems without locks on folders (Windows,
//! some network drives) have neither: leftovers stay, and two runs into one folder are not serialised.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::atomic::{self, Unfinished};

/// Name of the file that marks the set as complete.
const COMPLETE: &str = "complete";

/// Name of the folder with the files, inside the temporary one.
const FILES: &str = "files";

/// A set of files that is being written. If it is dropped before [`commit`](Self::commit), nothing is left behind.
pub struct Staging {
    folder: PathBuf,
    /// Folders that were created for it, innermost first; they are removed if they stay empty.
    made: Vec<PathBuf>,
    temporary: Option<TempDir>,
    unfinished: Option<Unfinished>,
    _lock: Option<File>,
}

impl Staging {
    /// Begins a set of files in a folder, which is created if necessary.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be created or written to, or if an earlier set in it cannot be finished.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let missing = folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists());
        let made: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        fs::create_dir_all(folder)?;
        settle(folder)?;
        let begun = Unfinished::begin(|| {
            let (temporary, lock) = atomic::temporary_folder(folder)?;
            let path = temporary.path().to_owned();
            Ok(((temporary, lock), path))
        });
        let ((temporary, lock), unfinished) = begun?;
        fs::create_dir(temporary.path().join(FILES))?;
        Ok(Self {
            folder: folder.to_owned(),
            made,
            temporary: Some(temporary),
            unfinished: Some(unfinished),
            _lock: lock,
        })
    }

    /// The folder for the files. Write each under its final name with [`atomic::write`], which flushes it
    /// to the disk.
    pub fn files(&self) -> PathBuf {
        self.temporary.as_ref().map(|temporary| temporary.path().join(FILES)).unwrap_or_default()
    }

    /// Moves all files to their final paths; an existing file with the same content is left unchanged.
    ///
    /// # Errors
    /// Returns an error if a file cannot be moved.
    pub fn commit(mut self) -> io::Result<()> {
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        let files = temporary.path().join(FILES);
        let _alone = atomic::lock(&self.folder);
        settle_alone(&self.folder)?;
        let _moving = atomic::moving();
        for entry in fs::read_dir(&files)? {
            let staged = entry?;
            let place = self.folder.join(staged.file_name());
            if !place.is_symlink() && same_content(&staged.path(), &place) {
                fs::remove_file(staged.path())?;
            }
        }
        File::create_new(temporary.path().join(COMPLETE))?.sync_all()?;
        // From here on, the files count as written, and the folder stays until all are moved.
        let path = temporary.keep();
        atomic::sync_folder(&path);
        atomic::sync_folder(&self.folder);
        self.made.clear();
        self.unfinished = None;
        finish(&path, &self.folder)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        self.temporary.take();
        for folder in &self.made {
            // This removes only empty folders.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Cleans up the leftovers of killed processes in a folder: complete sets are moved to their final
/// paths, incomplete ones are removed. Sets of running processes are not touched.
///
/// # Errors
/// Returns an error if the folder cannot be read, or if a file cannot be moved.
pub fn settle(folder: &Path) -> io::Result<()> {
    if temporaries(folder).is_empty() {
        return Ok(());
    }
    let _alone = atomic::lock(folder);
    settle_alone(folder)
}

fn settle_alone(folder: &Path) -> io::Result<()> {
    for path in temporaries(folder) {
        let Some(_lock) = atomic::lock_of_left(&path) else { continue };
        if !path.join(COMPLETE).exists() {
            atomic::remove(&path);
            continue;
        }
        finish(&path, folder).map_err(|error| {
            let message = format!(
                "cannot finish the files of an interrupted run in {}: {error}; remove that folder, or move \
                 the files in {FILES} to the folder above",
                path.display()
            );
            io::Error::new(error.kind(), message)
        })?;
    }
    Ok(())
}

/// Moves the files of a complete set to their final paths. A killed process may have moved some, and
/// may have removed part of the temporary folder.
fn finish(temporary: &Path, folder: &Path) -> io::Result<()> {
    let files = temporary.join(FILES);
    let names: Vec<OsString> = match fs::read_dir(&files) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        entries => entries?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<_>>()?,
    };
    let places: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    places.iter().try_for_each(|place| atomic::check_place(place))?;
    // Freeing a replaced file takes a hundred times longer than a rename. Keeping it open defers
    // this until after the last rename.
    let open = |place: &PathBuf| File::open(place).ok().filter(|_| cfg!(unix));
    let _replaced: Vec<File> = places.iter().filter_map(open).collect();
    for (name, place) in names.iter().zip(&places) {
        fs::rename(files.join(name), place)?;
    }
    atomic::sync_folder(folder);
    atomic::remove(temporary);
    Ok(())
}

/// The temporary files and folders in a folder.
fn temporaries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| atomic::is_temporary(&entry.file_name().to_string_lossy()));
    named.map(|entry| entry.path()).collect()
}

/// Whether two files contain the same bytes.
pub fn same_content(one: &Path, other: &Path) -> bool {
    let length = |path: &Path| path.metadata().ok().map(|metadata| metadata.len());
    length(one) == length(other)
        && matches!((fs::read(one), fs::read(other)), (Ok(one), Ok(other)) if one == other)
}
