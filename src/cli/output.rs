//! Where a command's one file goes, and how it gets there whole.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;

use crate::export::atomic;

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

/// Writes a file whole or not at all, making its folder where there is none.
pub fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    Ok(atomic::write(path, |file| file.write_all(content))?)
}
