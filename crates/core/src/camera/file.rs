//! Camera files. The project's own YAML (or JSON) format supports every model. Files of ROS and
//! OpenCV can be read too.
//!
//! ```
//! let text = "
//! width: 1280
//! height: 960
//! focal_px: [1100, 1100]
//! centre_px: [639.5, 479.5]
//! model: pinhole
//! distortion: [-0.1, 0.02]
//! ";
//! let camera = deltille_core::camera::Camera::from_yaml(text)?;
//! assert_eq!(camera.width, 1280);
//! assert_eq!(deltille_core::camera::Camera::from_yaml(&camera.to_yaml())?, camera);
//! # Ok::<(), deltille_core::camera::CameraFileError>(())
//! ```
//!
//! | `model` | `distortion` |
//! |---|---|
//! | `pinhole` | k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; omitted ones at the end are zero |
//! | `fisheye` | k1 k2 k3 k4 or more; omitted ones are zero |
//! | `eucm` | α β |
//! | `double-sphere` | ξ α |
//! | `pupil` | k1 k2 k3 k4 k5 p1 p2 e1 e2 e3 |
//! | `spline` | dx dy of each knot, row by row; `spline` has `degree`, `columns`, `rows`, `fov_x_deg` |
//!
//! ROS and OpenCV files have `image_width`, `image_height`, `camera_matrix`, `distortion_model` (`plumb_bob`,
//! `rational_polynomial`, `equidistant`; OpenCV omits it) and `distortion_coefficients` instead.
//!
//! Limits: OpenCV's tilted sensor is rejected unless its angles are zero.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::identity::TargetIdentity;
use crate::quantity;
use crate::reading::in_words;
use crate::setting::Setting::CalibrationWrite;

use super::kannala_brandt::MIN_TERMS;
use super::{Camera, Lens, LensKind, MAX_LENS_PARAMETERS, SplineGrid};

/// Maximum size of a camera file, bytes. Most files are smaller than a hundredth of it. The time of
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
        "not a camera file: {0}; use the .yaml that {CalibrationWrite} wrote, or a YAML file of ROS or OpenCV with \
             image_width, image_height, camera_matrix and distortion_coefficients"
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
}

/// End of the first line of a file whose last line is [`END`].
const COMPLETE: &str = "camera, ends with ...";

/// The end of a YAML document.
const END: &str = "...";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    width: u32,
    height: u32,
    focal_px: DVec2,
    centre_px: DVec2,
    #[serde(default = "pinhole")]
    model: LensKind,
    /// The grid of a spline.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    spline: Option<SplineGrid>,
    #[serde(default)]
    distortion: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    calibrated_with: Vec<TargetIdentity>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failed: Option<String>,
}

/// Content of the project's own camera file.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFile {
    /// The camera.
    pub camera: Camera,
    /// Identities of the targets used for the calibration; empty if unknown.
    pub calibrated_with: Vec<TargetIdentity>,
    /// Why the calibration failed; the camera must then not be used. `None` if it did not fail.
    pub failed: Option<String>,
}

#[derive(Deserialize)]
struct Foreign {
    image_width: u32,
    image_height: u32,
    camera_matrix: Matrix,
    #[serde(default)]
    distortion_model: Option<String>,
    distortion_coefficients: Matrix,
}

#[derive(Deserialize)]
struct Matrix {
    #[serde(default)]
    rows: Option<usize>,
    #[serde(default)]
    cols: Option<usize>,
    data: Vec<f64>,
}

impl Matrix {
    /// Checks the size of the matrix if the file states it.
    fn check(&self) -> Result<(), String> {
        let stated = self.rows.zip(self.cols).map(|(rows, cols)| rows.saturating_mul(cols));
        match (stated, self.data.len()) {
            (Some(stated), found) if found != stated => {
                Err(format!("it has {found} numbers, but its rows and cols require {stated}"))
            }
            _ => Ok(()),
        }
    }
}

fn pinhole() -> LensKind {
    LensKind::BrownConrady
}

impl Camera {
    /// Reads the camera of a camera file, see [`CameraFile::from_yaml`].
    ///
    /// # Errors
    /// See [`CameraFile::from_yaml`].
    pub fn from_yaml(text: &str) -> Result<Camera, CameraFileError> {
        CameraFile::from_yaml(text).map(|file| file.camera)
    }

    /// Writes the text of the project's own camera file, with all digits, without the targets used for the
    /// calibration.
    pub fn to_yaml(&self) -> String {
        CameraFile { camera: self.clone(), calibrated_with: Vec::new(), failed: None }.to_yaml()
    }
}

impl CameraFile {
    /// Parses the text of a camera file.
    ///
    /// # Errors
    /// Returns an error if the text is not YAML, a field is missing or out of range, or the model is unknown.
    pub fn from_yaml(text: &str) -> Result<Self, CameraFileError> {
        check_size(text).map_err(CameraFileError::Yaml)?;
        // Without this check, a file truncated at the end of a line would be a camera with fewer terms.
        let is_marked = text.lines().next().is_some_and(|first| first.ends_with(COMPLETE));
        if is_marked && text.lines().next_back() != Some(END) {
            let what = format!("the file is truncated: its last line is not `{END}`");
            return Err(CameraFileError::Yaml(what));
        }
        // OpenCV writes a version directive and a tag that other YAML parsers do not know.
        let foreign = text.contains("camera_matrix");
        let own = if foreign { from_foreign(text)? } else { parse(text)? };
        let Own { width, height, focal_px, centre_px, model, spline, mut distortion, .. } = own;
        let (calibrated_with, failed) = (own.calibrated_with, own.failed);
        let key = |key, problem: String| CameraFileError::Key { key, problem };
        let numbers = [
            ("width", vec![f64::from(width)], quantity::side_px::RANGE),
            ("height", vec![f64::from(height)], quantity::side_px::RANGE),
            ("focal_px", focal_px.to_array().to_vec(), quantity::focal_px::RANGE),
            ("centre_px", centre_px.to_array().to_vec(), quantity::place_px::RANGE),
            ("distortion", distortion.clone(), quantity::coefficient::RANGE),
        ];
        for (name, numbers, range) in numbers {
            for number in numbers {
                range.check(number).map_err(|problem| key(name, problem.to_string()))?;
            }
        }
        let spline = spline.map(SplineGrid::checked).transpose();
        let spline = spline.map_err(|problem| key("spline", problem.to_string()))?;
        let lens = model
            .lens(distortion.len().clamp(MIN_TERMS, MAX_LENS_PARAMETERS), spline)
            .ok_or_else(|| {
                key("spline", "only the model `spline` has this key, and it requires it".to_owned())
            })?;
        let count = lens.names().len();
        while model != LensKind::Spline
            && distortion.len() > count
            && distortion.last() == Some(&0.0)
        {
            distortion.pop();
        }
        if model == LensKind::Spline && distortion.len() != count {
            let problem =
                format!("there are {} numbers, but the grid needs {count}", distortion.len());
            return Err(key("distortion", problem));
        }
        if distortion.len() > count
            || distortion.len() < count && lens.least_coefficients().is_none()
        {
            let names = lens.names().join(" ");
            let problem =
                format!("there are {} numbers, but the model has {names}", distortion.len());
            return Err(key("distortion", problem));
        }
        distortion.resize(count, 0.0);
        for ((name, &number), range) in lens.names().iter().zip(&distortion).zip(lens.ranges()) {
            let in_range = range.check(number);
            in_range.map_err(|what| key("distortion", format!("{name}: {what}")))?;
        }
        let lens = lens.with_parameters(&distortion);
        let camera = Camera { width, height, focal_px, centre_px, lens };
        Ok(Self { camera, calibrated_with, failed })
    }

    /// Writes the text of the file, with all digits.
    pub fn to_yaml(&self) -> String {
        let Camera { width, height, focal_px, centre_px, lens } = &self.camera;
        let mut distortion = lens.parameters();
        while lens.least_coefficients().is_some_and(|least| distortion.len() > least)
            && distortion.last() == Some(&0.0)
        {
            distortion.pop();
        }
        let spline = match lens {
            Lens::Spline(lens) => Some(lens.grid()),
            _ => None,
        };
        let own = Own {
            width: *width,
            height: *height,
            focal_px: *focal_px,
            centre_px: *centre_px,
            model: lens.kind(),
            spline,
            distortion,
            calibrated_with: self.calibrated_with.clone(),
            failed: self.failed.clone(),
        };
        let yaml = serde_yaml_ng::to_string(&own).expect("plain data has a YAML form");
        format!("# deltille {}, {COMPLETE}\n{yaml}{END}\n", env!("CARGO_PKG_VERSION"))
    }
}

/// Rejects content that no camera file has and that would take a YAML parser quadratic time.
fn check_size(text: &str) -> Result<(), String> {
    if text.len() > MAX_BYTES {
        return Err(format!("the text has more than {MAX_BYTES} bytes"));
    }
    let mut depth = 0usize;
    for byte in text.bytes() {
        match byte {
            b'[' | b'{' => depth += 1,
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err(format!("lists are nested more than {MAX_DEPTH} levels deep"));
        }
    }
    Ok(())
}

fn parse<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, CameraFileError> {
    serde_yaml_ng::from_str(text).map_err(|error| CameraFileError::Yaml(in_words(error)))
}

fn from_foreign(text: &str) -> Result<Own, CameraFileError> {
    let plain: Vec<&str> = text.lines().filter(|line| !line.starts_with('%')).collect();
    let file: Foreign = parse(&plain.join("\n").replace("!!opencv-matrix", ""))?;
    let key = |key, problem: String| CameraFileError::Key { key, problem };
    file.camera_matrix.check().map_err(|problem| key("camera_matrix", problem))?;
    let coefficients = file.distortion_coefficients;
    coefficients.check().map_err(|problem| key("distortion_coefficients", problem))?;
    let m: [f64; 9] = file.camera_matrix.data.try_into().map_err(|data: Vec<f64>| {
        key("camera_matrix", format!("it has {} numbers, but needs 9", data.len()))
    })?;
    if [m[1], m[3], m[6], m[7], m[8]] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        let problem =
            "it is not of the form `fx, 0, cx, 0, fy, cy, 0, 0, 1`, row by row".to_owned();
        return Err(key("camera_matrix", problem));
    }
    let model = match file.distortion_model.as_deref() {
        None | Some("plumb_bob" | "rational_polynomial") => LensKind::BrownConrady,
        Some("equidistant" | "fisheye") => LensKind::KannalaBrandt,
        Some(other) => {
            return Err(key("distortion_model", format!("unknown distortion model `{other}`")));
        }
    };
    Ok(Own {
        width: file.image_width,
        height: file.image_height,
        focal_px: DVec2::new(m[0], m[4]),
        centre_px: DVec2::new(m[2], m[5]),
        model,
        spline: None,
        distortion: coefficients.data,
        calibrated_with: Vec::new(),
        failed: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn truncated_files_are_rejected() {
        let text = Camera::pinhole(640, 480, 1.0).to_yaml();
        assert!(Camera::from_yaml(&text).is_ok());
        let lines: Vec<&str> = text.lines().collect();
        for count in 1..lines.len() {
            let cut = lines[..count].join("\n");
            assert!(Camera::from_yaml(&cut).is_err(), "{cut}");
        }
    }

    #[test]
    fn every_model_survives_a_file() {
        // In this second perspective lens, the coefficients after the eighth are zero.
        let short = (LensKind::BrownConrady, 8);
        for (kind, count) in LensKind::ALL.iter().map(|kind| (*kind, 40)).chain([short]) {
            let grid = SplineGrid::new(3, [5, 4], 90).ok().filter(|_| kind == LensKind::Spline);
            let lens = kind.lens(5, grid).unwrap();
            let value = |i: usize| if i < count { (i + 1) as f64 / 700.0 } else { 0.0 };
            let values: Vec<f64> = (0..lens.names().len()).map(value).collect();
            let camera = Camera::centred(640, 480, 321.0, lens.with_parameters(&values));
            let text = camera.to_yaml();
            assert_eq!(Camera::from_yaml(&text).unwrap(), camera, "{text}");
            let short = format!("{text}- 1.0\n").replace("- 1.0\n", "- .nan\n");
            assert!(Camera::from_yaml(&short).is_err());
        }
        let tilted = "image_width: 640\nimage_height: 480\n\
                      camera_matrix: {data: [500, 0, 320, 0, 501, 240, 0, 0, 1]}\n\
                      distortion_coefficients: {data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 2, TAU, 0]}\n";
        let camera = Camera::from_yaml(&tilted.replace("TAU", "0")).unwrap();
        assert_eq!(camera.lens.parameters()[11], 2.0);
        let message = Camera::from_yaml(&tilted.replace("TAU", "0.1")).unwrap_err().to_string();
        assert!(message.contains("s3 s4"), "{message}");
    }

    #[test]
    fn all_formats_give_the_same_camera() {
        let own = "width: 640\nheight: 480\nfocal_px: [500, 501]\ncentre_px: [320, 240]\n\
                   distortion: [-0.1, 0.01, 0.001, 0.002, 0]\n";
        let ros = "image_width: 640\nimage_height: 480\ncamera_name: left\n\
                   camera_matrix:\n  rows: 3\n  cols: 3\n  data: [500, 0, 320, 0, 501, 240, 0, 0, 1]\n\
                   distortion_model: plumb_bob\n\
                   distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.1, 0.01, 0.001, 0.002, 0]\n";
        let opencv = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n\
                      camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   \
                      data: [ 500., 0., 320., 0., 501., 240., 0., 0., 1. ]\n\
                      distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   \
                      data: [ -0.1, 0.01, 0.001, 0.002, 0. ]\n";
        let camera = Camera::from_yaml(own).unwrap();
        assert_eq!(Camera::from_yaml(ros).unwrap(), camera);
        assert_eq!(Camera::from_yaml(opencv).unwrap(), camera);
        let message =
            Camera::from_yaml(&own.replace("500, 501", "0, 501")).unwrap_err().to_string();
        assert!(message.contains("focal_px"), "{message}");
        assert!(Camera::from_yaml(&own.replace("width", "wdith")).is_err());
        // Transposed, skewed, scaled, and with a different size.
        for (from, to) in [
            ("500, 0, 320, 0, 501, 240, 0, 0, 1", "500, 0, 0, 0, 501, 0, 320, 240, 1"),
            ("500, 0, 320", "500, 5, 320"),
            ("240, 0, 0, 1", "240, 0, 0, 2"),
            ("240, 0, 0, 1", "240, 0, .nan, 1"),
            ("cols: 3", "cols: 4"),
        ] {
            let message = Camera::from_yaml(&ros.replace(from, to)).unwrap_err().to_string();
            assert!(message.contains("camera_matrix"), "{message}");
        }
    }
}
