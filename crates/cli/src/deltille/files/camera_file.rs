//! Cameras from files.

use std::path::Path;

use anyhow::{Context, anyhow};

use crate::output::tell;
use deltille::camera::{Camera, CameraFile};
use deltille::camera_file;
use deltille::export::saved;
use deltille::targets::{Target, TargetIdentity, check_same_board};
use deltille_core::words::shown;

/// Reads the camera file that an option names.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    read_with_targets(option, path).map(|file| file.camera)
}

/// Reads a camera file with the targets that the camera was calibrated with, and warns where its calibration failed.
pub fn read_with_targets(option: &str, path: &Path) -> anyhow::Result<CameraFile> {
    let file = camera_file::read_with_targets(path).context(option.to_owned())?;
    warn_of(path, file.failed.as_deref());
    Ok(file)
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

/// The same, or with `is_assumed` a note where it would be refused.
pub fn check_or_note(
    path: &Path,
    calibrated_with: &[TargetIdentity],
    targets: &[Target],
    is_assumed: bool,
) -> anyhow::Result<()> {
    match check_targets(path, calibrated_with, targets) {
        Err(_) if is_assumed => {
            let [seen, own] =
                [calibrated_with.first().cloned(), targets.first().map(Target::identity)].map(
                    |identity| identity.map_or(String::new(), |identity| identity.to_string()),
                );
            tell!(
                "note: --assume-target: {} was made with {seen}, taken for {own}",
                path.display()
            );
            Ok(())
        }
        checked => checked,
    }
}

/// Warns where the calibration whose text this is has failed, and says why it has.
pub fn warn_if_failed(path: &Path, text: &str) -> Option<String> {
    let failure = saved::failures(text).into_iter().next();
    warn_of(path, failure.as_deref());
    failure
}

fn warn_of(path: &Path, failure: Option<&str>) {
    if let Some(failure) = failure {
        tell!("warning: {}: the calibration failed: {}", path.display(), shown(failure));
    }
}

/// Reads a camera to be kept as it is in another calibration: refused where its own calibration failed.
pub fn read_to_keep(option: &str, path: &Path) -> anyhow::Result<CameraFile> {
    let file = camera_file::read_with_targets(path).context(option.to_owned())?;
    match &file.failed {
        Some(failed) => Err(anyhow!(
            "{option}: {}: its calibration failed: {}; calibrate the camera again",
            path.display(),
            shown(failed)
        )),
        None => Ok(file),
    }
}

/// Reads a camera file for these targets, see [`check_targets`]; with `is_assumed` it may be any camera's, which is noted.
pub fn read_for(
    option: &str,
    path: &Path,
    targets: &[Target],
    is_assumed: bool,
) -> anyhow::Result<Camera> {
    let CameraFile { camera, calibrated_with, .. } = read_with_targets(option, path)?;
    check_or_note(path, &calibrated_with, targets, is_assumed)?;
    Ok(camera)
}
