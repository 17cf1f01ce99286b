//! Calibrations of a single camera as JSON, schema `deltille/calibration/1`: the camera with
//! standard deviations and correlations, every view with its pose and, on request, its residuals.

use serde::Serialize;

use super::constraint::{ConstraintRecord, constraints};
use super::estimate::{
    CoverageRecord, DiagnosisRecord, MapRecord, ParameterRecord, ProjectionRecord, ShapeRecord,
    ViewRecord, correlations, coverage, diagnoses, map, parameters, projection, shape, spline,
    views,
};
pub use super::estimate::{Print, Residuals, is_failure};
use super::finding::{FindingRecord, records};
use super::pose_uncertainty::{PoseUncertaintyRecord, pose_uncertainties};
use super::rig::{TargetRecord, targets};
use deltille_calibrate::{Diagnosis, Estimate, Excluded, PoseUncertainty};
use deltille_core::camera::SplineGrid;
use deltille_core::detection::InkEstimate;
use deltille_core::json;
use deltille_core::targets::TargetIdentity;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/calibration/1";

#[derive(Serialize)]
struct CalibrationFile<'a> {
    schema: &'static str,
    model: String,
    width: u32,
    height: u32,
    /// The grid of a spline.
    #[serde(skip_serializing_if = "Option::is_none")]
    spline: Option<SplineGrid>,
    parameters: Vec<ParameterRecord<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    constraints: Vec<ConstraintRecord>,
    correlations: Vec<Vec<f64>>,
    ill_conditioned: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    projection: Option<ProjectionRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pose_uncertainty: Vec<PoseUncertaintyRecord<'a>>,
    rms_px: f64,
    inlier_rms_px: f64,
    corners: usize,
    outliers: usize,
    coverage: CoverageRecord,
    sigma: f64,
    common_px: Option<f64>,
    #[serde(skip_serializing_if = "<[TargetIdentity]>::is_empty")]
    calibrated_with: &'a [TargetIdentity],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    targets: Vec<TargetRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    print_scale: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ink: Option<InkEstimate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_shape: Option<ShapeRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    target_map: Option<MapRecord<'a>>,
    views: Vec<ViewRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOut<'a>>,
    excluded: &'a [Excluded],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<FindingRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    diagnoses: Vec<DiagnosisRecord<'a>>,
}

#[derive(Serialize)]
struct HeldOut<'a> {
    rms_px: f64,
    views: Vec<ViewRecord<'a>>,
    excluded: &'a [Excluded],
}

/// The JSON text of the calibration of a single camera with its diagnoses and the uncertainties of poses of its targets; `None` for
/// an estimate without cameras.
pub fn write(
    found: &Estimate,
    said: &[Diagnosis],
    print: Print,
    residuals: Residuals,
    poses: &[PoseUncertainty],
) -> Option<String> {
    let camera = found.cameras.first()?;
    let held_out = found.held_out.as_deref();
    let held_out = held_out.and_then(|test| Some((test, test.cameras.first()?)));
    let file = CalibrationFile {
        schema: SCHEMA,
        model: camera.model.map_or("fixed".to_owned(), |model| model.to_string()),
        width: camera.camera.width,
        height: camera.camera.height,
        spline: spline(camera),
        parameters: parameters(camera),
        constraints: constraints(camera),
        correlations: correlations(camera),
        ill_conditioned: &camera.ill_conditioned,
        projection: projection(camera),
        pose_uncertainty: pose_uncertainties(found, poses),
        rms_px: found.rms_px,
        inlier_rms_px: found.inlier_rms_px(),
        corners: found.corner_count(),
        outliers: found.outlier_count(),
        coverage: coverage(camera),
        sigma: found.sigma,
        common_px: found.common_px,
        calibrated_with: &found.calibrated_with,
        targets: targets(found),
        print_scale: print.scale,
        ink: print.ink,
        board_shape: found.shape.map(shape),
        target_map: found.map.as_ref().map(|of_target| map(found, of_target)),
        views: views(found, camera, residuals),
        held_out: held_out.map(|(test, camera)| HeldOut {
            rms_px: test.rms_px,
            views: views(test, camera, residuals),
            excluded: &test.excluded,
        }),
        excluded: &found.excluded,
        findings: records(found, print.scale),
        diagnoses: diagnoses(found, said, print.scale),
    };
    Some(json::to_text(&file, 4))
}
