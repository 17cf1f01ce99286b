//! Writes text files.

use std::path::PathBuf;

use deltille::export::artifacts::write_set;
use pyo3::prelude::*;

use super::errors::{self, RaiseFile, raised};

/// Writes a text file atomically.
pub fn save_text(path: PathBuf, text: String, overwrite: bool) -> PyResult<PathBuf> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(std::path::Path::new(".")).to_owned();
    let Some(name) = path.file_name() else {
        return Err(raised::FileError::new_err(format!("{} is not a file name", path.display())));
    };
    let files = [(name.to_string_lossy().into_owned(), text.into_bytes())];
    write_set(&folder, &files, overwrite).raise_of_file(&path, errors::file)?;
    Ok(path)
}
