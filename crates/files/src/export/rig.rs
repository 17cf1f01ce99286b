//! Rigs as JSON, schema `deltille/rig/1`: every camera with its place, every frame with that of the
//! target.

use serde::Serialize;

use super::finding::{FindingRecord, records};
use super::motion::Motion;
use deltille_core::calibrate::{Excluded, Parameter, RigSolution};

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
    cameras: Vec<Camera<'a>>,
    frames: Vec<Frame<'a>>,
    excluded: &'a [Excluded],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<FindingRecord>,
}

#[derive(Serialize)]
struct Camera<'a> {
    name: &'a str,
    width: u32,
    height: u32,
    rms_px: f64,
    inlier_rms_px: f64,
    corners: usize,
    outliers: usize,
    parameters: Vec<Value<'a>>,
    camera_from_rig: Motion,
}

#[derive(Serialize)]
struct Value<'a> {
    name: &'a str,
    value: f64,
    sd: Option<f64>,
}

#[derive(Serialize)]
struct Frame<'a> {
    name: &'a str,
    rms_px: f64,
    rig_from_target: Motion,
}

/// The text of a rig's file.
pub fn write(solution: &RigSolution, model: &str) -> String {
    let names: Vec<&str> = solution.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let cameras = solution.cameras.iter().map(|camera| Camera {
        name: &camera.name,
        width: camera.camera.width,
        height: camera.camera.height,
        rms_px: camera.rms_px,
        inlier_rms_px: camera.inlier_rms_px,
        corners: camera.corners,
        outliers: camera.outliers,
        parameters: camera.parameters.iter().map(value).collect(),
        camera_from_rig: Motion::new(&camera.camera_from_rig, camera.pose_sd),
    });
    let frames = solution.frames.iter().map(|frame| Frame {
        name: &frame.name,
        rms_px: frame.rms_px,
        rig_from_target: Motion::new(&frame.rig_from_target, Some(frame.pose_sd)),
    });
    let file = RigFile {
        schema: SCHEMA,
        model,
        rms_px: solution.rms_px,
        inlier_rms_px: solution.inlier_rms_px(),
        outliers: solution.outlier_count(),
        sigma: solution.sigma,
        common_px: solution.common_px,
        cameras: cameras.collect(),
        frames: frames.collect(),
        excluded: &solution.excluded,
        findings: records(&solution.findings, &names),
    };
    deltille_core::json::to_text(&file, 4)
}

fn value(parameter: &Parameter) -> Value<'_> {
    Value { name: &parameter.name, value: parameter.value, sd: parameter.sd }
}
