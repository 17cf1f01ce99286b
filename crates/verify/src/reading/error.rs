//! Reasons why an artifact cannot be read.

use std::path::{Path, PathBuf};

use deltille_files::limits::ReadError;

/// The reason why an artifact cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DocumentError {
    /// The file cannot be opened.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file that belongs to the artifact is not among those in memory.
    #[error("{}: not among the given files", path.display())]
    Absent {
        /// The file.
        path: PathBuf,
    },
    /// The file does not have the format of its extension, states no physical size, or exceeds the
    /// [`Limits`](deltille_files::limits::Limits).
    #[error("{}: {problem}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
}

impl DocumentError {
    /// Creates an error about the content of a file.
    pub(crate) fn unreadable(path: &Path, problem: impl Into<String>) -> Self {
        Self::Unreadable { path: path.to_owned(), problem: problem.into() }
    }
}
