//! The result of `deltille handeye` as JSON, schema `deltille/hand-eye/1`.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use super::estimate::diagnoses;
use super::motion::Motion;
use deltille_calibrate::{HandEye, HandEyeView, Mounting};
use deltille_core::camera::Pose;
use deltille_core::json;
use deltille_core::targets::TargetIdentity;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/hand-eye/1";

#[derive(Serialize)]
struct HandEyeFile<'a> {
    schema: &'static str,
    setup: &'static str,
    /// `flange_from_camera` and `base_from_board`, or `base_from_camera` and `flange_from_board`.
    #[serde(flatten)]
    mountings: BTreeMap<String, Mounted>,
    /// Of (ω, τ) of the camera, (ω, τ) of the board, and the scale if it was estimated; rad and mm.
    covariance: Vec<Vec<f64>>,
    scale: f64,
    scale_sd: Option<f64>,
    robot_noise: Noise,
    findings: Vec<Finding>,
    rotations: Vec<Spread>,
    paired_by: &'static str,
    rms_px: f64,
    views: Vec<ViewRecord<'a>>,
    unpaired: &'a [String],
    spare_poses: usize,
    camera: CameraRecord,
    calibrated_with: &'a [TargetIdentity],
}

#[derive(Serialize)]
struct Mounted {
    #[serde(flatten)]
    pose: Motion,
    static_transform: StaticTransform,
}

/// The same pose as ROS writes it.
#[derive(Serialize)]
struct StaticTransform {
    frame_id: &'static str,
    child_frame_id: &'static str,
    translation_m: DVec3,
    rotation_xyzw: [f64; 4],
}

#[derive(Serialize)]
struct Noise {
    rotation_deg: f64,
    translation_mm: f64,
    /// `null` if the noise was given.
    degrees_of_freedom: Option<[f64; 2]>,
}

/// What the photographs contradict of what was stated about the robot, or of the camera and the board.
#[derive(Serialize)]
struct Finding {
    kind: &'static str,
    text: String,
}

#[derive(Serialize)]
struct Spread {
    rms_deg: f64,
    axis_in_base: DVec3,
}

#[derive(Serialize)]
struct ViewRecord<'a> {
    view: &'a str,
    pose: usize,
    used: bool,
    rms_px: f64,
    /// `null` if a corner is not visible from the reported pose.
    robot_rms_px: Option<f64>,
    rotation_deg: DVec3,
    translation_mm: DVec3,
}

#[derive(Serialize)]
struct CameraRecord {
    width: u32,
    height: u32,
    model: String,
    parameters: Vec<(String, f64)>,
}

/// The names of the two poses: of the camera, and of the board.
pub fn names(mounting: Mounting) -> [String; 2] {
    let [mount, ground] = mounting.bodies();
    [format!("{mount}_from_camera"), format!("{ground}_from_board")]
}

/// The JSON text of a result.
pub fn write(found: &HandEye) -> String {
    let poses = [found.mount_from_camera, found.ground_from_board];
    let parts = poses.iter().zip(found.pose_sd()).zip(found.mounting.bodies());
    let mounted =
        parts.zip(["camera", "board"]).map(|(((pose, sd), frame_id), child_frame_id)| Mounted {
            pose: Motion::new(pose, Some(sd)),
            static_transform: static_transform(pose, frame_id, child_frame_id),
        });
    let n = found.covariance.rows();
    let row = |i: usize| (0..n).map(|j| found.covariance[(i, j)]).collect();
    let camera = found.cameras.cameras.first().map(|of| &of.camera);
    let file = HandEyeFile {
        schema: SCHEMA,
        setup: found.mounting.name(),
        mountings: names(found.mounting).into_iter().zip(mounted).collect(),
        covariance: (0..n).map(row).collect(),
        scale: found.scale,
        scale_sd: found.scale_sd(),
        robot_noise: Noise {
            rotation_deg: found.noise.rotation_rad.to_degrees(),
            translation_mm: found.noise.translation_mm,
            degrees_of_freedom: found.noise_freedom,
        },
        findings: findings(found),
        rotations: found
            .rotation_spread
            .iter()
            .map(|(rms, axis)| Spread { rms_deg: rms.to_degrees(), axis_in_base: *axis })
            .collect(),
        paired_by: found.paired_by.name(),
        rms_px: found.rms_px,
        views: found.views.iter().map(view).collect(),
        unpaired: &found.unpaired,
        spare_poses: found.spare_poses,
        camera: CameraRecord {
            width: camera.map_or(0, |camera| camera.width),
            height: camera.map_or(0, |camera| camera.height),
            model: camera.map_or(String::new(), |camera| camera.lens.kind().name().to_owned()),
            parameters: camera.map_or(Vec::new(), |camera| {
                camera.parameter_names().into_iter().zip(camera.parameters()).collect()
            }),
        },
        calibrated_with: &found.cameras.calibrated_with,
    };
    json::to_text(&file, 3)
}

fn findings(found: &HandEye) -> Vec<Finding> {
    let of_robot = found.contradictions.iter();
    let of_robot = of_robot.map(|of| Finding { kind: of.name(), text: of.to_string() });
    let of_camera = diagnoses(&found.cameras, &found.diagnoses, None).into_iter();
    of_robot.chain(of_camera.map(|of| Finding { kind: of.kind, text: of.text })).collect()
}

fn static_transform(
    pose: &Pose,
    frame_id: &'static str,
    child_frame_id: &'static str,
) -> StaticTransform {
    let translation_m = pose.translation / 1000.0;
    StaticTransform {
        frame_id,
        child_frame_id,
        translation_m,
        rotation_xyzw: pose.rotation.to_array(),
    }
}

fn view(of: &HandEyeView) -> ViewRecord<'_> {
    ViewRecord {
        view: &of.name,
        pose: of.pose,
        used: of.is_used,
        rms_px: of.rms_px,
        robot_rms_px: Some(of.robot_rms_px).filter(|px| px.is_finite()),
        rotation_deg: of.rotation_rad.map(f64::to_degrees),
        translation_mm: of.translation_mm,
    }
}
