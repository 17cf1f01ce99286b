//! Undistorted views and rectified pairs as JSON, schemas `deltille/undistortion/1` and
//! `deltille/rectification/1`, and in the form of OpenCV.

use std::fmt::Write as _;

use glam::DMat3;
use serde::Serialize;

use crate::export::GENERATOR;
use crate::export::detections::npy;
use deltille_calibrate::ViewUncertainty;
use deltille_core::camera::{PixelMap, Rectification, Undistortion};
use deltille_core::json;

/// Schema and version of an undistorted view that this crate writes.
pub const SCHEMA: &str = "deltille/undistortion/1";

/// Schema and version of a rectified pair that this crate writes.
pub const PAIR_SCHEMA: &str = "deltille/rectification/1";

#[derive(Serialize)]
struct ViewFile {
    schema: &'static str,
    #[serde(flatten)]
    view: View,
}

#[derive(Serialize)]
struct View {
    width: u32,
    height: u32,
    focal_px: f64,
    centre_px: [f64; 2],
    horizontal_field_deg: f64,
    vertical_field_deg: f64,
    /// Row-major.
    view_from_camera: [f64; 9],
    /// Fraction of its pixels that the camera sees.
    valid_fraction: f64,
    /// x, y, width and height of the largest rectangle that the camera sees completely.
    valid_px: [usize; 4],
    /// Standard deviation of a position that is due to the calibration, where that saw corners: RMS per axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    position_sd_px: Option<f64>,
    /// Fraction of its pixels where the calibration saw corners.
    #[serde(skip_serializing_if = "Option::is_none")]
    calibrated_fraction: Option<f64>,
}

#[derive(Serialize)]
struct PairFile<'a> {
    schema: &'static str,
    baseline_mm: [f64; 3],
    /// Row-major.
    depth_matrix: [f64; 16],
    views: Vec<Named<'a>>,
}

#[derive(Serialize)]
struct Named<'a> {
    camera: &'a str,
    #[serde(flatten)]
    view: View,
}

impl View {
    fn of(made: &Undistortion, map: &PixelMap, known: Option<ViewUncertainty>) -> Self {
        let camera = made.view();
        let field =
            |side: u32| 2.0 * (f64::from(side) / 2.0 / camera.focal_px.x).atan().to_degrees();
        Self {
            width: camera.width,
            height: camera.height,
            focal_px: camera.focal_px.x,
            centre_px: camera.centre_px.to_array(),
            horizontal_field_deg: field(camera.width),
            vertical_field_deg: field(camera.height),
            view_from_camera: rows(made),
            valid_fraction: map.valid_fraction(),
            valid_px: map.valid_rectangle(),
            position_sd_px: known.map(|of| of.position_sd_px),
            calibrated_fraction: known.map(|of| of.calibrated_fraction),
        }
    }
}

/// The rotation of a view, row-major.
fn rows(made: &Undistortion) -> [f64; 9] {
    DMat3::from_quat(made.view_from_camera()).transpose().to_cols_array()
}

/// The JSON text of an undistorted view; `map` contains the position in the photograph of each pixel of the view, and `known` the
/// uncertainty of positions in it.
pub fn write(made: &Undistortion, map: &PixelMap, known: Option<ViewUncertainty>) -> String {
    json::to_text(&ViewFile { schema: SCHEMA, view: View::of(made, map, known) }, 1)
}

/// The JSON text of a rectified pair, with the names of its cameras, and the map and the uncertainty of each view.
pub fn write_pair(
    made: &Rectification,
    names: [&str; 2],
    maps: &[PixelMap; 2],
    known: [Option<ViewUncertainty>; 2],
) -> String {
    let views = names.into_iter().zip(&made.views).zip(maps).zip(known);
    let views =
        views.map(|(((camera, view), map), sd)| Named { camera, view: View::of(view, map, sd) });
    let file = PairFile {
        schema: PAIR_SCHEMA,
        baseline_mm: made.baseline_mm.to_array(),
        depth_matrix: made.depth_matrix().transpose().to_cols_array(),
        views: views.collect(),
    };
    json::to_text(&file, 2)
}

/// R1, R2, P1, P2 and Q of a rectified pair as OpenCV `stereoRectify` returns them, as text for
/// `FileStorage`; lengths in mm, focal length and principal point in px.
pub fn opencv_pair(made: &Rectification) -> String {
    let view = made.views[0].view();
    let (focal, centre) = (view.focal_px.x, view.centre_px);
    let projection = |at: [f64; 2]| {
        let [tx, ty] = at.map(|mm| -focal * mm);
        [focal, 0.0, centre.x, tx, 0.0, focal, centre.y, ty, 0.0, 0.0, 1.0, 0.0]
    };
    let mut text = format!(
        "%YAML:1.0\n---\n# {GENERATOR}\nimage_width: {}\nimage_height: {}\n",
        view.width, view.height
    );
    let mut add = |name: &str, rows: usize, columns: usize, values: &[f64]| {
        let values: Vec<String> = values.iter().map(|value| format!("{value:?}")).collect();
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {} ]\n",
            values.join(", ")
        );
    };
    add("R1", 3, 3, &rows(&made.views[0]));
    add("R2", 3, 3, &rows(&made.views[1]));
    add("P1", 3, 4, &projection([0.0; 2]));
    add("P2", 3, 4, &projection([made.baseline_mm.x, made.baseline_mm.y]));
    add("Q", 4, 4, &made.depth_matrix().transpose().to_cols_array());
    text
}

/// The x and y maps for OpenCV `remap`, px, as `.npy` files of float32 (height × width); −1 for pixels outside the camera
/// image.
pub fn maps(map: &PixelMap) -> [Vec<u8>; 2] {
    let of = |index: usize| {
        let values = map.positions().iter().map(move |place| match place[index].is_nan() {
            true => -1.0,
            false => place[index],
        });
        npy::float32(map.height(), map.width(), values)
    };
    [of(0), of(1)]
}
