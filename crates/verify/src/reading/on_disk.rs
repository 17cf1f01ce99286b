//! Files on disk, which are read within the limits.

use std::path::Path;
use std::sync::Arc;

use crate::reading::error::DocumentError;
use crate::reading::reader::Files;
use deltille_files::limits::Limits;

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
