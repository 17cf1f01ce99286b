//! Camera files.

use std::path::Path;

use anyhow::{Context, anyhow};

use crate::output::{detail, log};
use deltille::calibrate::{CameraEstimate, Estimate};
use deltille::camera::{Camera, CameraFile};
use deltille::camera_file;
use deltille::export::saved;
use deltille::limits::Limits;
use deltille::targets::{Target, TargetIdentity, check_same_board};
use deltille_core::words::shown;

/// Reads the camera file given by an option.
pub fn read(option: &str, path: &Path) -> anyhow::Result<Camera> {
    read_with_targets(option, path).map(|file| file.camera)
}

/// Reads a camera file with the targets of its calibration, and warns if the calibration failed.
pub fn read_with_targets(option: &str, path: &Path) -> anyhow::Result<CameraFile> {
    let file = camera_file::read_with_targets(path).context(option.to_owned())?;
    warn_of(path, file.failed.as_deref());
    let Camera { width, height, .. } = file.camera;
    detail!("read {}: a camera of {width} × {height} px", path.display());
    Ok(file)
}

/// Rejects a camera that was calibrated with a target of the same tags at another size.
pub fn check_targets(
    path: &Path,
    calibrated_with: &[TargetIdentity],
    targets: &[Target],
) -> anyhow::Result<()> {
    let own: Vec<TargetIdentity> = targets.iter().map(Target::identity).collect();
    let camera = path.display().to_string();
    check_same_board([&camera, "--target"], [calibrated_with, &own]).map_err(|problem| {
        anyhow!("{problem}; use that target's description, or --assume-target to use this one")
    })
}

/// Calls [`check_targets`]; with `is_assumed`, prints a note instead of failing.
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
            log!(
                "note: --assume-target: {} was made with {seen}, assumed to be {own}",
                path.display()
            );
            Ok(())
        }
        checked => checked,
    }
}

/// Warns if the calibration in `text` failed; returns the reason.
pub fn warn_if_failed(path: &Path, text: &str) -> Option<String> {
    let failure = saved::failures(text).into_iter().next();
    warn_of(path, failure.as_deref());
    failure
}

fn warn_of(path: &Path, failure: Option<&str>) {
    if let Some(failure) = failure {
        log!("warning: {}: the calibration failed: {}", path.display(), shown(failure));
    }
}

/// Reads a calibration, the .json of `calibrate` or `rig`, or a camera file; without uncertainties if it failed.
pub fn read_estimate(option: &str, path: &Path) -> anyhow::Result<Estimate> {
    read_calibration(option, path).map(|(estimate, _)| estimate)
}

/// Like [`read_estimate`], with the reason why the calibration failed, if it did.
pub fn read_calibration(option: &str, path: &Path) -> anyhow::Result<(Estimate, Option<String>)> {
    if !path.extension().is_some_and(|end| end.eq_ignore_ascii_case("json")) {
        let file = read_with_targets(option, path)?;
        let mut estimate = Estimate::default();
        estimate.cameras = vec![CameraEstimate::given("", file.camera)];
        estimate.calibrated_with = file.calibrated_with;
        return Ok((estimate, file.failed));
    }
    let text = Limits::default().read_text(path).context(option.to_owned())?;
    let mut estimate = saved::read_without_target(&text)
        .with_context(|| format!("{option}: {}", path.display()))?;
    let failed = warn_if_failed(path, &text);
    if failed.is_some() {
        estimate.cameras.iter_mut().for_each(CameraEstimate::forget_uncertainties);
    }
    Ok((estimate, failed))
}

/// Reads a camera to be fixed in another calibration; fails if its own calibration failed.
pub fn read_to_keep(option: &str, path: &Path) -> anyhow::Result<CameraFile> {
    let file = camera_file::read_with_targets(path).context(option.to_owned())?;
    match &file.failed {
        Some(failed) => Err(anyhow!(
            "{option}: {}: the calibration failed: {}; calibrate the camera again",
            path.display(),
            shown(failed)
        )),
        None => Ok(file),
    }
}

/// Reads a camera file for these targets, see [`check_targets`]; with `is_assumed`, a mismatch causes only a note.
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
