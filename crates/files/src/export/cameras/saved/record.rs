//! The structure of the JSON of calibrations, as it is read.

use glam::{DMat3, DQuat, DVec3};
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use super::super::constraint::ConstraintRecord;
use super::super::sheet::StoredShape;
use deltille_calibrate::SHAPE_COEFFICIENTS as COUNT;
use deltille_core::camera::{Pose, SplineGrid, is_rotation};
use deltille_core::quantity;
use deltille_core::targets::TargetIdentity;

#[derive(Deserialize)]
pub(super) struct Single {
    #[serde(flatten)]
    pub(super) camera: SavedCamera,
    #[serde(flatten)]
    pub(super) fit: Fit,
    pub(super) held_out: Option<SingleHeldOut>,
}

#[derive(Deserialize)]
pub(super) struct SingleHeldOut {
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) views: Vec<SavedView>,
    pub(super) excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
pub(super) struct Rig {
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: Option<f64>,
    #[serde(default)]
    pub(super) targets: Vec<SavedTarget>,
    pub(super) cameras: Vec<SavedCamera>,
    /// Absent in files written up to 2026-11-28.
    pub(super) joint: Option<SavedJoint>,
    pub(super) frames: Vec<SavedFrame>,
    #[serde(flatten)]
    pub(super) fit: Fit,
    pub(super) held_out: Option<RigHeldOut>,
}

/// One of several targets.
#[derive(Deserialize)]
pub(super) struct SavedTarget {
    pub(super) name: String,
    pub(super) panels: usize,
    pub(super) scene_from_target: SavedPose,
}

#[derive(Deserialize)]
pub(super) struct RigHeldOut {
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) cameras: Vec<SavedSeen>,
    pub(super) frames: Vec<SavedFrame>,
    pub(super) excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
pub(super) struct SavedSeen {
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) views: Vec<SavedView>,
}

/// The fields about the whole fit that both kinds of files have.
#[derive(Deserialize)]
pub(super) struct Fit {
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) sigma: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) common_px: Option<f64>,
    #[serde(default)]
    pub(super) calibrated_with: Vec<TargetIdentity>,
    pub(super) board_shape: Option<SavedShape>,
    pub(super) target_map: Option<SavedMap>,
    pub(super) excluded: Vec<SavedExcluded>,
}

#[derive(Deserialize)]
pub(super) struct SavedCamera {
    #[serde(default)]
    pub(super) name: String,
    pub(super) model: String,
    pub(super) width: u32,
    pub(super) height: u32,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) spline: Option<SplineGrid>,
    pub(super) parameters: Vec<SavedParameter>,
    #[serde(default)]
    pub(super) constraints: Vec<ConstraintRecord>,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) correlations: Vec<Vec<f64>>,
    #[serde(alias = "loose")]
    pub(super) ill_conditioned: Vec<String>,
    pub(super) projection: Option<SavedProjection>,
    pub(super) camera_from_rig: Option<SavedPose>,
    #[serde(default)]
    pub(super) delay_frames: i32,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) observed_pose_sd: Option<[f64; 6]>,
    /// Absent in files written up to 2026-11-24.
    pub(super) coverage: Option<SavedCoverage>,
    pub(super) views: Vec<SavedView>,
}

#[derive(Deserialize)]
pub(super) struct SavedCoverage {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) corners: Vec<u32>,
}

#[derive(Deserialize)]
pub(super) struct SavedProjection {
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) alignment: Vec<Vec<f64>>,
    #[serde(default, deserialize_with = "quantity::figure::de")]
    pub(super) observed_correlations: Option<Vec<Vec<f64>>>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) observed_freedom: Option<f64>,
    #[serde(default, deserialize_with = "quantity::figure::de")]
    pub(super) board_covariance: Option<Vec<Vec<f64>>>,
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub(super) distances_mm: Vec<f64>,
}

#[derive(Deserialize)]
pub(super) struct SavedJoint {
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) covariance: Vec<Vec<f64>>,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) freedom: f64,
    #[serde(default, deserialize_with = "quantity::figure::de")]
    pub(super) board_covariance: Option<Vec<Vec<f64>>>,
}

#[derive(Deserialize)]
pub(super) struct SavedParameter {
    pub(super) name: String,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) value: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) sd: Option<f64>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) observed_sd: Option<f64>,
}

#[derive(Deserialize)]
pub(super) struct SavedFrame {
    pub(super) name: String,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) rig_from_target: SavedPose,
}

#[derive(Deserialize)]
pub(super) struct SavedView {
    pub(super) name: String,
    pub(super) frame: Option<String>,
    pub(super) image: String,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) rms_px: f64,
    pub(super) camera_from_target: SavedPose,
    /// Absent unless residuals were requested.
    #[serde(default)]
    pub(super) corners: Vec<SavedCorner>,
}

#[derive(Deserialize)]
pub(super) struct SavedCorner {
    pub(super) target: Option<String>,
    pub(super) panel: u32,
    pub(super) row: i32,
    pub(super) col: i32,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) x: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) y: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) dx: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) dy: f64,
    #[serde(default)]
    pub(super) outlier: bool,
}

/// A rotation matrix, row by row.
fn rotation<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; 9], D::Error> {
    let rows: [f64; 9] = quantity::cosine::de(source)?;
    match is_rotation(&rows) {
        true => Ok(rows),
        false => Err(D::Error::custom("not a rotation matrix")),
    }
}

#[derive(Deserialize)]
pub(in crate::export) struct SavedPose {
    #[serde(deserialize_with = "rotation")]
    pub(super) rotation: [f64; 9],
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) translation_mm: DVec3,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) rotation_sd_rad: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "quantity::deviation::de")]
    pub(super) translation_sd_mm: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct SavedShape {
    #[serde(flatten)]
    pub(super) shape: StoredShape,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) sd_mm: [f64; COUNT],
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) bent_mm: f64,
    #[serde(deserialize_with = "quantity::deviation::de")]
    pub(super) stretched_mm: f64,
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) f_ratio: f64,
}

#[derive(Deserialize)]
pub(super) struct SavedMap {
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub(super) expected_mm: [f64; 2],
    pub(super) corners: Vec<SavedOffset>,
}

#[derive(Deserialize)]
pub(super) struct SavedOffset {
    pub(super) target: Option<String>,
    pub(super) panel: u32,
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub(super) row: i32,
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub(super) col: i32,
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub(super) panel_mm: [f64; 3],
    #[serde(deserialize_with = "quantity::position_mm::de")]
    pub(super) offset_mm: [f64; 3],
    #[serde(deserialize_with = "quantity::figure::de")]
    pub(super) covariance_mm2: [[f64; 3]; 3],
    pub(super) views: usize,
}

#[derive(Deserialize)]
pub(super) struct SavedExcluded {
    pub(super) camera: Option<String>,
    pub(super) view: String,
    pub(super) image: String,
    pub(super) panel: Option<u32>,
    pub(super) corners: usize,
    pub(super) reason: String,
}

impl SavedPose {
    pub(in crate::export) fn pose(&self) -> Pose {
        let rotation = DMat3::from_cols_array(&self.rotation).transpose();
        Pose { rotation: DQuat::from_mat3(&rotation).normalize(), translation: self.translation_mm }
    }

    pub(super) fn sd(&self) -> Option<[f64; 6]> {
        let ([a, b, c], [d, e, f]) = (self.rotation_sd_rad?, self.translation_sd_mm?);
        Some([a, b, c, d, e, f])
    }
}
