//! The camera from the numbers of a file, each in its range.

use glam::DVec2;

use crate::camera::kannala_brandt::MIN_TERMS;
use crate::camera::{Camera, LensKind, MAX_LENS_PARAMETERS, SplineGrid};
use crate::quantity;
use crate::reading::in_words;
use crate::setting::Setting::CalibrationWrite;

/// Maximum size of a YAML file, bytes. Most files are smaller than a hundredth of it. The time of
/// YAML parsers grows with the square of the size.
const MAX_BYTES: usize = 50_000;

/// Maximum nesting of lists and maps; a camera has two levels.
const MAX_DEPTH: usize = 16;

/// The problem with a camera file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// The text is not YAML, or does not have these keys.
    #[error(
        "not a camera file: {0}; use the .yaml that {CalibrationWrite} wrote, or a camera of OpenCV, ROS, Kalibr \
             (camchain.yaml), COLMAP (cameras.txt) or mrcal (.cameramodel)"
    )]
    Yaml(String),
    /// The value of a key is invalid.
    #[error("key `{key}`: {problem}")]
    Key {
        /// The key.
        key: &'static str,
        /// The problem.
        problem: String,
    },
    /// The file contains several cameras and none was chosen, or not the chosen one.
    #[error("{0}")]
    Choice(String),
}

pub(super) fn key(key: &'static str, problem: impl ToString) -> CameraFileError {
    CameraFileError::Key { key, problem: problem.to_string() }
}

/// The numbers of a camera, as a file states them.
pub(super) struct Fields {
    /// The keys of width, height, focal lengths, principal point and distortion in the file.
    pub keys: [&'static str; 5],
    pub width: u32,
    pub height: u32,
    pub focal_px: DVec2,
    pub centre_px: DVec2,
    pub model: LensKind,
    pub spline: Option<SplineGrid>,
    pub distortion: Vec<f64>,
}

impl Fields {
    /// Checks every number, and the number of coefficients.
    pub(super) fn camera(self) -> Result<Camera, CameraFileError> {
        let Self { keys, width, height, focal_px, centre_px, model, spline, mut distortion } = self;
        let numbers = [
            (vec![f64::from(width)], quantity::side_px::RANGE),
            (vec![f64::from(height)], quantity::side_px::RANGE),
            (focal_px.to_array().to_vec(), quantity::focal_px::RANGE),
            (centre_px.to_array().to_vec(), quantity::place_px::RANGE),
            (distortion.clone(), quantity::coefficient::RANGE),
        ];
        for (name, (numbers, range)) in keys.into_iter().zip(numbers) {
            for number in numbers {
                range.check(number).map_err(|problem| key(name, problem))?;
            }
        }
        let wrong = |problem: String| key(keys[4], problem);
        let spline = spline.map(SplineGrid::checked).transpose();
        let spline = spline.map_err(|problem| key("spline", problem))?;
        let lens =
            model.lens(distortion.len().clamp(MIN_TERMS, MAX_LENS_PARAMETERS), spline).ok_or_else(
                || key("spline", "only the model `spline` has this key, and it requires it"),
            )?;
        let count = lens.names().len();
        while model != LensKind::Spline
            && distortion.len() > count
            && distortion.last() == Some(&0.0)
        {
            distortion.pop();
        }
        if model == LensKind::Spline && distortion.len() != count {
            let found = distortion.len();
            return Err(wrong(format!("there are {found} numbers, but the grid needs {count}")));
        }
        if distortion.len() > count
            || distortion.len() < count && lens.least_coefficients().is_none()
        {
            let (found, names) = (distortion.len(), lens.names().join(" "));
            return Err(wrong(format!("there are {found} numbers, but the model has {names}")));
        }
        distortion.resize(count, 0.0);
        for ((name, &number), range) in lens.names().iter().zip(&distortion).zip(lens.ranges()) {
            range.check(number).map_err(|what| wrong(format!("{name}: {what}")))?;
        }
        let lens = lens.with_parameters(&distortion);
        Ok(Camera { width, height, focal_px, centre_px, lens })
    }
}

/// Parses YAML, unless it has a size or a nesting that no camera file has and that would take a parser quadratic time.
pub(super) fn parse<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, CameraFileError> {
    if text.len() > MAX_BYTES {
        return Err(CameraFileError::Yaml(format!("the text has more than {MAX_BYTES} bytes")));
    }
    let mut depth = 0usize;
    for byte in text.bytes() {
        match byte {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_DEPTH {
            let what = format!("lists are nested more than {MAX_DEPTH} levels deep");
            return Err(CameraFileError::Yaml(what));
        }
    }
    serde_yaml_ng::from_str(text).map_err(|error| CameraFileError::Yaml(in_words(error)))
}
