//! Rig calibrations as JSON, schema `deltille/rig/1`: every camera with its pose on the rig, and every frame with the pose of
//! the target.

use serde::Serialize;

use super::constraint::{ConstraintRecord, constraints};
use super::estimate::{
    CoverageRecord, DiagnosisRecord, JointRecord, MapRecord, ParameterRecord, Print,
    ProjectionRecord, Residuals, ShapeRecord, ViewRecord, correlations, coverage, diagnoses, joint,
    map, parameters, projection, shape, spline, views,
};
use super::finding::{FindingRecord, records};
use super::motion::Motion;
use super::pose_uncertainty::{PoseUncertaintyRecord, pose_uncertainties};
use deltille_calibrate::{CameraEstimate, Diagnosis, Estimate, Excluded, PoseUncertainty};
use deltille_core::camera::SplineGrid;
use deltille_core::json;
use deltille_core::targets::TargetIdentity;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/rig/1";

#[derive(Serialize)]
struct RigFile<'a> {
    schema: &'static str,
    model: &'a str,
    rms_px: f64,
    inlier_rms_px: f64,
    outliers: usize,
    sigma: f64,
    common_px: Option<f64>,
    #[serde(skip_serializing_if = "<[TargetIdentity]>::is_empty")]
    calibrated_with: &'a [TargetIdentity],
    #[serde(skip_serializing_if = "Option::is_none")]
    print_scale: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_shape: Option<ShapeRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    target_map: Option<MapRecord<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    targets: Vec<TargetRecord<'a>>,
    cameras: Vec<Camera<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    joint: Option<JointRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    depth: Vec<Depth<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pose_uncertainty: Vec<PoseUncertaintyRecord<'a>>,
    frames: Vec<Frame<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOut<'a>>,
    excluded: &'a [Excluded],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<FindingRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    diagnoses: Vec<DiagnosisRecord<'a>>,
}

/// One of several targets.
#[derive(Serialize)]
pub(super) struct TargetRecord<'a> {
    name: &'a str,
    /// Number of its panels.
    panels: usize,
    scene_from_target: Motion,
}

#[derive(Serialize)]
struct Camera<'a> {
    name: &'a str,
    model: String,
    width: u32,
    height: u32,
    rms_px: f64,
    inlier_rms_px: f64,
    corners: usize,
    outliers: usize,
    coverage: CoverageRecord,
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
    camera_from_rig: Motion,
    /// Delay of its images, in frames.
    #[serde(skip_serializing_if = "is_none")]
    delay_frames: i32,
    /// Empirical standard deviation from the scatter of frames: rotation (rad) and translation
    /// (mm).
    #[serde(skip_serializing_if = "Option::is_none")]
    observed_pose_sd: Option<[f64; 6]>,
    views: Vec<ViewRecord<'a>>,
}

/// The uncertainty of distances from the first of two cameras.
#[derive(Serialize)]
struct Depth<'a> {
    cameras: [&'a str; 2],
    distance_mm: f64,
    sd_mm: f64,
    mm_per_px: f64,
}

#[derive(Serialize)]
struct Frame<'a> {
    name: &'a str,
    rms_px: f64,
    rig_from_target: Motion,
}

#[derive(Serialize)]
struct HeldOut<'a> {
    rms_px: f64,
    cameras: Vec<Seen<'a>>,
    frames: Vec<Frame<'a>>,
    excluded: &'a [Excluded],
}

/// The views of a camera in frames that were held out.
#[derive(Serialize)]
struct Seen<'a> {
    name: &'a str,
    rms_px: f64,
    views: Vec<ViewRecord<'a>>,
}

/// The JSON text of the calibration of a rig; `model` is the lens model of cameras that do not
/// specify a model, and `poses` the uncertainties of poses of the targets.
pub fn write(
    found: &Estimate,
    said: &[Diagnosis],
    model: &str,
    print: Print,
    residuals: Residuals,
    poses: &[PoseUncertainty],
) -> String {
    let held_out = found.held_out.as_deref().map(|test| HeldOut {
        rms_px: test.rms_px,
        cameras: test.cameras.iter().map(|camera| seen(test, camera, residuals)).collect(),
        frames: frames(test),
        excluded: &test.excluded,
    });
    let file = RigFile {
        schema: SCHEMA,
        model,
        rms_px: found.rms_px,
        inlier_rms_px: found.inlier_rms_px(),
        outliers: found.outlier_count(),
        sigma: found.sigma,
        common_px: found.common_px,
        calibrated_with: &found.calibrated_with,
        print_scale: print.scale,
        board_shape: found.shape.map(shape),
        target_map: found.map.as_ref().map(|of_target| map(found, of_target)),
        targets: targets(found),
        cameras: found.cameras.iter().map(|camera| of_camera(found, camera, residuals)).collect(),
        joint: found.joint.as_ref().map(joint),
        depth: depth(found),
        pose_uncertainty: pose_uncertainties(found, poses),
        frames: frames(found),
        held_out,
        excluded: &found.excluded,
        findings: records(found, print.scale),
        diagnoses: diagnoses(found, said, print.scale),
    };
    json::to_text(&file, 4)
}

fn depth(found: &Estimate) -> Vec<Depth<'_>> {
    let name = |index: usize| found.cameras[index].name.as_str();
    let records = found.depth_uncertainties().into_iter().map(|(pair, of)| Depth {
        cameras: pair.map(name),
        distance_mm: of.distance_mm,
        sd_mm: of.sd_mm,
        mm_per_px: of.mm_per_px,
    });
    records.collect()
}

/// The poses of several targets; empty for one.
pub(super) fn targets(found: &Estimate) -> Vec<TargetRecord<'_>> {
    let several = found.targets.iter().filter(|_| found.targets.len() > 1);
    let records = several.map(|target| TargetRecord {
        name: &target.name,
        panels: target.panels.len(),
        scene_from_target: Motion::new(&target.scene_from_target, target.pose_sd),
    });
    records.collect()
}

fn of_camera<'a>(
    estimate: &'a Estimate,
    found: &'a CameraEstimate,
    residuals: Residuals,
) -> Camera<'a> {
    Camera {
        name: &found.name,
        model: found.model.map_or("fixed".to_owned(), |model| model.to_string()),
        width: found.camera.width,
        height: found.camera.height,
        rms_px: found.rms_px,
        inlier_rms_px: found.inlier_rms_px(),
        corners: found.corner_count(),
        outliers: found.outlier_count(),
        coverage: coverage(found),
        spline: spline(found),
        parameters: parameters(found),
        constraints: constraints(found),
        correlations: correlations(found),
        ill_conditioned: &found.ill_conditioned,
        projection: projection(found),
        camera_from_rig: Motion::new(&found.camera_from_rig, found.pose_sd),
        delay_frames: found.delay,
        observed_pose_sd: found.observed_pose_sd,
        views: views(estimate, found, residuals),
    }
}

fn is_none(frames: &i32) -> bool {
    *frames == 0
}

fn seen<'a>(estimate: &'a Estimate, found: &'a CameraEstimate, residuals: Residuals) -> Seen<'a> {
    let views = views(estimate, found, residuals);
    Seen { name: &found.name, rms_px: found.rms_px, views }
}

fn frames(estimate: &Estimate) -> Vec<Frame<'_>> {
    let frames = estimate.frames.iter().map(|frame| Frame {
        name: &frame.name,
        rms_px: frame.rms_px,
        rig_from_target: Motion::new(&frame.rig_from_target, Some(frame.pose_sd)),
    });
    frames.collect()
}
