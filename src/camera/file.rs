//! Camera files: the project's own YAML, and those of ROS and OpenCV.
//!
//! ```
//! let text = "
//! width: 1280
//! height: 960
//! focal_px: [1100, 1100]
//! centre_px: [639.5, 479.5]
//! model: pinhole                        # or fisheye
//! distortion: [-0.1, 0.02, 0, 0, 0]     # k1 k2 p1 p2 k3; of a fisheye k1 k2 k3 k4; optional
//! ";
//! let camera = deltille::camera::Camera::from_yaml(text)?;
//! assert_eq!(camera.width, 1280);
//! # Ok::<(), deltille::camera::CameraFileError>(())
//! ```
//!
//! A ROS or OpenCV file has `image_width`, `image_height`, `camera_matrix`, `distortion_model`
//! (`plumb_bob`, `equidistant`; OpenCV names none) and `distortion_coefficients` instead.
//!
//! Limits: the rational and thin-prism terms of OpenCV are refused unless they are zero.

use serde::Deserialize;

use super::{BrownConrady, Camera, KannalaBrandt, Lens};

/// Largest side of an image, px.
const MAX_SIDE: u32 = 50_000;

/// What is wrong with a camera file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// Not YAML, or not with these keys.
    #[error("not a camera file: {0}")]
    Yaml(String),
    /// A key holds what it must not.
    #[error("key `{key}`: {problem}")]
    Key {
        /// The key.
        key: &'static str,
        /// What is wrong.
        problem: String,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    width: u32,
    height: u32,
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    #[serde(default)]
    model: Model,
    #[serde(default)]
    distortion: Vec<f64>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Model {
    #[default]
    Pinhole,
    Fisheye,
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
    data: Vec<f64>,
}

impl Camera {
    /// Reads the text of a camera file.
    pub fn from_yaml(text: &str) -> Result<Camera, CameraFileError> {
        // OpenCV writes a version directive and a tag that no other reader of YAML knows.
        let foreign = text.contains("camera_matrix");
        let own = if foreign { from_foreign(text)? } else { parse(text)? };
        let key = |key, problem: &str| CameraFileError::Key { key, problem: problem.to_owned() };
        if !(1..=MAX_SIDE).contains(&own.width) || !(1..=MAX_SIDE).contains(&own.height) {
            return Err(key("width", "width and height must be between 1 and 50000"));
        }
        if own.focal_px.iter().any(|&f| !(f > 0.0 && f.is_finite())) {
            return Err(key("focal_px", "it must be positive"));
        }
        let numbers = own.centre_px.iter().chain(&own.distortion);
        if numbers.into_iter().any(|v| !v.is_finite()) {
            return Err(key("distortion", "it must be finite"));
        }
        let most = if matches!(own.model, Model::Fisheye) { 4 } else { 5 };
        if own.distortion.iter().skip(most).any(|&k| k != 0.0) {
            return Err(key("distortion", "there are more coefficients than the model has"));
        }
        let k = |i: usize| own.distortion.get(i).copied().unwrap_or(0.0);
        let lens = match own.model {
            Model::Pinhole => Lens::BrownConrady(BrownConrady {
                radial: [k(0), k(1), k(4)],
                tangential: [k(2), k(3)],
            }),
            Model::Fisheye => Lens::KannalaBrandt(KannalaBrandt { k: [k(0), k(1), k(2), k(3)] }),
        };
        let Own { width, height, focal_px, centre_px, .. } = own;
        Ok(Camera { width, height, focal_px, centre_px, lens })
    }
}

fn parse<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, CameraFileError> {
    serde_yaml_ng::from_str(text).map_err(|error| CameraFileError::Yaml(error.to_string()))
}

fn from_foreign(text: &str) -> Result<Own, CameraFileError> {
    let plain: Vec<&str> = text.lines().filter(|line| !line.starts_with('%')).collect();
    let file: Foreign = parse(&plain.join("\n").replace("!!opencv-matrix", ""))?;
    let key = |key, problem: String| CameraFileError::Key { key, problem };
    let m: [f64; 9] = file.camera_matrix.data.try_into().map_err(|data: Vec<f64>| {
        key("camera_matrix", format!("it has {} numbers instead of 9", data.len()))
    })?;
    let model = match file.distortion_model.as_deref() {
        None | Some("plumb_bob" | "rational_polynomial") => Model::Pinhole,
        Some("equidistant" | "fisheye") => Model::Fisheye,
        Some(other) => return Err(key("distortion_model", format!("`{other}` is not known"))),
    };
    Ok(Own {
        width: file.image_width,
        height: file.image_height,
        focal_px: [m[0], m[4]],
        centre_px: [m[2], m[5]],
        model,
        distortion: file.distortion_coefficients.data,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_ways_to_say_the_same() {
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
        let said = Camera::from_yaml(&own.replace("500, 501", "0, 501")).unwrap_err().to_string();
        assert!(said.contains("focal_px"), "{said}");
        assert!(Camera::from_yaml(&own.replace("width", "wdith")).is_err());
    }
}
