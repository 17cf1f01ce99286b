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
    /// A file with this name, such as `board-2.svg`, and these bytes.
    pub fn new(name: impl Into<String>, bytes: impl Into<Vec<u8>>) -> Self {
        Self { name: name.into(), bytes: Arc::new(bytes.into()) }
    }

    /// A file whose bytes are shared.
    pub(crate) fn of(name: String, bytes: Arc<Vec<u8>>) -> Self {
        Self { name, bytes }
    }

    /// The name, whose extension tells the format and whose number tells the page.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The content.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// Files, by name.
pub(crate) trait Files {
    /// Whether there is such a file.
    fn has(&self, path: &Path) -> bool;

    /// The bytes of a file; an error where there is none, or it is not to be read.
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

/// The files on disk, read within limits.
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
    /// Whether there is such a file.
    pub(crate) fn has(&self, path: &Path) -> bool {
        self.files.has(path)
    }

    /// The bytes of a file.
    pub(crate) fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError> {
        self.files.read(path)
    }

    /// The text of a file.
    pub(crate) fn read_text(&self, path: &Path) -> Result<String, DocumentError> {
        let text = String::from_utf8(Arc::unwrap_or_clone(self.read(path)?));
        text.map_err(|_| ReadError::NotText { path: path.to_owned() }.into())
    }

    /// Runs third-party code on the file of that name; it may panic, or never end.
    pub(crate) fn run<T: Send + 'static>(
        &self,
        path: &Path,
        work: impl FnOnce() -> Result<T, String> + Send + 'static,
    ) -> Result<T, DocumentError> {
        run(path, &self.limits, self.guard, work)
    }
}

/// Runs third-party code on the file of that name.
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
