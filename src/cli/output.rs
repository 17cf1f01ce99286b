//! Where a command's one file goes, and how it gets there whole.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;

/// The file that `-o` means: itself when it ends in the extension, else `<stem>.<extension>` in
/// that folder.
pub fn file(output: &Path, stem: &str, extension: &str) -> PathBuf {
    if output.extension().is_some_and(|e| e == extension) {
        output.to_owned()
    } else {
        output.join(format!("{stem}.{extension}"))
    }
}

/// Prints a result; a reader that has gone away (`| head`) is not an error.
pub fn print(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Writes a file under a temporary name beside it, then renames it.
pub fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let write = || -> anyhow::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        file.write_all(content)?;
        make_readable(file.as_file())?;
        file.persist(path)?;
        Ok(())
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

/// Temporary files are made for the owner only; a result is for everybody.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}
