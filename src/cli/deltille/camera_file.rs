//! Cameras from files.

use std::path::Path;

use anyhow::Context;

use crate::camera::Camera;
use crate::camera_file;

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    camera_file::read(path).context(option.to_owned())
}
