//! Cameras from files.

use std::path::Path;

use anyhow::{Context, bail};

use crate::camera::Camera;
use crate::json;

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    let show = || format!("{option}: {}", path.display());
    let text = std::fs::read_to_string(path).with_context(show)?;
    if let Ok(Some(schema)) = json::schema(text.as_bytes()) {
        bail!(
            "{}: this is a {schema} file, not a camera: give the .yaml that `deltille calibrate` wrote",
            show()
        );
    }
    Camera::from_yaml(&text).with_context(show)
}
