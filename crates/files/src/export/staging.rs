//! Several files that appear as one.
//!
//! All are written to a folder beside their places first, `.deltille-writing-…`, and brought to the
//! disk. Then the empty file `complete` is put to them: from there on they count as written. Then each
//! is moved to its place, and the folder goes.
//!
//! Whoever is killed before `complete` leaves the earlier files, and after it all of the new ones,
//! some of them perhaps still in the folder. [`settle`] finishes the one and removes the other; all
//! that write to a folder do so first, and so do those that read a target or a camera. The lock of the
//! folder keeps apart those who move files in it; the lock of the temporary folder tells one that is
//! written to from one that was left. Systems without locks for folders (Windows, some network
//! drives) have neither: there what is left stays, and two runs into one folder are not kept apart.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::atomic::{self, Unfinished};

/// Name of the file that says that all others are there.
const COMPLETE: &str = "complete";

/// Name of the folder within the temporary one that the files are in.
const FILES: &str = "files";

/// Files on their way to a folder. Dropped before [`commit`](Self::commit), nothing is left of them.
pub struct Staging {
    folder: PathBuf,
    /// Folders that were made for it, the innermost first; they go where they stay empty.
    made: Vec<PathBuf>,
    temporary: Option<TempDir>,
    unfinished: Option<Unfinished>,
    _lock: Option<File>,
}

impl Staging {
    /// Begins to write files to a folder, which is made where there is none.
    ///
    /// # Errors
    /// Where the folder cannot be made or written to.
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

    /// Where the files are written, each under its own name, with [`atomic::write`], which brings them to
    /// the disk.
    pub fn files(&self) -> PathBuf {
        self.temporary.as_ref().map(|temporary| temporary.path().join(FILES)).unwrap_or_default()
    }

    /// Moves all files to their places; a file whose content is there already is left as it is.
    ///
    /// # Errors
    /// Where a file cannot be moved.
    pub fn commit(mut self) -> io::Result<()> {
        let Some(temporary) = self.temporary.take() else { return Ok(()) };
        let files = temporary.path().join(FILES);
        let _alone = atomic::lock(&self.folder);
        settle_alone(&self.folder)?;
        let _moving = atomic::moving();
        for entry in fs::read_dir(&files)? {
            let staged = entry?;
            if same_content(&staged.path(), &self.folder.join(staged.file_name())) {
                fs::remove_file(staged.path())?;
            }
        }
        File::create_new(temporary.path().join(COMPLETE))?.sync_all()?;
        // From here on the files count as written, and the folder stays until all are moved.
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
            // Only a folder that is still empty goes.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Brings a folder to where killed runs would have brought it: what was complete is moved to its
/// places, what was not is removed. What living ones are writing stays.
///
/// # Errors
/// Where the folder cannot be read, or a file cannot be moved.
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
                "cannot finish what an earlier run left in {}: {error}; remove that folder, or move \
                 what is in {FILES} to its place",
                path.display()
            );
            io::Error::new(error.kind(), message)
        })?;
    }
    Ok(())
}

/// Moves complete files to their places. Whoever was killed may have done so, and have removed part of
/// the temporary folder.
fn finish(temporary: &Path, folder: &Path) -> io::Result<()> {
    let files = temporary.join(FILES);
    let names: Vec<OsString> = match fs::read_dir(&files) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        entries => entries?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<_>>()?,
    };
    let place = |name: &OsString| atomic::place(&folder.join(name));
    let places = names.iter().map(place).collect::<io::Result<Vec<_>>>()?;
    // Freeing what is replaced takes a file system a hundred times as long as a rename: it waits until
    // these are closed, after the last rename.
    let open = |place: &PathBuf| File::open(place).ok().filter(|_| cfg!(unix));
    let _replaced: Vec<File> = places.iter().filter_map(open).collect();
    for (name, place) in names.iter().zip(&places) {
        let staged = files.join(name);
        if fs::rename(&staged, place).is_err() {
            // A link may lead to another file system.
            let mut content = File::open(&staged)?;
            atomic::write(place, |out| io::copy(&mut content, out).map(|_| ()))
                .map_err(|error| error.source)?;
            fs::remove_file(&staged)?;
        }
    }
    atomic::sync_folder(folder);
    atomic::remove(temporary);
    Ok(())
}

/// What is being written to a folder, or was left there.
fn temporaries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| atomic::is_temporary(&entry.file_name().to_string_lossy()));
    named.map(|entry| entry.path()).collect()
}

/// Whether two files hold the same bytes.
pub fn same_content(one: &Path, other: &Path) -> bool {
    let length = |path: &Path| path.metadata().ok().map(|metadata| metadata.len());
    length(one) == length(other)
        && matches!((fs::read(one), fs::read(other)), (Ok(one), Ok(other)) if one == other)
}
