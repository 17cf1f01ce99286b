//! Cameras from files.

use std::path::{Path, PathBuf};

use deltille_core::camera::{Camera, CameraFile, CameraFileError};
use deltille_core::json;

use crate::export::saved::{self, SavedError};
use crate::export::{calibration, rig, staging};
use crate::limits::{Limits, ReadError};

/// Error of reading a camera.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraReadError {
    /// The leftovers of an interrupted run cannot be cleaned up.
    #[error(transparent)]
    Settle(std::io::Error),
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A file of another kind.
    #[error("{}: this is a {schema} file, not a camera: use the .yaml or .json that `deltille calibrate` wrote", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// Its schema.
        schema: String,
    },
    /// The file is not a valid calibration.
    #[error("{}: {error}", path.display())]
    Calibration {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: SavedError,
    },
    /// The calibration of a rig, which has several cameras.
    #[error("{}: this is a rig of {cameras} cameras: use the .yaml of one of them", path.display())]
    Rig {
        /// The file.
        path: PathBuf,
        /// Number of its cameras.
        cameras: usize,
    },
    /// The file is not a valid camera.
    #[error("{}: {error}", path.display())]
    Yaml {
        /// The file.
        path: PathBuf,
        /// The problem.
        error: CameraFileError,
    },
}

/// Reads the camera of a camera file; see [`read_with_targets`].
///
/// # Errors
/// Returns an error in the same cases.
pub fn read(path: &Path) -> Result<Camera, CameraReadError> {
    read_with_targets(path).map(|file| file.camera)
}

/// Reads a camera file of this program, OpenCV, ROS, Kalibr, COLMAP or mrcal, or the camera of a calibration (the .json beside
/// it). A name after a colon selects one of several cameras, as in `camchain.yaml:cam1`. Leftovers of killed runs in its
/// folder are cleaned up first.
///
/// # Errors
/// Returns an error if the file cannot be read, or does not contain a camera.
pub fn read_with_targets(path: &Path) -> Result<CameraFile, CameraReadError> {
    let (path, name) = split(path);
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    staging::settle(folder.unwrap_or(Path::new("."))).map_err(CameraReadError::Settle)?;
    let text = Limits::default().read_text(path)?;
    if let Ok(Some(schema)) = json::schema(text.as_bytes()) {
        return match [calibration::SCHEMA, rig::SCHEMA].contains(&schema.as_str()) {
            true => of_calibration(path, &text),
            false => Err(CameraReadError::Kind { path: path.to_owned(), schema }),
        };
    }
    let yaml = |error| CameraReadError::Yaml { path: path.to_owned(), error };
    CameraFile::named(&text, name).map_err(yaml)
}

/// Splits the name of a camera from the path of its file. A file whose name contains a colon is no such pair.
fn split(path: &Path) -> (&Path, Option<&str>) {
    match path.to_str().and_then(|text| text.rsplit_once(':')) {
        Some((file, name)) if !path.exists() && Path::new(file).is_file() => {
            (Path::new(file), Some(name))
        }
        _ => (path, None),
    }
}

/// The only camera of a calibration.
fn of_calibration(path: &Path, text: &str) -> Result<CameraFile, CameraReadError> {
    let wrong = |error| CameraReadError::Calibration { path: path.to_owned(), error };
    let mut found = saved::read_without_target(text).map_err(wrong)?;
    match (found.cameras.len(), found.cameras.pop()) {
        (1, Some(only)) => Ok(CameraFile {
            camera: only.camera,
            calibrated_with: found.calibrated_with,
            failed: saved::failures(text).into_iter().next(),
        }),
        (cameras, _) => Err(CameraReadError::Rig { path: path.to_owned(), cameras }),
    }
}
