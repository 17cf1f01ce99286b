//! Calibrations as JSON, schema `deltille/calibration/1`: the camera with standard deviations and
//! correlations, and every view with its pose and residuals.

use serde::Serialize;

use super::motion::Motion;
use crate::calibrate::Solution;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/calibration/1";

#[derive(Serialize)]
struct CalibrationFile {
    schema: &'static str,
    model: String,
    width: u32,
    height: u32,
    parameters: Vec<Parameter>,
    correlations: Vec<Vec<f64>>,
    loose: Vec<String>,
    rms_px: f64,
    sigma: f64,
    common_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_shape: Option<ShapeOfBoard>,
    views: Vec<View>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOut>,
    excluded: Vec<Excluded>,
}

#[derive(Serialize)]
struct ShapeOfBoard {
    /// b₁ … b₇, a₁, a₂ of [`crate::calibrate::Shape`].
    coefficients_mm: Vec<f64>,
    sd_mm: Vec<f64>,
    bent_mm: f64,
    stretched_mm: f64,
    f_ratio: f64,
    significant: bool,
}

#[derive(Serialize)]
struct Parameter {
    name: String,
    value: f64,
    sd: Option<f64>,
}

#[derive(Serialize)]
struct View {
    name: String,
    image: String,
    rms_px: f64,
    outliers: usize,
    camera_from_target: Motion,
    /// Row, column, x, y, dx, dy of each corner, by panel.
    corners: Vec<Corner>,
}

#[derive(Serialize)]
struct Corner {
    panel: usize,
    row: i32,
    col: i32,
    x: f64,
    y: f64,
    dx: f64,
    dy: f64,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    outlier: bool,
}

#[derive(Serialize)]
struct Excluded {
    name: String,
    why: String,
}

#[derive(Serialize)]
struct HeldOut {
    rms_px: f64,
    views: Vec<View>,
}

/// The text of the file; `model` is the name of what was calibrated, `held_out` are the views that
/// only had their poses found.
pub fn write(solution: &Solution, model: &str, held_out: Option<&Solution>) -> String {
    let found = solution.found().count();
    let correlations =
        (0..found).map(|i| (0..found).map(|j| solution.correlation(i, j)).collect()).collect();
    let parameters = solution.parameters.iter();
    let excluded = solution.excluded.iter().cloned();
    let file = CalibrationFile {
        schema: SCHEMA,
        model: model.to_owned(),
        width: solution.camera.width,
        height: solution.camera.height,
        parameters: parameters
            .map(|p| Parameter { name: p.name.clone(), value: p.value, sd: p.sd })
            .collect(),
        correlations,
        loose: solution.loose.clone(),
        rms_px: solution.rms_px,
        sigma: solution.sigma,
        common_px: solution.common_px,
        board_shape: solution.shape.map(|found| ShapeOfBoard {
            coefficients_mm: found.shape.coefficients_mm.to_vec(),
            sd_mm: found.sd_mm.to_vec(),
            bent_mm: found.bent_mm,
            stretched_mm: found.stretched_mm,
            f_ratio: found.f_ratio,
            significant: found.is_significant(),
        }),
        held_out: held_out.map(|test| HeldOut {
            rms_px: test.rms_px,
            views: test.views.iter().map(view).collect(),
        }),
        views: solution.views.iter().map(view).collect(),
        excluded: excluded.map(|(name, why)| Excluded { name, why }).collect(),
    };
    crate::json::to_text(&file, 4)
}

fn view(view: &crate::calibrate::ViewSolution) -> View {
    let corners = view.corners.iter().map(|corner| Corner {
        panel: corner.panel,
        row: corner.row,
        col: corner.col,
        x: corner.pixel[0],
        y: corner.pixel[1],
        dx: corner.residual[0],
        dy: corner.residual[1],
        outlier: corner.outlier,
    });
    View {
        name: view.name.clone(),
        image: view.image.clone(),
        rms_px: view.rms_px,
        outliers: view.outlier_count(),
        camera_from_target: Motion::new(&view.pose, Some(view.pose_sd)),
        corners: corners.collect(),
    }
}
