//! Comparisons of two calibrations as JSON, schema `deltille/comparison/1`.

use glam::DVec3;
use serde::Serialize;

use super::motion::Motion;
use deltille_calibrate::{CameraMotion, Comparison};
use deltille_core::json;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/comparison/1";

#[derive(Serialize)]
struct ComparisonFile<'a> {
    schema: &'static str,
    cameras: Vec<CameraRecord<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    motions: Vec<MotionRecord<'a>>,
}

#[derive(Serialize)]
struct CameraRecord<'a> {
    #[serde(skip_serializing_if = "str::is_empty")]
    name: &'a str,
    /// `null` at infinity.
    distance_mm: Option<f64>,
    compared: usize,
    rms_px: f64,
    largest_px: f64,
    expected_px: Option<f64>,
    p_value: Option<f64>,
    significant: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    undecided: Option<&'static str>,
    second_from_first: Motion,
    /// For each pixel (x, y) of the first camera, the difference (dx, dy) of the second camera and
    /// the standard deviation per axis.
    positions: Vec<PositionRecord>,
}

#[derive(Serialize)]
struct PositionRecord {
    x: f64,
    y: f64,
    dx: f64,
    dy: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    sd: Option<f64>,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    compared: bool,
}

#[derive(Serialize)]
struct MotionRecord<'a> {
    from: &'a str,
    to: &'a str,
    rotation_rad: DVec3,
    translation_mm: DVec3,
    p_value: Option<f64>,
    significant: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    undecided: Option<&'static str>,
}

/// The JSON text of a comparison. `names` are those of the cameras in the order of `found`, empty for a
/// camera without a name. Lengths are in mm, angles in rad, image distances in px.
pub fn write(names: &[&str], found: &[Comparison], motions: &[CameraMotion]) -> String {
    let cameras = names.iter().zip(found).map(|(name, found)| CameraRecord {
        name,
        distance_mm: found.distance_mm,
        compared: found.compared().count(),
        rms_px: found.rms_px,
        largest_px: found.largest_px(),
        expected_px: found.expected_px,
        p_value: found.p_value,
        significant: found.is_significant(),
        undecided: found.why_undecided(),
        second_from_first: Motion::new(&found.second_from_first, None),
        positions: found.positions.iter().flatten().map(place).collect(),
    });
    let motions = motions.iter().map(|motion| MotionRecord {
        from: &motion.from,
        to: &motion.to,
        rotation_rad: motion.rotation_rad,
        translation_mm: motion.translation_mm,
        p_value: motion.p_value,
        significant: motion.is_significant(),
        undecided: motion.why_undecided(),
    });
    let file =
        ComparisonFile { schema: SCHEMA, cameras: cameras.collect(), motions: motions.collect() };
    json::to_text(&file, 4)
}

fn place(found: &deltille_calibrate::Difference) -> PositionRecord {
    PositionRecord {
        x: found.pixel.x,
        y: found.pixel.y,
        dx: found.by.x,
        dy: found.by.y,
        sd: found.sd_px,
        compared: found.is_compared,
    }
}
