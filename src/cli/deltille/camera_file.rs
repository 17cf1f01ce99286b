//! Cameras from files.

use std::path::Path;

use anyhow::{Context, anyhow};

use crate::camera::{Camera, CameraFile};
use crate::camera_file;
use crate::cli::output::tell;
use crate::export::saved;
use crate::targets::{Target, TargetIdentity, check_same_board};

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    camera_file::read(path).context(option.to_owned())
}

/// Reads a camera file with the targets that the camera was calibrated with.
pub fn read_with_targets(option: &str, path: &Path) -> anyhow::Result<CameraFile> {
    camera_file::read_with_targets(path).context(option.to_owned())
}

/// Refuses a camera that was calibrated with a target that has the tags of one of these at another size.
pub fn check_targets(
    path: &Path,
    calibrated_with: &[TargetIdentity],
    targets: &[Target],
) -> anyhow::Result<()> {
    let own: Vec<TargetIdentity> = targets.iter().map(Target::identity).collect();
    let camera = path.display().to_string();
    check_same_board([&camera, "--target"], [calibrated_with, &own]).map_err(|problem| {
        anyhow!("{problem}; give its description, or --assume-target to use this one")
    })
}

/// Warns where the calibration whose text this is has failed, and says whether it has.
pub fn warn_if_failed(path: &Path, text: &str) -> bool {
    let failures = saved::failures(text);
    if let Some(failure) = failures.first() {
        tell!("warning: {}: the calibration failed: {failure}", path.display());
    }
    !failures.is_empty()
}

/// Reads a camera file for these targets, see [`check_targets`]; with `is_assumed` it may be any camera's.
pub fn read_for(
    option: &str,
    path: &Path,
    targets: &[Target],
    is_assumed: bool,
) -> anyhow::Result<Camera> {
    let CameraFile { camera, calibrated_with } = read_with_targets(option, path)?;
    if !is_assumed {
        check_targets(path, &calibrated_with, targets)?;
    }
    Ok(camera)
}
