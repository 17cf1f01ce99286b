//! Cameras from files.

use std::path::Path;

use anyhow::Context;

use crate::camera::Camera;

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    let show = || format!("{option}: {}", path.display());
    let text = std::fs::read_to_string(path).with_context(show)?;
    Camera::from_yaml(&text).with_context(show)
}
