//! Uncertainties of poses, which calibrations of cameras and rigs have in common.

use serde::Serialize;

use deltille_calibrate::{Estimate, PoseSd, PoseUncertainty};

/// The uncertainty of the pose of a target at a distance from a camera.
#[derive(Serialize)]
pub(super) struct PoseUncertaintyRecord<'a> {
    /// The camera of a rig.
    #[serde(skip_serializing_if = "str::is_empty")]
    camera: &'a str,
    target: &'a str,
    distance_mm: f64,
    calibration: PoseSdRecord,
    per_px: PoseSdRecord,
}

#[derive(Serialize)]
struct PoseSdRecord {
    rotation_rad: f64,
    across_mm: f64,
    along_mm: f64,
}

impl PoseSdRecord {
    fn new(sd: PoseSd) -> Self {
        let PoseSd { rotation_rad, across_mm, along_mm, .. } = sd;
        Self { rotation_rad, across_mm, along_mm }
    }
}

pub(super) fn pose_uncertainties<'a>(
    found: &'a Estimate,
    poses: &'a [PoseUncertainty],
) -> Vec<PoseUncertaintyRecord<'a>> {
    let records = poses.iter().map(|of| PoseUncertaintyRecord {
        camera: found.camera_name(of.camera).unwrap_or_default(),
        target: &of.target,
        distance_mm: of.distance_mm,
        calibration: PoseSdRecord::new(of.calibration),
        per_px: PoseSdRecord::new(of.per_px),
    });
    records.collect()
}
