//! Poses of a target in single images: as JSON lines, schema `deltille/pose/1`, or as CSV; translations in mm.

use serde::Serialize;

use super::motion::Motion;
use crate::export::writing::cell::quoted;
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

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseFormat {
    /// A JSON object for each pose.
    JsonLines,
    /// A line of [`CSV_HEADER`] for each pose.
    Csv,
}

/// The header of a CSV. `x` to `z` are the position of the target in the camera frame, and `qx` to `qw` its orientation, a
/// quaternion; standard deviations refer to the axes of the camera. A cell is empty if the value is not known.
pub const CSV_HEADER: &str = "image,view,time_ns,target,x_mm,y_mm,z_mm,qx,qy,qz,qw,sd_x_mm,sd_y_mm,sd_z_mm,sd_rx_rad,sd_ry_rad,\
     sd_rz_rad,corners,outliers,rms_px,equivalent_poses,reason";

impl PoseFormat {
    /// Returns the format of files with this extension.
    pub fn of_extension(extension: &str) -> Option<Self> {
        match extension {
            "ndjson" => Some(Self::JsonLines),
            "csv" => Some(Self::Csv),
            _ => None,
        }
    }

    /// Returns what a file begins with.
    pub fn head(self) -> String {
        match self {
            Self::JsonLines => String::new(),
            Self::Csv => format!("{CSV_HEADER}\n"),
        }
    }

    /// Returns the line of an image without a pose, with the reason and the time stamp, ns, if it has one; without a line
    /// end.
    pub fn line_without(
        self,
        image: &str,
        time_ns: Option<i64>,
        target: &str,
        reason: &str,
    ) -> String {
        match self {
            Self::JsonLines => json(&NoPoseLine {
                schema: SCHEMA,
                image,
                time_ns,
                target,
                camera_from_target: None,
                reason,
            }),
            Self::Csv => {
                let time_ns = time_ns.map(|ns| ns.to_string()).unwrap_or_default();
                let [image, target, reason] = [image, target, reason].map(quoted);
                let missing = ",".repeat(CSV_HEADER.matches(',').count() - 4);
                format!("{image},,{time_ns},{target}{missing},{reason}")
            }
        }
    }

    /// Returns the line of a view of a single camera, with the standard deviations of its pose. For a target without tags, it
    /// contains the number of poses in which the target looks the same. `time_ns` is the time stamp of the image, if it has
    /// one. There is no line end.
    pub fn line(
        self,
        estimate: &Estimate,
        view: &ViewEstimate,
        time_ns: Option<i64>,
        target: &Target,
    ) -> String {
        let alike =
            Reference::Target(target).label_symmetries().iter().map(|maps| 1 + maps.len()).max();
        let equivalent_poses = alike.unwrap_or(1);
        let sd = estimate.frames.get(view.frame).map(|frame| frame.pose_sd);
        let (corners, outliers) = (view.corners.len(), view.outlier_count());
        match self {
            Self::JsonLines => json(&PoseLine {
                schema: SCHEMA,
                view: &view.name,
                image: &view.image,
                time_ns,
                target: &target.name,
                equivalent_poses,
                corners,
                outliers,
                rms_px: view.rms_px,
                camera_from_target: Motion::new(&view.pose, sd),
            }),
            Self::Csv => {
                let [image, name, target] =
                    [view.image.as_str(), view.name.as_str(), &target.name].map(quoted);
                let time_ns = time_ns.map(|ns| ns.to_string()).unwrap_or_default();
                let (at, turn) = (view.pose.translation, view.pose.rotation);
                let place = at.to_array().into_iter().chain(turn.to_array());
                let sd =
                    [3, 4, 5, 0, 1, 2].map(|i| sd.map(|sd| sd[i].to_string()).unwrap_or_default());
                let numbers =
                    place.map(|value| value.to_string()).chain(sd).collect::<Vec<_>>().join(",");
                let rms_px = view.rms_px;
                format!(
                    "{image},{name},{time_ns},{target},{numbers},{corners},{outliers},{rms_px},{equivalent_poses},"
                )
            }
        }
    }
}

fn json(line: &impl Serialize) -> String {
    serde_json::to_string(line).expect("plain data has a JSON form")
}
