//! Poses in the form that all JSON files of this crate use.

use glam::{DMat3, DVec3};
use serde::Serialize;

use deltille_core::camera::Pose;

/// A pose with its standard deviations, in the form of the files.
#[derive(Serialize)]
pub(in crate::export) struct Motion {
    /// Row-major.
    rotation: [f64; 9],
    translation_mm: DVec3,
    /// Standard deviations of the rotation and the translation along the axes of the destination
    /// frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    rotation_sd_rad: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation_sd_mm: Option<[f64; 3]>,
}

impl Motion {
    pub(in crate::export) fn new(pose: &Pose, sd: Option<[f64; 6]>) -> Self {
        Self {
            rotation: DMat3::from_quat(pose.rotation).transpose().to_cols_array(),
            translation_mm: pose.translation,
            rotation_sd_rad: sd.map(|[a, b, c, ..]| [a, b, c]),
            translation_sd_mm: sd.map(|[.., a, b, c]| [a, b, c]),
        }
    }
}
