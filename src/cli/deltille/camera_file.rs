//! Cameras from files.

use std::path::Path;

use anyhow::{Context, bail};

use crate::camera::Camera;
use crate::cli::output;
use crate::json;
use crate::limits::{Limits, MAX_SETTINGS_BYTES, ReadError};

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    let show = || format!("{option}: {}", path.display());
    output::settle(output::folder_of(path)).context(option.to_owned())?;
    let text = Limits::default().read_text(path).with_context(|| option.to_owned())?;
    if let Ok(Some(schema)) = json::schema(text.as_bytes()) {
        bail!(
            "{}: this is a {schema} file, not a camera: give the .yaml that `deltille calibrate` wrote",
            show()
        );
    }
    if text.len() > MAX_SETTINGS_BYTES {
        let error = ReadError::TooLong { path: path.to_owned(), most: MAX_SETTINGS_BYTES };
        return Err(error).with_context(|| option.to_owned());
    }
    Camera::from_yaml(&text).with_context(show)
}
