//! Cameras in the file formats of other programs: OpenCV, ROS, Kalibr, mrcal, COLMAP and
//! nerfstudio.
//!
//! Image coordinates are converted to the convention of each program: COLMAP and nerfstudio put the
//! centre of the first pixel at (½, ½), not at (0, 0). A lens model that the format does not support is
//! an error; it is not approximated.

use std::fmt::Write as _;

use glam::{DMat3, DMat4};
use serde_json::json;

use crate::export::GENERATOR;
use deltille_calibrate::Model;
use deltille_core::camera::{Camera, Lens, Pose, SplineGrid};
use deltille_core::name;

/// Error of a format that does not support a lens model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{format} does not support {lens}; supported models: {models}")]
pub struct FormatError {
    /// The format.
    format: &'static str,
    /// The lens of the camera.
    lens: String,
    /// The models of the format.
    models: String,
}

/// A lens model of another program: the largest of our models that it covers, its number of
/// coefficients, and its name in that program.
type Theirs = (Model, usize, &'static str);

/// All coefficients of the lens.
const ALL: usize = usize::MAX;

/// The models of a program, those with fewer coefficients first.
pub(super) struct Models {
    pub(super) format: &'static str,
    models: &'static [Theirs],
}

/// Perspective lenses have no name.
pub(super) const OPENCV: Models = Models {
    format: "opencv",
    models: &[
        (Model::Radtan, 4, ""),
        (Model::Radtan5, 5, ""),
        (Model::Rational, 8, ""),
        (Model::ThinPrism, 12, ""),
        (Model::KannalaBrandt(4), 4, "fisheye"),
    ],
};

pub(super) const ROS: Models = Models {
    format: "ros",
    models: &[
        (Model::Radtan, 5, "plumb_bob"),
        (Model::Radtan5, 5, "plumb_bob"),
        (Model::Rational, 8, "rational_polynomial"),
        (Model::KannalaBrandt(4), 4, "equidistant"),
    ],
};

/// Names of the camera and its distortion. Without distortion, the lens parameters precede the focal lengths.
pub(super) const KALIBR: Models = Models {
    format: "kalibr",
    models: &[
        (Model::Radtan, 4, "pinhole radtan"),
        (Model::KannalaBrandt(4), 4, "pinhole equidistant"),
        (Model::Eucm, ALL, "eucm none"),
        (Model::DoubleSphere, ALL, "ds none"),
    ],
};

pub(super) const COLMAP: Models = Models {
    format: "colmap",
    models: &[
        (Model::Radtan, 4, "OPENCV"),
        (Model::Radtan5, 8, "FULL_OPENCV"),
        (Model::Rational, 8, "FULL_OPENCV"),
        (Model::KannalaBrandt(4), 4, "OPENCV_FISHEYE"),
    ],
};

pub(super) const NERFSTUDIO: Models = Models {
    format: "nerfstudio",
    models: &[
        (Model::Radtan, 5, "OPENCV"),
        (Model::Radtan5, 5, "OPENCV"),
        (Model::KannalaBrandt(4), 4, "OPENCV_FISHEYE"),
    ],
};

pub(super) const MRCAL: Models = Models {
    format: "mrcal",
    models: &[
        (Model::Radtan, 4, "OPENCV4"),
        (Model::Radtan5, 5, "OPENCV5"),
        (Model::Rational, 8, "OPENCV8"),
        (Model::ThinPrism, 12, "OPENCV12"),
        (Model::SPLINE, ALL, "SPLINED_STEREOGRAPHIC"),
    ],
};

impl Models {
    /// Our names of the supported models.
    pub(super) fn names(&self) -> Vec<String> {
        self.models.iter().map(|(model, ..)| model.to_string()).collect()
    }

    /// The name of the lens of a camera in this format, and its coefficients.
    fn of(&self, camera: &Camera) -> Result<(&'static str, Vec<f64>), FormatError> {
        let mut values = camera.lens.parameters();
        let needed = values.iter().rposition(|&k| k != 0.0).map_or(0, |last| last + 1);
        let holds =
            |(model, count, _): &&Theirs| model.kind() == camera.lens.kind() && needed <= *count;
        if let Some(&(_, count, name)) = self.models.iter().find(holds) {
            values.resize(if count == ALL { values.len() } else { count }, 0.0);
            return Ok((name, values));
        }
        let title = camera.lens.kind().title();
        let lens = match camera.lens {
            Lens::Spline(_) => title.to_owned(),
            _ => format!("{title} with {}", camera.lens.names()[..needed].join(" ")),
        };
        Err(FormatError { format: self.format, lens, models: self.names().join(", ") })
    }
}

/// The camera as YAML for OpenCV `FileStorage`; focal lengths and principal point in px.
///
/// ```
/// use deltille_core::camera::Camera;
/// use deltille_files::export::camera::opencv;
///
/// let camera = Camera::pinhole(640, 480, 1.0);
/// let text = opencv(&camera)?;
/// assert_eq!(Camera::from_yaml(&text)?, camera);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Returns an error if OpenCV does not support the lens model.
pub fn opencv(camera: &Camera) -> Result<String, FormatError> {
    let Coefficients { is_fisheye, values } = opencv_coefficients(camera)?;
    let model = if is_fisheye { "distortion_model: fisheye\n" } else { "" };
    Ok(format!(
        "%YAML:1.0\n---\n# {GENERATOR}\nimage_width: {}\nimage_height: {}\ncamera_matrix: {}{model}\
         distortion_coefficients: {}",
        camera.width,
        camera.height,
        opencv_matrix(3, 3, &matrix(camera)),
        opencv_matrix(1, values.len(), &values),
    ))
}

/// The distortion coefficients of a lens in OpenCV.
#[derive(Clone, Debug, PartialEq)]
pub struct Coefficients {
    /// Whether they belong to the module `fisheye`: k1 k2 k3 k4.
    pub is_fisheye: bool,
    /// The first 4, 5, 8 or 12 of k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, as few as possible, or those of a fisheye.
    pub values: Vec<f64>,
}

/// The coefficients of a camera for OpenCV.
///
/// # Errors
/// Returns an error if OpenCV does not support the lens model.
pub fn opencv_coefficients(camera: &Camera) -> Result<Coefficients, FormatError> {
    let (name, values) = OPENCV.of(camera)?;
    Ok(Coefficients { is_fisheye: !name.is_empty(), values })
}

fn opencv_matrix(rows: usize, cols: usize, data: &[f64]) -> String {
    format!(
        "!!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {} ]\n",
        list(data)
    )
}

/// The camera file of ROS (`camera_info` as YAML), with the camera name.
///
/// # Errors
/// Returns an error if ROS does not support the lens model.
pub fn ros(camera: &Camera, name: &str) -> Result<String, FormatError> {
    let (model, coefficients) = ROS.of(camera)?;
    let [fx, _, cx, _, fy, cy, ..] = matrix(camera);
    let matrix_of = |rows: usize, cols: usize, data: &[f64]| {
        format!("\n  rows: {rows}\n  cols: {cols}\n  data: [{}]\n", list(data))
    };
    let one = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let projection = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    Ok(format!(
        "# {GENERATOR}\nimage_width: {}\nimage_height: {}\ncamera_name: {}\ncamera_matrix:{}distortion_model: \
         {model}\ndistortion_coefficients:{}rectification_matrix:{}projection_matrix:{}",
        camera.width,
        camera.height,
        serde_json::Value::from(name),
        matrix_of(3, 3, &matrix(camera)),
        matrix_of(1, coefficients.len(), &coefficients),
        matrix_of(3, 3, &one),
        matrix_of(3, 4, &projection),
    ))
}

/// The camera chain of Kalibr: cameras, each with its camera_from_rig (mm, written in metres).
/// `overlaps` lists, for each camera, the indices of the cameras whose field of view overlaps its own;
/// it may be shorter. Topics are `/cam0/image_raw` and so on.
///
/// # Errors
/// Returns an error if Kalibr does not support the lens model.
pub fn kalibr(cameras: &[(&Camera, Pose)], overlaps: &[Vec<usize>]) -> Result<String, FormatError> {
    let mut text = format!("# {GENERATOR}\n");
    for (n, (camera, camera_from_rig)) in cameras.iter().enumerate() {
        // Writing to a String cannot fail.
        let _ = write!(text, "cam{n}:\n{}", kalibr_camera(camera)?);
        let others = overlaps.get(n).map_or(&[][..], Vec::as_slice);
        let _ = writeln!(text, "  cam_overlaps: {others:?}\n  rostopic: /cam{n}/image_raw");
        if let Some((_, before_from_rig)) = n.checked_sub(1).map(|before| cameras[before]) {
            let motion = camera_from_rig.after(&before_from_rig.inverse());
            text += "  T_cn_cnm1:\n";
            let rotation = DMat3::from_quat(motion.rotation);
            // Kalibr uses metres.
            let shift = motion.translation / 1000.0;
            for i in 0..3 {
                let row = rotation.row(i).to_array();
                let _ = writeln!(text, "  - [{}]", list(&[&row[..], &[shift[i]]].concat()));
            }
            text += "  - [0.0, 0.0, 0.0, 1.0]\n";
        }
    }
    Ok(text)
}

fn kalibr_camera(camera: &Camera) -> Result<String, FormatError> {
    let (name, mut coefficients) = KALIBR.of(camera)?;
    let (model, distortion) = name.split_once(' ').unwrap_or_default();
    let ends = [camera.focal_px, camera.centre_px].map(|v| v.to_array()).concat();
    let before = if distortion == "none" { std::mem::take(&mut coefficients) } else { Vec::new() };
    let intrinsics = [before, ends].concat();
    Ok(format!(
        "  camera_model: {model}\n  intrinsics: [{}]\n  distortion_model: {distortion}\n  \
         distortion_coeffs: [{}]\n  resolution: [{}, {}]\n",
        list(&intrinsics),
        list(&coefficients),
        camera.width,
        camera.height,
    ))
}

/// The camera model of mrcal, at the origin of the reference frame; the only format here that
/// stores spline lenses.
///
/// # Errors
/// Returns an error if mrcal does not support the lens model.
pub fn mrcal(camera: &Camera) -> Result<String, FormatError> {
    let (model, coefficients) = MRCAL.of(camera)?;
    let grid = match &camera.lens {
        Lens::Spline(spline) => {
            let SplineGrid { degree, columns, rows, fov_x_deg } = spline.grid();
            format!("_order={degree}_Nx={columns}_Ny={rows}_fov_x_deg={fov_x_deg}")
        }
        _ => String::new(),
    };
    let [focal, centre] = [camera.focal_px, camera.centre_px].map(|v| v.to_array());
    let intrinsics = [&focal, &centre, &coefficients[..]].concat();
    Ok(format!(
        "# {GENERATOR}\n{{\n    'lensmodel': 'LENSMODEL_{model}{grid}',\n    'intrinsics': [ {} ],\n    \
         'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n    'imagersize': [ {}, {} ]\n}}\n",
        list(&intrinsics),
        camera.width,
        camera.height,
    ))
}

/// The `cameras.txt` of COLMAP, with cameras numbered from 1.
///
/// # Errors
/// Returns an error if COLMAP does not support the lens model.
pub fn colmap(cameras: &[&Camera]) -> Result<String, FormatError> {
    let mut text = format!("# {GENERATOR}\n# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n");
    for (n, camera) in (1..).zip(cameras) {
        let (model, parameters) = colmap_camera(camera)?;
        let _ = write!(text, "{n} {model} {} {}", camera.width, camera.height);
        for value in parameters {
            let _ = write!(text, " {value:?}");
        }
        text.push('\n');
    }
    Ok(text)
}

/// The `rig_config.json` of COLMAP: cameras by name, each with its camera_from_rig. The images of a camera are in a folder with
/// its name. The first camera is the reference sensor of the rig.
///
/// # Errors
/// Returns an error if COLMAP does not support the lens model.
pub fn colmap_rig(cameras: &[(&str, &Camera, Pose)]) -> Result<String, FormatError> {
    let mut entries = Vec::with_capacity(cameras.len());
    for (n, (name, camera, camera_from_rig)) in cameras.iter().enumerate() {
        let (model, parameters) = colmap_camera(camera)?;
        let mut entry = json!({
            "image_prefix": format!("{name}/"),
            "camera_model_name": model,
            "camera_params": parameters,
        });
        if n == 0 {
            entry["ref_sensor"] = json!(true);
        } else {
            let [x, y, z, w] = camera_from_rig.rotation.to_array();
            entry["cam_from_rig_rotation"] = json!([w, x, y, z]);
            entry["cam_from_rig_translation"] = json!(camera_from_rig.translation.to_array());
        }
        entries.push(entry);
    }
    Ok(deltille_core::json::to_text(&json!([{ "cameras": entries }]), 3))
}

/// Name and parameters of a COLMAP camera.
fn colmap_camera(camera: &Camera) -> Result<(&'static str, Vec<f64>), FormatError> {
    let (model, coefficients) = COLMAP.of(camera)?;
    let [focal, centre] = [camera.focal_px, camera.centre_px + 0.5].map(|v| v.to_array());
    Ok((model, [&focal, &centre, &coefficients[..]].concat()))
}

/// The `transforms.json` of nerfstudio: the camera, and for each image the inverse of its
/// camera_from_target, with lengths in mm and camera axes as in OpenGL (y up, z backwards). An
/// image path that leads out of its folder is shortened to its last part.
///
/// # Errors
/// Returns an error if nerfstudio does not support the lens model.
pub fn nerfstudio(camera: &Camera, views: &[(&str, Pose)]) -> Result<String, FormatError> {
    let (model, coefficients) = NERFSTUDIO.of(camera)?;
    let frames = views.iter().map(|(image, camera_from_target)| {
        let back = camera_from_target.inverse();
        let flip = DMat3::from_diagonal(glam::DVec3::new(1.0, -1.0, -1.0));
        let rotation = DMat3::from_quat(back.rotation) * flip;
        let mut matrix = DMat4::from_mat3(rotation);
        matrix.w_axis = back.translation.extend(1.0);
        let rows = matrix.transpose().to_cols_array_2d();
        json!({ "file_path": name::within(image), "transform_matrix": rows })
    });
    let mut file = json!({
        "camera_model": model,
        "w": camera.width, "h": camera.height,
        "fl_x": camera.focal_px.x, "fl_y": camera.focal_px.y,
        "cx": camera.centre_px.x + 0.5, "cy": camera.centre_px.y + 0.5,
        "frames": frames.collect::<Vec<_>>(),
    });
    for (name, value) in camera.lens.names().iter().zip(coefficients) {
        file[name] = json!(value);
    }
    Ok(deltille_core::json::to_text(&file, 3))
}

/// Row-major.
fn matrix(camera: &Camera) -> [f64; 9] {
    let (focal, centre) = (camera.focal_px, camera.centre_px);
    [focal.x, 0.0, centre.x, 0.0, focal.y, centre.y, 0.0, 0.0, 1.0]
}

/// Numbers in a form that every YAML reader recognises as floating-point: `600.0`, `1.0e-5`.
fn list(values: &[f64]) -> String {
    let words = values.iter().map(|value| match format!("{value:?}") {
        word if word.contains('.') => word,
        // YAML 1.1 requires a decimal point in the mantissa.
        word => word.replacen('e', ".0e", 1),
    });
    words.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(model: Model, count: usize) -> Camera {
        let lens = model.lens();
        let mut values = lens.parameters();
        for (i, value) in values.iter_mut().take(count).enumerate() {
            *value = [0.25, 1e-5, -1e-7, 0.125][i % 4];
        }
        Camera::centred(640, 480, 500.0, lens.with_parameters(&values))
    }

    /// Every model in every format that supports it, except nerfstudio's, which is not read.
    #[test]
    fn files_read_back_as_the_camera() {
        let mut count = 0;
        for model in [
            Model::Radtan,
            Model::Radtan5,
            Model::Rational,
            Model::ThinPrism,
            Model::KannalaBrandt(4),
            Model::Eucm,
            Model::DoubleSphere,
            Model::SPLINE,
        ] {
            let camera = camera(model, model.parameter_count());
            for text in [
                opencv(&camera),
                ros(&camera, "left: \"1\""),
                kalibr(&[(&camera, Pose::IDENTITY)], &[]),
                colmap(&[&camera]),
                mrcal(&camera),
            ]
            .into_iter()
            .flatten()
            {
                assert_eq!(Camera::from_yaml(&text).unwrap(), camera, "{text}");
                count += 1;
            }
        }
        assert_eq!(count, 22);
    }

    #[test]
    fn formats_refuse_models_they_do_not_support() {
        for (model, count, carried) in [
            (Model::Radtan, 4, [true, true, true, true, true]),
            (Model::Radtan5, 5, [true, true, false, true, true]),
            (Model::Rational, 8, [true, true, false, true, false]),
            (Model::ThinPrism, 12, [true, false, false, false, false]),
            (Model::KannalaBrandt(4), 4, [true, true, true, true, true]),
            (Model::KannalaBrandt(5), 5, [false; 5]),
            (Model::Eucm, 0, [false, false, true, false, false]),
            (Model::DoubleSphere, 0, [false, false, true, false, false]),
            (Model::Pupil, 10, [false; 5]),
            (Model::SPLINE, 0, [false; 5]),
        ] {
            let camera = camera(model, count);
            let texts = [
                opencv(&camera),
                ros(&camera, "camera"),
                kalibr(&[(&camera, Pose::IDENTITY)], &[]),
                colmap(&[&camera]),
                nerfstudio(&camera, &[("a.png", Pose::IDENTITY)]),
            ];
            assert_eq!(texts.map(|text| text.is_ok()), carried, "{model}");
        }
        let said =
            kalibr(&[(&camera(Model::Radtan5, 5), Pose::IDENTITY)], &[]).unwrap_err().to_string();
        assert!(said.starts_with("kalibr does not support a perspective lens with k1 k2 p1 p2 k3"));
    }

    #[test]
    fn rig_files_contain_the_camera_poses() {
        let radtan = camera(Model::Radtan, 4);
        let turn = glam::DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
        let beside = Pose { rotation: turn, translation: glam::DVec3::new(-120.0, 0.0, 0.0) };
        let text =
            kalibr(&[(&radtan, Pose::IDENTITY), (&radtan, beside)], &[vec![1], vec![0]]).unwrap();
        assert!(text.contains("\ncam1:\n") && text.contains("  T_cn_cnm1:\n  - ["), "{text}");
        let last = text.lines().nth_back(3).unwrap();
        assert!(last.ends_with(", -0.12]"), "{text}");
        let text = colmap_rig(&[("l", &radtan, Pose::IDENTITY), ("r", &radtan, beside)]).unwrap();
        let file: serde_json::Value = serde_json::from_str(&text).unwrap();
        let right = &file[0]["cameras"][1];
        assert_eq!(file[0]["cameras"][0]["ref_sensor"], json!(true));
        assert_eq!(right["image_prefix"], json!("r/"));
        assert_eq!(right["cam_from_rig_translation"], json!([-120.0, 0.0, 0.0]));
        assert_eq!(right["cam_from_rig_rotation"][0], json!(turn.w));
        assert_eq!(colmap(&[&radtan, &radtan]).unwrap().lines().count(), 4);
    }

    #[test]
    fn texts_follow_the_documentation_of_the_programs() {
        let radtan = camera(Model::Radtan, 4);
        assert_eq!(
            kalibr(&[(&radtan, Pose::IDENTITY)], &[]).unwrap(),
            format!("# {GENERATOR}\n")
                + "cam0:\n  camera_model: pinhole\n  intrinsics: [500.0, 500.0, 319.5, 239.5]\n  \
             distortion_model: radtan\n  distortion_coeffs: [0.25, 1.0e-5, -1.0e-7, 0.125]\n  \
             resolution: [640, 480]\n  cam_overlaps: []\n  rostopic: /cam0/image_raw\n"
        );
        let text = colmap(&[&radtan]).unwrap();
        let last = text.lines().last().unwrap();
        assert_eq!(last, "1 OPENCV 640 480 500.0 500.0 320.0 240.0 0.25 1e-5 -1e-7 0.125");
        let text = nerfstudio(&radtan, &[("a.png", Pose::IDENTITY)]).unwrap();
        let file: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(file["frames"][0]["transform_matrix"][1], json!([0.0, -1.0, 0.0, 0.0]));
        assert_eq!(file["p1"], json!(-1e-7));
    }
}
