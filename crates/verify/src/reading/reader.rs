//! Sources of artifacts, in memory or on disk, and how they are read.

use std::path::Path;
use std::sync::Arc;

use crate::reading::error::DocumentError;
use deltille_files::limits::{Broken, Guard, Kind, Limits, ReadError};

/// A file in memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Artifact {
    name: String,
    bytes: Arc<Vec<u8>>,
}

impl Artifact {
    /// Creates a file with a name, such as `board-2.svg`, and its content.
    pub fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: Arc::new(bytes.into()) }
    }

    /// Creates a file that shares its bytes.
    pub(crate) fn of(name: String, bytes: Arc<Vec<u8>>) -> Self {
        Self { name, bytes }
    }

    /// The file name: its extension gives the format, its number the page.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The content.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Files by name.
pub(crate) trait Files {
    /// Whether the file exists.
    fn has(&self, path: &Path) -> bool;

    /// Returns the bytes of a file, or an error if it is missing or exceeds a limit.
    fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError>;
}

/// Files in memory.
impl Files for &[Artifact] {
    fn has(&self, path: &Path) -> bool {
        self.iter().any(|artifact| Path::new(&artifact.name) == path)
    }

    fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError> {
        let found = self.iter().find(|artifact| Path::new(&artifact.name) == path);
        let absent = || DocumentError::Absent { path: path.to_owned() };
        Ok(Arc::clone(&found.ok_or_else(absent)?.bytes))
    }
}

/// Files on disk, read within limits.
pub(crate) struct OnDisk(pub(crate) Limits);

impl Files for OnDisk {
    fn has(&self, path: &Path) -> bool {
        path.exists()
    }

    fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError> {
        Ok(Arc::new(self.0.read(path)?))
    }
}

/// Reads files within limits.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a> {
    pub files: &'a dyn Files,
    pub limits: Limits,
    pub guard: Guard,
}

impl Reader<'_> {
    /// Whether the file exists.
    pub(crate) fn has(&self, path: &Path) -> bool {
        self.files.has(path)
    }

    /// Returns the bytes of a file.
    pub(crate) fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError> {
        self.files.read(path)
    }

    /// Returns the text of a file.
    pub(crate) fn read_text(&self, path: &Path) -> Result<String, DocumentError> {
        let text = String::from_utf8(Arc::unwrap_or_clone(self.read(path)?));
        text.map_err(|_| ReadError::NotText { path: path.to_owned() }.into())
    }

    /// Runs third-party code, which may panic or never end, on the file with this name.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        path: &Path,
        work: impl FnOnce() -> Result<T, String> + Send + 'static,
    ) -> Result<T, DocumentError> {
        run(path, &self.limits, self.guard, work)
    }
}

/// Runs third-party code on the file with this name.
pub(crate) fn run<T: Send + 'static>(
    path: &Path,
    limits: &Limits,
    guard: Guard,
    work: impl FnOnce() -> Result<T, String> + Send + 'static,
) -> Result<T, DocumentError> {
    let problem = match guard.run(limits.time(), work) {
        Ok(Ok(result)) => return Ok(result),
        Ok(Err(problem)) => problem,
        Err(Broken::Time) => limits.exceeded(Kind::Seconds).to_string(),
        Err(broken) => broken.to_string(),
    };
    Err(DocumentError::unreadable(path, problem))
}
