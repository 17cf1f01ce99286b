//! Poses of a target in single images as JSON lines, schema `deltille/pose/1`; translations in mm.

use serde::Serialize;

use super::motion::Motion;
use deltille_calibrate::{Estimate, Reference, ViewEstimate};
use deltille_core::targets::Target;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/pose/1";

#[derive(Serialize)]
struct PoseLine<'a> {
    schema: &'static str,
    view: &'a str,
    image: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_ns: Option<i64>,
    target: &'a str,
    corners: usize,
    outliers: usize,
    rms_px: f64,
    camera_from_target: Motion,
    #[serde(skip_serializing_if = "is_one")]
    equivalent_poses: usize,
}

#[derive(Serialize)]
struct NoPoseLine<'a> {
    schema: &'static str,
    image: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    time_ns: Option<i64>,
    target: &'a str,
    camera_from_target: Option<Motion>,
    reason: &'a str,
}

fn is_one(count: &usize) -> bool {
    *count == 1
}

/// The line of an image without a pose, with the reason and the time stamp, ns, if it has one; without a line end.
pub fn write_none(image: &str, time_ns: Option<i64>, target: &str, reason: &str) -> String {
    let line =
        NoPoseLine { schema: SCHEMA, image, time_ns, target, camera_from_target: None, reason };
    serde_json::to_string(&line).expect("plain data has a JSON form")
}

/// The line of a view of a single camera, with the standard deviations of its pose. For a target without tags, it contains the
/// number of poses in which the target looks the same. `time_ns` is the time stamp of the image, if it has one. There is no
/// line end.
pub fn write_line(
    estimate: &Estimate,
    view: &ViewEstimate,
    time_ns: Option<i64>,
    target: &Target,
) -> String {
    let alike =
        Reference::Target(target).label_symmetries().iter().map(|maps| 1 + maps.len()).max();
    let line = PoseLine {
        schema: SCHEMA,
        view: &view.name,
        image: &view.image,
        time_ns,
        target: &target.name,
        equivalent_poses: alike.unwrap_or(1),
        corners: view.corners.len(),
        outliers: view.outlier_count(),
        rms_px: view.rms_px,
        camera_from_target: Motion::new(
            &view.pose,
            estimate.frames.get(view.frame).map(|frame| frame.pose_sd),
        ),
    };
    serde_json::to_string(&line).expect("plain data has a JSON form")
}
