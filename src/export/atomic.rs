//! Files that appear whole or not at all.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {path}: {source}", path = path.display())]
pub struct WriteError {
    /// The file asked for.
    pub path: PathBuf,
    /// Why.
    pub source: io::Error,
}

/// Writes a file through `fill`: to a temporary name in the same folder, renamed to `path` once
/// everything is written. On an error nothing is left behind, and an earlier file stays as it was. Where
/// `path` is a symbolic link, what it points to is written; a device or a pipe is refused.
pub fn write(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    fill_and_rename(path, fill).map_err(|source| WriteError { path: path.to_owned(), source })
}

fn fill_and_rename(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let path = &place(path)?;
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        let message = format!("{} is not a folder", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, message));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".deltille-");
    #[cfg(unix)]
    {
        // The umask decides, as for any file that a program creates.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|error| {
        // The temporary name means nothing to the user.
        io::Error::new(error.kind(), std::io::Error::from(error.kind()).to_string())
    })?;
    let mut writer = BufWriter::new(file);
    fill(&mut writer)?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}

/// The file that a path stands for, which a renamed one may take the place of.
pub fn place(path: &Path) -> io::Result<PathBuf> {
    match path.symlink_metadata() {
        Err(_) => Ok(path.to_owned()),
        Ok(link) if link.is_symlink() => {
            let to = path.canonicalize().map_err(|error| {
                io::Error::new(error.kind(), "it is a symbolic link to nothing")
            })?;
            place(&to)
        }
        Ok(there) if there.is_file() || there.is_dir() => Ok(path.to_owned()),
        Ok(_) => {
            Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a device or a pipe, no file"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_pipes_pipes() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("real"), "old").unwrap();
        std::os::unix::fs::symlink("real", path("link")).unwrap();
        std::os::unix::fs::symlink("nowhere", path("dangling")).unwrap();
        std::os::unix::net::UnixListener::bind(path("socket")).unwrap();
        let new = |name: &str| write(&path(name), |out| out.write_all(b"new"));
        new("link").unwrap();
        assert_eq!(std::fs::read(path("real")).unwrap(), b"new");
        assert!(path("link").is_symlink());
        assert!(new("dangling").unwrap_err().to_string().contains("link to nothing"));
        assert!(new("socket").unwrap_err().to_string().contains("no file"));
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
}
