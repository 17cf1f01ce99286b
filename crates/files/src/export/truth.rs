//! Ground truth of a synthetic photograph as JSON, schema `deltille/truth/1`.

use glam::DVec2;
use serde::Serialize;

use super::motion::Motion;
use deltille_core::camera::Pose;
use deltille_core::synth::{Light, TruthCorner};

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/truth/1";

#[derive(Serialize)]
struct TruthFile<'a> {
    schema: &'static str,
    image: &'a str,
    target: &'a str,
    camera_from_target: Motion,
    blur_px: f64,
    noise: f64,
    gradient: DVec2,
    seed: u64,
    corners: &'a [TruthCorner],
}

/// The text of the ground truth of the picture with the file name `image`, of the target named
/// `target`: pose (mm), light and corner positions (px).
pub fn write(
    image: &str,
    target: &str,
    camera_from_target: &Pose,
    light: &Light,
    corners: &[TruthCorner],
) -> String {
    let Light { blur_px, noise, gradient, seed, .. } = *light;
    let file = TruthFile {
        schema: SCHEMA,
        image,
        target,
        camera_from_target: Motion::new(camera_from_target, None),
        blur_px,
        noise,
        gradient,
        seed,
        corners,
    };
    deltille_core::json::to_text(&file, 2)
}
