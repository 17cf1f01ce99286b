//! Ground truth of a synthetic photograph as JSON, schema `deltille/truth/1`.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::motion::Motion;
use super::saved::SavedPose;
use deltille_core::camera::Pose;
use deltille_core::json;
use deltille_core::json::ReadError;
use deltille_core::quantity;
use deltille_core::reading::in_words;
use deltille_layout::synth::{Light, TruthCorner};

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/truth/1";

/// The ground truth of a synthetic photograph.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Truth {
    /// File name of the image; empty if it has none.
    pub image: String,
    /// Name of the target.
    pub target: String,
    /// Pose of the target in the camera frame, mm.
    pub camera_from_target: Pose,
    /// Light and blur; the file does not contain grey values.
    pub light: Light,
    /// The corners in view.
    pub corners: Vec<TruthCorner>,
}

/// Error of reading a ground truth from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The file is not a ground truth.
    #[error("not the ground truth of a synthetic photograph")]
    Foreign,
    /// The text is not complete.
    #[error("{0}")]
    Incomplete(String),
    /// A field is missing or has an invalid value.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field.
        field: String,
        /// The problem with the field.
        problem: String,
    },
}

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

/// Returns the text of the ground truth of the image with the file name `image`, of the target named
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
    json::to_text(&file, 2)
}

#[derive(Deserialize)]
struct SavedTruth {
    image: String,
    target: String,
    camera_from_target: SavedPose,
    #[serde(deserialize_with = "quantity::blur_px::de")]
    blur_px: f64,
    #[serde(deserialize_with = "quantity::of_full_scale::de")]
    noise: f64,
    #[serde(deserialize_with = "quantity::light_gradient::de")]
    gradient: DVec2,
    seed: u64,
    corners: Vec<TruthCorner>,
}

/// Reads a text written by [`write()`].
///
/// # Errors
/// Returns an error if the text is not a ground truth, or if a field is not valid.
pub fn read(text: &str) -> Result<Truth, TruthError> {
    if json::schema(text.as_bytes()).ok().flatten().as_deref() != Some(SCHEMA) {
        return Err(TruthError::Foreign);
    }
    let found: SavedTruth = json::read(text).map_err(|error| match error {
        ReadError::Json(problem) => TruthError::Incomplete(in_words(&problem)),
        ReadError::Field { field, problem } => TruthError::Field { field, problem },
    })?;
    let SavedTruth { image, target, camera_from_target, blur_px, noise, gradient, seed, corners } =
        found;
    let light = Light::default().blur_px(blur_px).noise(noise).gradient(gradient).seed(seed);
    Ok(Truth { image, target, camera_from_target: camera_from_target.pose(), light, corners })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    #[test]
    fn written_truth_is_read_back() {
        let pose = Pose {
            rotation: DQuat::from_scaled_axis(DVec3::new(0.1, -0.2, 0.3)),
            translation: DVec3::new(1.0, 2.0, 500.0),
        };
        let light = Light::default().blur_px(1.25).noise(0.02).seed(7);
        let text = write("view.png", "board", &pose, &light, &[]);
        let found = read(&text).unwrap();
        assert_eq!((found.image.as_str(), found.target.as_str()), ("view.png", "board"));
        assert!(found.camera_from_target.off(&pose).iter().all(|part| part.length() < 1e-9));
        assert_eq!((found.light, found.corners.len()), (light, 0));
        assert!(read(&text.replace("truth/1", "truth/2")).is_err());
        assert!(read(&text.replace("\"blur_px\": 1.25", "\"blur_px\": -1")).is_err());
    }
}
