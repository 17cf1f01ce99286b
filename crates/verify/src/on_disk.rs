//! Verification of artifacts on disk: files are read within the limits, and third-party code runs
//! on a thread with a time limit; the rest is as for artifacts in memory.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::reader::{Files, Reader};
use super::{Document, DocumentError, Format, Verdict, Verifier, VerifyError};
use deltille_files::limits::{Guard, Limits};

/// The files on disk, read within limits.
struct OnDisk(Limits);

impl Files for OnDisk {
    fn has(&self, path: &Path) -> bool {
        path.exists()
    }

    fn read(&self, path: &Path) -> Result<Arc<Vec<u8>>, DocumentError> {
        Ok(Arc::new(self.0.read(path)?))
    }
}

impl Document {
    /// Opens a `.pdf`, `.svg` or `.png` file within the default limits.
    ///
    /// # Errors
    /// When the file cannot be read, is not of the format of its extension, or exceeds a limit.
    pub fn open(path: &Path) -> Result<Self, DocumentError> {
        Self::open_within(path, &Limits::default())
    }

    /// Opens a `.pdf`, `.svg` or `.png` file within other limits than the default.
    ///
    /// # Errors
    /// When the file cannot be read, is not of the format of its extension, or exceeds a limit.
    pub fn open_within(path: &Path, limits: &Limits) -> Result<Self, DocumentError> {
        let files = OnDisk(*limits);
        Self::read_by(&Reader { files: &files, limits: *limits, guard: Guard::Timed }, path)
    }
}

impl Verifier<'_> {
    /// Reads an artifact from disk, with the files beside it that belong to it, and compares it as
    /// [`verify`](Self::verify) does. Third-party readers run on a thread of their own, for at most
    /// [`Limits::max_seconds`] in each step.
    ///
    /// # Errors
    /// When the name tells no format or sheet, or a file is missing or cannot be read at all.
    pub fn verify_path(&self, path: &Path) -> Result<Verdict, VerifyError> {
        let files = OnDisk(self.limits);
        self.verify_by(&Reader { files: &files, limits: self.limits, guard: Guard::Timed }, path)
    }

    /// Verdicts on sets of pages that `named` does not name completely. A single page may be named
    /// alone if it can be verified by itself and `alone` is set; pages of a net are always
    /// completed by [`set_of`](Self::set_of).
    pub fn left_out(&self, named: &[PathBuf], alone: bool) -> Vec<Verdict> {
        // A folder may be named in several ways.
        let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let named: Vec<PathBuf> = named.iter().map(absolute).collect();
        let sets: BTreeSet<Vec<PathBuf>> = named.iter().map(|path| self.pages_with(path)).collect();
        let mut verdicts = Vec::new();
        for pages in sets {
            let verified_together = self.set_of(&pages[0]).len() > 1;
            let missing: Vec<&PathBuf> =
                pages.iter().filter(|page| !named.contains(page)).collect();
            let single = alone && missing.len() + 1 == pages.len();
            if let Some(format) = Format::of(&pages[0])
                && !(verified_together || single || missing.is_empty())
            {
                verdicts.push(Self::without(&pages, format, &missing));
            }
        }
        verdicts
    }
}
