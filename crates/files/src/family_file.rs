//! Tag families by name or from family files.

use std::path::{Path, PathBuf};

use deltille_core::family::{Family, FamilyError};

use crate::limits::{self, MAX_FAMILY_BYTES, ReadError};

/// Error of reading a family.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyFileError {
    /// No shipped family has this name.
    #[error(transparent)]
    Name(FamilyError),
    /// The file cannot be read.
    #[error(transparent)]
    Read(ReadError),
    /// The file is not UTF-8 text.
    #[error("{}: not a family file (not UTF-8 text); use a .json family file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
    },
    /// The content of the file is not a valid family.
    #[error("{}: {error}", path.display())]
    In {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: FamilyError,
    },
}

impl FamilyFileError {
    /// Whether the file was read completely, but its claims (codes, distance, fingerprint) are false.
    pub fn is_broken_claim(&self) -> bool {
        matches!(self, Self::In { error, .. } if error.is_broken_claim())
    }
}

/// Returns a shipped family by its name, or reads a family file by its path.
///
/// # Errors
/// Returns an error if no family of that name is shipped and no such file exists, or if the file is not a
/// valid family.
pub fn resolve(name_or_path: &str) -> Result<Family, FamilyFileError> {
    match Family::shipped(name_or_path) {
        Err(FamilyError::Unknown { name, shipped }) => {
            let path = Path::new(name_or_path);
            if path.extension().is_some_and(|e| e == "json") || path.exists() {
                return read(path);
            }
            Err(FamilyFileError::Name(FamilyError::Unknown { name, shipped }))
        }
        shipped => shipped.map_err(FamilyFileError::Name),
    }
}

/// Reads a family file.
///
/// # Errors
/// Returns an error if the file cannot be read or is not a valid family.
pub fn read(path: &Path) -> Result<Family, FamilyFileError> {
    let json = match limits::read_short_text(path, MAX_FAMILY_BYTES) {
        Err(ReadError::NotText { path }) => return Err(FamilyFileError::NotText { path }),
        json => json.map_err(FamilyFileError::Read)?,
    };
    Family::from_json(&json).map_err(|error| FamilyFileError::In { path: path.to_owned(), error })
}
