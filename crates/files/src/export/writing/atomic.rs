//! Atomic writing: files appear completely or not at all.
//!
//! A file is written under a temporary name in the same folder, flushed to the disk, and renamed. Its writer keeps a lock on it, so
//! the next process recognises and removes the leftovers of a killed one; see [`settle`](super::staging::settle).

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Prefix of temporary names, and number of random characters after it.
const PREFIX: &str = ".deltille-writing-";
const RANDOM: usize = 6;

/// Temporary files and folders of this process.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Locked while a set of files is moved to its final paths.
static MOVING: Mutex<()> = Mutex::new(());

/// Error of writing a file.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {source}", path = path.display())]
pub struct WriteError {
    /// The requested file.
    pub path: PathBuf,
    /// The error of the operating system.
    pub source: io::Error,
}

/// Writes a file through `fill` under a temporary name in the same folder, and renames it to `path` when all content is on the disk.
/// After an error, nothing is left behind, and an earlier file is unchanged. A symbolic link is replaced, and its destination is
/// unchanged; a device or a pipe is refused.
///
/// # Errors
/// Returns an error if `fill` fails, or if the file cannot be written.
pub fn write(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |source| WriteError { path: path.to_owned(), source };
    Filled::new(path, fill).and_then(Filled::rename).map_err(failed)
}

/// Writes several files like [`write()`]. They are renamed after all are on the disk under temporary names: if one cannot be
/// written, none is.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write_together(files: &[(PathBuf, Vec<u8>)]) -> Result<(), WriteError> {
    let failed = |path: &Path, source| WriteError { path: path.to_owned(), source };
    let fill = |(path, content): &(PathBuf, Vec<u8>)| {
        Filled::new(path, |out| out.write_all(content)).map_err(|source| failed(path, source))
    };
    let filled: Vec<Filled> = files.iter().map(fill).collect::<Result<_, _>>()?;
    filled
        .into_iter()
        .zip(files)
        .try_for_each(|(filled, (path, _))| filled.rename().map_err(|source| failed(path, source)))
}

/// A file that is completely written under a temporary name.
struct Filled {
    file: tempfile::NamedTempFile,
    path: PathBuf,
    _unfinished: Unfinished,
}

impl Filled {
    fn new(path: &Path, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<Self> {
        Self::written(path, fill).map_err(|error| match error.to_string().contains(PREFIX) {
            true => without_path(&error),
            false => error,
        })
    }

    fn written(
        path: &Path,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<Self> {
        check_place(path)?;
        if path.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "a folder has this name"));
        }
        let (file, unfinished) = temporary_file(folder_of(path))?;
        let mut writer = BufWriter::new(file);
        fill(&mut writer)?;
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.as_file().sync_all()?;
        Ok(Self { file, path: path.to_owned(), _unfinished: unfinished })
    }

    fn rename(self) -> io::Result<()> {
        self.file.persist(&self.path).map_err(|error| error.error)?;
        sync_folder(folder_of(&self.path));
        Ok(())
    }
}

/// An error without the path of a temporary file, which the user does not know.
fn without_path(error: &io::Error) -> io::Error {
    error.kind().into()
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A temporary file in a folder, locked.
fn temporary_file(folder: &Path) -> io::Result<(tempfile::NamedTempFile, Unfinished)> {
    if !folder.is_dir() {
        let message = format!("{} is not a folder", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, message));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        // The umask determines the permissions, as for any new file.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    Unfinished::begin(|| {
        let file = builder.tempfile_in(folder)?;
        // If files cannot be locked, leftovers are never removed.
        let _ = file.as_file().lock();
        let path = file.path().to_owned();
        Ok((file, path))
    })
}

/// A temporary file or folder, registered while it is written, so [`abandon`] can remove it.
pub(in crate::export) struct Unfinished(PathBuf);

impl Unfinished {
    /// Creates and registers a temporary file or folder. If another process removes it before it is locked, it is created again.
    pub(in crate::export) fn begin<T>(
        mut make: impl FnMut() -> io::Result<(T, PathBuf)>,
    ) -> io::Result<(T, Self)> {
        let mut unfinished = unfinished();
        loop {
            let (made, path) = make()?;
            if path.exists() {
                unfinished.push(path.clone());
                return Ok((made, Self(path)));
            }
        }
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// The registered temporary files and folders; while the guard exists, none is created.
fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes [`abandon`] wait while the guard exists.
pub(in crate::export) fn moving() -> MutexGuard<'static, ()> {
    MOVING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files and folders of this process, and prevents new ones while the result
/// exists: for a program that is about to end. A set of files that is being moved to its final paths
/// is completed first.
#[must_use]
pub fn abandon() -> impl Sized {
    let (moving, unfinished) = (moving(), unfinished());
    for path in unfinished.iter() {
        remove(path);
    }
    (moving, unfinished)
}

/// Removes a file or folder; if that fails, the next run removes it.
pub(in crate::export) fn remove(path: &Path) {
    let _ = match path.is_dir() {
        true => std::fs::remove_dir_all(path),
        false => std::fs::remove_file(path),
    };
}

/// Creates a locked temporary folder.
pub(in crate::export) fn temporary_folder(
    folder: &Path,
) -> io::Result<(tempfile::TempDir, Option<File>)> {
    let made = tempfile::Builder::new().prefix(PREFIX).rand_bytes(RANDOM).tempdir_in(folder);
    let made = made.map_err(|error| without_path(&error))?;
    let lock = lock(made.path());
    Ok((made, lock))
}

/// Whether a name belongs to a temporary file or folder.
pub(in crate::export) fn is_temporary(name: &str) -> bool {
    let random = name.strip_prefix(PREFIX);
    random.is_some_and(|r| r.len() == RANDOM && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Waits for the lock of a file or folder, which lasts until the result is dropped; `None` if the
/// system does not support it.
pub(in crate::export) fn lock(path: &Path) -> Option<File> {
    File::open(path).ok().filter(|file| file.lock().is_ok())
}

/// Takes the lock of a file or folder unless a running process has it.
pub(in crate::export) fn lock_of_left(path: &Path) -> Option<File> {
    File::open(path).ok().filter(|file| file.try_lock().is_ok())
}

/// Flushes the directory entries of a folder to the disk, if the system supports it.
pub(in crate::export) fn sync_folder(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// Checks that a write to `path` would replace only a file, or a symbolic link itself. For a
/// folder, the write itself fails.
///
/// # Errors
/// Returns an error if the path is a device or a pipe, or leads to one.
pub fn check_place(path: &Path) -> io::Result<()> {
    match path.metadata() {
        Ok(there) if !there.is_file() && !there.is_dir() => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a device or a pipe, not a file"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn links_are_replaced_and_pipes_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("real"), "old").unwrap();
        std::os::unix::fs::symlink("real", path("link")).unwrap();
        std::os::unix::fs::symlink("nowhere", path("dangling")).unwrap();
        std::os::unix::net::UnixListener::bind(path("socket")).unwrap();
        std::os::unix::fs::symlink("socket", path("to-socket")).unwrap();
        let new = |name: &str| write(&path(name), |out| out.write_all(b"new"));
        for link in ["link", "dangling"] {
            new(link).unwrap();
            assert!(!path(link).is_symlink());
            assert_eq!(std::fs::read(path(link)).unwrap(), b"new");
        }
        assert_eq!(std::fs::read(path("real")).unwrap(), b"old");
        assert!(!path("nowhere").exists());
        for pipe in ["socket", "to-socket"] {
            assert!(new(pipe).unwrap_err().to_string().contains("not a file"));
        }
    }

    #[test]
    fn several_files_are_written_together_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let files =
            |second: &str| [path("a"), path(second)].map(|path| (path, b"new".to_vec())).to_vec();
        std::fs::write(path("a"), "old").unwrap();
        write_together(&files("none/b")).unwrap_err();
        assert_eq!(std::fs::read(path("a")).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write_together(&files("b")).unwrap();
        assert_eq!(["a", "b"].map(|name| std::fs::read(path(name)).unwrap()), [b"new", b"new"]);
    }

    #[test]
    fn a_failed_write_leaves_the_earlier_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write(&path, |w| w.write_all(b"first")).unwrap();
        write(&path, |w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        })
        .unwrap_err();
        assert_eq!(std::fs::read(&path).unwrap(), b"first");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("nowhere/a.txt");
        let message = write(&path, |_| Ok(())).unwrap_err().to_string();
        assert!(message.contains("nowhere is not a folder"), "{message}");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn errors_do_not_name_temporary_files() {
        let folder = Path::new("/proc");
        let of_set = temporary_folder(folder).unwrap_err().to_string();
        let of_file = write(&folder.join("a.json"), |_| Ok(())).unwrap_err().to_string();
        assert!(of_file.starts_with("cannot write /proc/a.json: "), "{of_file}");
        assert!(!(of_set + &of_file).contains(PREFIX));
    }
}
