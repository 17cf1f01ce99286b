//! The project's own format, and the choice between all formats.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::fields::{CameraFileError, Fields, parse};
use super::foreign::{self, chosen};
use crate::camera::{Camera, Lens, LensKind, SplineGrid};
use crate::identity::TargetIdentity;

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
    /// Parses the text of a camera file that contains one camera.
    ///
    /// # Errors
    /// Returns an error if the text is not a camera file, contains several cameras, a field is missing or out of range, or the
    /// model is unknown.
    pub fn from_yaml(text: &str) -> Result<Self, CameraFileError> {
        Self::named(text, None)
    }

    /// Parses the text of a camera file. `name` selects one of several cameras: `cam0` in a file of Kalibr, the
    /// CAMERA_ID in one of COLMAP.
    ///
    /// # Errors
    /// Returns an error as in [`Self::from_yaml`], and if no camera has this name.
    pub fn named(text: &str, name: Option<&str>) -> Result<Self, CameraFileError> {
        // Without this check, a file truncated at the end of a line would be a camera with fewer terms.
        let is_marked = text.lines().next().is_some_and(|first| first.ends_with(COMPLETE));
        if is_marked && text.lines().next_back() != Some(END) {
            let what = format!("the file is truncated: its last line is not `{END}`");
            return Err(CameraFileError::Yaml(what));
        }
        if let Some(fields) = foreign::read(text, name)? {
            let camera = fields.camera()?;
            return Ok(Self { camera, calibrated_with: Vec::new(), failed: None });
        }
        let own: Own = parse(text)?;
        chosen(vec![(String::new(), ())], name)?;
        let Own { width, height, focal_px, centre_px, model, spline, distortion, .. } = own;
        let keys = ["width", "height", "focal_px", "centre_px", "distortion"];
        let fields = Fields { keys, width, height, focal_px, centre_px, model, spline, distortion };
        Ok(Self {
            camera: fields.camera()?,
            calibrated_with: own.calibrated_with,
            failed: own.failed,
        })
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
