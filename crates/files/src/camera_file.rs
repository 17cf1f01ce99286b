//! Cameras from files.

use std::path::{Path, PathBuf};

use deltille_core::camera::{Camera, CameraFile, CameraFileError};
use deltille_core::json;

use crate::export::staging;
use crate::limits::{Limits, MAX_SETTINGS_BYTES, ReadError};

/// Why a camera cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraReadError {
    /// What an interrupted run has left cannot be put in order.
    #[error(transparent)]
    Settle(std::io::Error),
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file of another kind.
    #[error("{}: this is a {schema} file, not a camera: give the .yaml that `deltille calibrate` wrote", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// Its schema.
        schema: String,
    },
    /// The file is no camera.
    #[error("{}: {error}", path.display())]
    Yaml {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        error: CameraFileError,
    },
}

/// Reads the camera of a camera file, see [`read_with_targets`].
///
/// # Errors
/// The same.
pub fn read(path: &Path) -> Result<Camera, CameraReadError> {
    read_with_targets(path).map(|file| file.camera)
}

/// Reads a camera file: one of ours, of ROS or OpenCV. What killed runs have left in its folder is put in order before.
///
/// # Errors
/// Where the file cannot be read, or holds no camera.
pub fn read_with_targets(path: &Path) -> Result<CameraFile, CameraReadError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    staging::settle(folder.unwrap_or(Path::new("."))).map_err(CameraReadError::Settle)?;
    let text = Limits::default().read_text(path)?;
    if let Ok(Some(schema)) = json::schema(text.as_bytes()) {
        return Err(CameraReadError::Kind { path: path.to_owned(), schema });
    }
    if text.len() > MAX_SETTINGS_BYTES {
        return Err(ReadError::TooLong { path: path.to_owned(), most: MAX_SETTINGS_BYTES }.into());
    }
    let yaml = |error| CameraReadError::Yaml { path: path.to_owned(), error };
    CameraFile::from_yaml(&text).map_err(yaml)
}
