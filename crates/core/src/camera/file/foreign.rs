//! Camera files of OpenCV, ROS, Kalibr, COLMAP and mrcal, recognised by their keys.
//!
//! Pixel centres are at integers, except in COLMAP, which places them at half-integers. A lens that no model here
//! represents exactly is rejected.

use std::collections::BTreeMap;

use glam::DVec2;
use serde::Deserialize;

use super::fields::{CameraFileError, Fields, key, parse};
use crate::camera::LensKind::{
    self, BrownConrady, DoubleSphere, ExtendedUnified, KannalaBrandt, Spline,
};
use crate::camera::SplineGrid;
use crate::words::{cut, quoted};

/// Reads a camera of another program; `name` selects one of several. `None` if no key of these programs occurs.
pub(super) fn read(text: &str, name: Option<&str>) -> Result<Option<Fields>, CameraFileError> {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let first = lines.clone().find(|line| !line.starts_with('#')).unwrap_or_default();
    let found = if is_colmap(first) {
        colmap(text, name)?
    } else if text.contains("camera_model:") {
        kalibr(text, name)?
    } else {
        let read = if text.contains("'lensmodel'") {
            mrcal
        } else if text.contains("camera_matrix") {
            opencv
        } else {
            return Ok(None);
        };
        chosen(vec![(String::new(), ())], name)?;
        read(text)?
    };
    Ok(Some(found))
}

/// The camera with this name, or the only one.
pub(super) fn chosen<T>(
    mut cameras: Vec<(String, T)>,
    name: Option<&str>,
) -> Result<T, CameraFileError> {
    let at = match name {
        Some(name) => cameras.iter().position(|(own, _)| own == name),
        None => (cameras.len() == 1).then_some(0),
    };
    if let Some(at) = at {
        return Ok(cameras.swap_remove(at).1);
    }
    let names: Vec<&str> = cameras.iter().map(|(own, _)| own.as_str()).collect();
    Err(CameraFileError::Choice(match (name, names.as_slice()) {
        (Some(name), [""]) => format!("its only camera has no name; omit `:{}`", cut(name)),
        (_, names) => format!(
            "it contains the cameras {}; append the name of one to the path, as in `:{}`",
            cut(&names.join(", ")),
            names.first().unwrap_or(&"cam0"),
        ),
    }))
}

/// Error of a model that has no exact counterpart here.
fn unsupported(field: &'static str, model: &str, supported: &str) -> CameraFileError {
    let model = quoted(model);
    key(field, format!("no lens here represents {model} exactly; calibrate with {supported}"))
}

/// Splits numbers into the given number of focal lengths, cx, cy, and the rest.
fn split(values: &[f64], focals: usize) -> Option<(DVec2, DVec2, Vec<f64>)> {
    let (focal, rest) = values.split_at_checked(focals)?;
    let (centre, rest) = rest.split_at_checked(2)?;
    let focal = DVec2::new(*focal.first()?, *focal.last()?);
    Some((focal, DVec2::from_slice(centre), rest.to_vec()))
}

#[derive(Deserialize)]
struct OpenCv {
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

/// YAML without the version directive and the tag of OpenCV, which other YAML parsers do not know.
fn plain(text: &str) -> String {
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with('%')).collect();
    lines.join("\n").replace("!!opencv-matrix", "")
}

/// The file of OpenCV or ROS.
fn opencv(text: &str) -> Result<Fields, CameraFileError> {
    let file: OpenCv = parse(&plain(text))?;
    file.camera_matrix.check().map_err(|problem| key("camera_matrix", problem))?;
    let coefficients = file.distortion_coefficients;
    coefficients.check().map_err(|problem| key("distortion_coefficients", problem))?;
    let m: [f64; 9] = file.camera_matrix.data.try_into().map_err(|data: Vec<f64>| {
        key("camera_matrix", format!("it has {} numbers, but needs 9", data.len()))
    })?;
    if [m[1], m[3], m[6], m[7], m[8]] != [0.0, 0.0, 0.0, 0.0, 1.0] {
        let problem = "it is not of the form `fx, 0, cx, 0, fy, cy, 0, 0, 1`, row by row";
        return Err(key("camera_matrix", problem));
    }
    let model = match file.distortion_model.as_deref() {
        None | Some("plumb_bob" | "rational_polynomial") => BrownConrady,
        Some("equidistant" | "fisheye") => KannalaBrandt,
        Some(other) => {
            return Err(key(
                "distortion_model",
                format!("unknown distortion model {}", quoted(other)),
            ));
        }
    };
    Ok(Fields {
        keys: [
            "image_width",
            "image_height",
            "camera_matrix",
            "camera_matrix",
            "distortion_coefficients",
        ],
        width: file.image_width,
        height: file.image_height,
        focal_px: DVec2::new(m[0], m[4]),
        centre_px: DVec2::new(m[2], m[5]),
        model,
        spline: None,
        distortion: coefficients.data,
    })
}

/// A camera of Kalibr. `intrinsics` begins with the parameters of lenses that are not `pinhole`.
#[derive(Deserialize)]
struct Kalibr {
    camera_model: String,
    intrinsics: Vec<f64>,
    distortion_model: String,
    #[serde(default)]
    distortion_coeffs: Vec<f64>,
    resolution: [u32; 2],
}

/// The models of Kalibr that have a counterpart here, as `kalibr_calibrate_cameras` names them.
const KALIBR: &str = "pinhole-radtan, pinhole-equi, omni-none, eucm-none or ds-none";

/// The camera chain of Kalibr. Its unified model is x/(Z + ξ d), with d the distance of the point, so it is EUCM with
/// α = ξ/(1 + ξ), β = 1, and focal lengths divided by 1 + ξ.
fn kalibr(text: &str, name: Option<&str>) -> Result<Fields, CameraFileError> {
    let cameras: BTreeMap<String, Kalibr> = parse(&plain(text))?;
    let camera = chosen(cameras.into_iter().collect(), name)?;
    let Kalibr { camera_model, distortion_model, .. } = &camera;
    let is_distorted = camera.distortion_coeffs.iter().any(|&k| k != 0.0);
    let (model, parameters) = match (camera_model.as_str(), distortion_model.as_str(), is_distorted)
    {
        ("pinhole", "radtan", _) | ("pinhole", "none", false) => (BrownConrady, 0),
        ("pinhole", "equidistant", _) => (KannalaBrandt, 0),
        ("omni", "radtan" | "none", false) => (ExtendedUnified, 1),
        ("eucm", "none", false) => (ExtendedUnified, 2),
        ("ds", "none", false) => (DoubleSphere, 2),
        _ => {
            let (field, model) = ("distortion_model", format!("{camera_model}-{distortion_model}"));
            return Err(unsupported(field, &model, KALIBR));
        }
    };
    let numbers = camera.intrinsics.split_at_checked(parameters);
    let numbers = numbers.and_then(|(lens, rest)| Some((lens, split(rest, 2)?)));
    let Some((lens, (mut focal_px, centre_px, _))) =
        numbers.filter(|(_, (_, _, rest))| rest.is_empty())
    else {
        let (found, needed) = (camera.intrinsics.len(), parameters + 4);
        let problem = format!("it has {found} numbers, but `{camera_model}` needs {needed}");
        return Err(key("intrinsics", problem));
    };
    let distortion = match *lens {
        [] => camera.distortion_coeffs,
        [xi] => {
            focal_px /= 1.0 + xi;
            vec![xi / (1.0 + xi), 1.0]
        }
        _ => lens.to_vec(),
    };
    let of_lens = if parameters == 0 { "distortion_coeffs" } else { "intrinsics" };
    let [width, height] = camera.resolution;
    Ok(Fields {
        keys: ["resolution", "resolution", "intrinsics", "intrinsics", of_lens],
        width,
        height,
        focal_px,
        centre_px,
        model,
        spline: None,
        distortion,
    })
}

/// A line of `cameras.txt`: CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[].
fn is_colmap(line: &str) -> bool {
    let mut words = line.split_whitespace();
    let is_id = words.next().is_some_and(|id| id.bytes().all(|b| b.is_ascii_digit()));
    is_id && words.next().is_some_and(|model| model.starts_with(|c: char| c.is_ascii_uppercase()))
}

/// The models of COLMAP that have a counterpart here: name, number of focal lengths, and lens with its number of coefficients.
const COLMAP: &[(&str, usize, LensKind, usize)] = &[
    ("SIMPLE_PINHOLE", 1, BrownConrady, 0),
    ("PINHOLE", 2, BrownConrady, 0),
    ("SIMPLE_RADIAL", 1, BrownConrady, 1),
    ("RADIAL", 1, BrownConrady, 2),
    ("OPENCV", 2, BrownConrady, 4),
    ("FULL_OPENCV", 2, BrownConrady, 8),
    ("SIMPLE_FISHEYE", 1, KannalaBrandt, 0),
    ("FISHEYE", 2, KannalaBrandt, 0),
    ("SIMPLE_RADIAL_FISHEYE", 1, KannalaBrandt, 1),
    ("RADIAL_FISHEYE", 1, KannalaBrandt, 2),
    ("OPENCV_FISHEYE", 2, KannalaBrandt, 4),
    ("EUCM", 2, ExtendedUnified, 2),
];

/// The `cameras.txt` of COLMAP, whose cameras are named by their CAMERA_ID.
fn colmap(text: &str, name: Option<&str>) -> Result<Fields, CameraFileError> {
    let lines = text.lines().map(str::trim).filter(|line| is_colmap(line));
    let named =
        lines.map(|line| (line.split_whitespace().next().unwrap_or_default().to_owned(), line));
    let line = chosen(named.collect(), name)?;
    let words: Vec<&str> = line.split_whitespace().skip(1).collect();
    let &[model, width, height, ref parameters @ ..] = words.as_slice() else {
        return Err(CameraFileError::Yaml("a line of COLMAP has fewer than 4 words".to_owned()));
    };
    let Some(&(_, focals, lens, count)) = COLMAP.iter().find(|(own, ..)| *own == model) else {
        let names: Vec<&str> = COLMAP.iter().map(|(own, ..)| *own).collect();
        return Err(unsupported("MODEL", model, &format!("one of {}", names.join(", "))));
    };
    let number = |word: &&str| {
        let problem = |_| key("PARAMS", format!("{} is not a number", quoted(word)));
        word.parse::<f64>().map_err(problem)
    };
    let parameters = parameters.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    let parts = split(&parameters, focals).filter(|(.., rest)| rest.len() == count);
    let (focal_px, centre_px, distortion) = parts.ok_or_else(|| {
        let (found, needed) = (parameters.len(), focals + 2 + count);
        key("PARAMS", format!("there are {found} numbers, but {model} has {needed}"))
    })?;
    let side = |name, word: &str| {
        word.parse().map_err(|_| key(name, format!("{} is not a size in px", quoted(word))))
    };
    Ok(Fields {
        keys: ["WIDTH", "HEIGHT", "PARAMS", "PARAMS", "PARAMS"],
        width: side("WIDTH", width)?,
        height: side("HEIGHT", height)?,
        focal_px,
        centre_px: centre_px - 0.5,
        model: lens,
        spline: None,
        distortion,
    })
}

#[derive(Deserialize)]
struct Mrcal {
    lensmodel: String,
    intrinsics: Vec<f64>,
    imagersize: [u32; 2],
}

/// The models of mrcal that have a counterpart here.
const MRCAL: &str = "LENSMODEL_PINHOLE, LENSMODEL_STEREOGRAPHIC, LENSMODEL_OPENCV4, 5, 8 or 12, or \
                     LENSMODEL_SPLINED_STEREOGRAPHIC";

/// The camera model of mrcal, a Python dictionary that is YAML except for `optimization_inputs`, which may be large. The
/// stereographic projection is EUCM with α = ½ and β = 1.
fn mrcal(text: &str) -> Result<Fields, CameraFileError> {
    let is_wanted = |line: &&str| !line.trim_start().starts_with("'optimization_inputs'");
    let file: Mrcal = parse(&text.lines().filter(is_wanted).collect::<Vec<_>>().join("\n"))?;
    let (focal_px, centre_px, mut distortion) = split(&file.intrinsics, 2).ok_or_else(|| {
        let found = file.intrinsics.len();
        key("intrinsics", format!("it has {found} numbers, but needs at least 4"))
    })?;
    let name = file.lensmodel.strip_prefix("LENSMODEL_").unwrap_or_default();
    let mut spline = None;
    let (model, count) = match name {
        "PINHOLE" => (BrownConrady, 0),
        "STEREOGRAPHIC" => (ExtendedUnified, 0),
        "OPENCV4" => (BrownConrady, 4),
        "OPENCV5" => (BrownConrady, 5),
        "OPENCV8" => (BrownConrady, 8),
        "OPENCV12" => (BrownConrady, 12),
        _ => {
            spline = spline_grid(name);
            let unknown = || unsupported("lensmodel", &file.lensmodel, MRCAL);
            let grid = spline.ok_or_else(unknown)?;
            (Spline, grid.columns.saturating_mul(grid.rows).saturating_mul(2))
        }
    };
    if distortion.len() != count {
        let (found, needed) = (file.intrinsics.len(), count.saturating_add(4));
        let problem = format!("it has {found} numbers, but {} needs {needed}", file.lensmodel);
        return Err(key("intrinsics", problem));
    }
    if model == ExtendedUnified {
        distortion = vec![0.5, 1.0];
    }
    let [width, height] = file.imagersize;
    Ok(Fields {
        keys: ["imagersize", "imagersize", "intrinsics", "intrinsics", "intrinsics"],
        width,
        height,
        focal_px,
        centre_px,
        model,
        spline,
        distortion,
    })
}

/// The grid in a name such as `SPLINED_STEREOGRAPHIC_order=3_Nx=30_Ny=20_fov_x_deg=170`.
fn spline_grid(name: &str) -> Option<SplineGrid> {
    let settings = name.strip_prefix("SPLINED_STEREOGRAPHIC_")?;
    let of = |key: &str| settings.split(key).nth(1)?.split('_').next()?.parse::<u32>().ok();
    let (degree, columns, rows) = (of("order=")?, of("Nx=")?, of("Ny=")?);
    let [degree, columns, rows] = [degree, columns, rows].map(|number| number as usize);
    Some(SplineGrid { degree, columns, rows, fov_x_deg: of("fov_x_deg=")? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, CameraFile};
    use glam::DVec3;

    const AT: DVec3 = DVec3::new(0.3, -0.4, 1.0);

    /// The image of a point by a formula of the form f s (X, Y) + c, all focal lengths 400 px, c = (320, 240).
    fn assert_images(text: &str, s: f64) {
        let camera = Camera::from_yaml(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let expected = 400.0 * s * AT.truncate() + DVec2::new(320.0, 240.0);
        let found = camera.project(AT).unwrap();
        assert!(found.abs_diff_eq(expected, 1e-9), "{text}: {found} instead of {expected}");
        assert_eq!([camera.width, camera.height], [640, 480]);
    }

    fn kalibr(model: &str, intrinsics: &str, distortion: &str, coefficients: &str) -> String {
        format!(
            "cam0:\n  cam_overlaps: [1]\n  camera_model: {model}\n  distortion_coeffs: [{coefficients}]\n  \
             distortion_model: {distortion}\n  intrinsics: [{intrinsics}]\n  resolution: [640, 480]\n  \
             rostopic: /cam0/image_raw\n"
        )
    }

    fn mrcal(model: &str, intrinsics: &str) -> String {
        format!(
            "# Generated on 2024-01-01 00:00:00\n\n{{\n    'lensmodel':  '{model}',\n\n    # intrinsics are fx,fy,cx,cy,…\n    \
             'intrinsics': [ {intrinsics},],\n\n    'valid_intrinsics_region': [\n    [ 0, 0 ],\n    [ 9, 9 ],\n],\n    \
             'extrinsics': [ 0, 0, 0, 0, 0, 0,],\n\n    'imagersize': [ 640, 480,],\n\n    'icam_intrinsics': 0,\n\n    \
             'optimization_inputs': b'{}',\n\n}}\n",
            "P){[#x".repeat(20_000)
        )
    }

    /// With the formulas of the programs' documentation, whose variables these are.
    #[test]
    fn points_are_imaged_as_the_programs_do() {
        let r = AT.truncate().length();
        let (theta, d) = (r.atan(), AT.length());
        let radial = 1.0 - 0.1 * r.powi(2);
        let fisheye = theta / r * (1.0 - 0.1 * theta.powi(2));
        let eucm = 1.0 / (0.6 * (1.2 * r * r + 1.0).sqrt() + 0.4);
        for (line, s) in [
            ("SIMPLE_PINHOLE 640 480 400 320.5 240.5", 1.0),
            ("PINHOLE 640 480 400 400 320.5 240.5", 1.0),
            ("SIMPLE_RADIAL 640 480 400 320.5 240.5 -0.1", radial),
            ("RADIAL 640 480 400 320.5 240.5 -0.1 0", radial),
            ("OPENCV 640 480 400 400 320.5 240.5 -0.1 0 0 0", radial),
            ("FULL_OPENCV 640 480 400 400 320.5 240.5 -0.1 0 0 0 0 0 0 0", radial),
            ("SIMPLE_FISHEYE 640 480 400 320.5 240.5", theta / r),
            ("FISHEYE 640 480 400 400 320.5 240.5", theta / r),
            ("SIMPLE_RADIAL_FISHEYE 640 480 400 320.5 240.5 -0.1", fisheye),
            ("RADIAL_FISHEYE 640 480 400 320.5 240.5 -0.1 0", fisheye),
            ("OPENCV_FISHEYE 640 480 400 400 320.5 240.5 -0.1 0 0 0", fisheye),
            ("EUCM 640 480 400 400 320.5 240.5 0.6 1.2", eucm),
        ] {
            let text = format!("# Camera list\n# Number of cameras: 1\n7 {line}\n");
            assert_images(&text, s);
        }
        let (ends, xi) = ("400, 400, 320, 240", 1.3);
        let sphere = AT + DVec3::Z * -0.2 * d;
        let inner = sphere.z;
        let ds = 1.0 / (0.55 * (r * r + inner * inner).sqrt() + 0.45 * inner);
        for (text, s) in [
            (kalibr("pinhole", ends, "none", ""), 1.0),
            (kalibr("pinhole", ends, "radtan", "-0.1, 0, 0, 0"), radial),
            (kalibr("pinhole", ends, "equidistant", "-0.1, 0, 0, 0"), fisheye),
            (kalibr("omni", &format!("{xi}, {ends}"), "none", ""), 1.0 / (AT.z + xi * d)),
            (
                kalibr("omni", &format!("{xi}, {ends}"), "radtan", "0, 0, 0, 0"),
                1.0 / (AT.z + xi * d),
            ),
            (kalibr("eucm", &format!("0.6, 1.2, {ends}"), "none", ""), eucm),
            (kalibr("ds", &format!("-0.2, 0.55, {ends}"), "none", ""), ds),
            (mrcal("LENSMODEL_PINHOLE", ends), 1.0),
            (mrcal("LENSMODEL_STEREOGRAPHIC", ends), 2.0 * (theta / 2.0).tan() / r),
            (mrcal("LENSMODEL_OPENCV5", &format!("{ends}, -0.1, 0, 0, 0, 0")), radial),
        ] {
            assert_images(&text, s);
        }
    }

    #[test]
    fn one_of_several_cameras_is_chosen_by_name() {
        let one = kalibr("pinhole", "400, 400, 320, 240", "radtan", "-0.1, 0, 0, 0");
        let two = one.clone() + &one.replace("cam0", "cam1").replace("400, 400", "500, 500");
        let colmap =
            "1 PINHOLE 640 480 400 400 320.5 240.5\n2 PINHOLE 640 480 500 500 320.5 240.5\n";
        for (text, name) in [(two.as_str(), "cam1"), (colmap, "2")] {
            let file = CameraFile::named(text, Some(name)).unwrap();
            assert_eq!(file.camera.focal_px, DVec2::splat(500.0));
            for name in [None, Some("left")] {
                let message = CameraFile::named(text, name).unwrap_err().to_string();
                assert!(message.contains("append the name of one to the path"), "{message}");
            }
        }
        let own = Camera::pinhole(640, 480, 1.0).to_yaml();
        for text in [&mrcal("LENSMODEL_PINHOLE", "400, 400, 320, 240"), &own] {
            let message = CameraFile::named(text, Some("cam0")).unwrap_err().to_string();
            assert_eq!(message, "its only camera has no name; omit `:cam0`");
        }
    }

    #[test]
    fn what_no_lens_represents_exactly_is_rejected_with_its_field() {
        let ends = "400, 400, 320, 240";
        for (text, field) in [
            (
                kalibr("pinhole", ends, "fov", "0.9"),
                "`distortion_model`: no lens here represents `pinhole-fov`",
            ),
            (
                kalibr("omni", &format!("1.3, {ends}"), "radtan", "-0.1, 0, 0, 0"),
                "`omni-radtan` exactly; calibrate with pinhole",
            ),
            (kalibr("pinhole", ends, "none", "-0.1"), "`distortion_model`"),
            (
                kalibr("pinhole", "400, 320, 240", "none", ""),
                "`intrinsics`: it has 3 numbers, but `pinhole` needs 4",
            ),
            (kalibr("pinhole", "0, 400, 320, 240", "none", ""), "`intrinsics`: 0 is not"),
            (kalibr("omni", &format!("-1, {ends}"), "none", ""), "`intrinsics`"),
            (
                "1 FOV 640 480 400 400 320 240 0.9".to_owned(),
                "`MODEL`: no lens here represents `FOV`",
            ),
            (
                "1 OPENCV 640 480 400 400 320 240".to_owned(),
                "`PARAMS`: there are 4 numbers, but OPENCV has 8",
            ),
            ("1 PINHOLE 640 x 400 400 320 240".to_owned(), "`HEIGHT`: `x` is not a size"),
            ("1 PINHOLE 640 480 400 400 320 nan".to_owned(), "`PARAMS`: NaN is not"),
            (
                mrcal("LENSMODEL_CAHVOR", ends),
                "`lensmodel`: no lens here represents `LENSMODEL_CAHVOR`",
            ),
            (
                mrcal("LENSMODEL_OPENCV4", ends),
                "`intrinsics`: it has 4 numbers, but LENSMODEL_OPENCV4 needs 8",
            ),
            (
                mrcal(
                    "LENSMODEL_SPLINED_STEREOGRAPHIC_order=9_Nx=5_Ny=4_fov_x_deg=90",
                    &format!("{ends}{}", ", 0".repeat(40)),
                ),
                "`spline`: degree 9",
            ),
        ] {
            let message = Camera::from_yaml(&text).unwrap_err().to_string();
            assert!(message.contains(field), "{message}");
        }
    }
}
