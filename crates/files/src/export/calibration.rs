//! Calibrations as JSON, schema `deltille/calibration/1`: the camera with standard deviations and
//! correlations, and every view with its pose and residuals.

use serde::{Deserialize, Serialize};

use super::finding::{FindingRecord, records};
use super::motion::Motion;
use deltille_core::calibrate::{Excluded, PanelRef, SHAPE_COEFFICIENTS as COUNT, Shape, Solution};
use deltille_core::detect::InkEstimate;
use deltille_core::json::{self, ReadError};
use deltille_core::quantity;

/// What a calibration tells of the sheet that was photographed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sheet {
    /// How the print came out across and up the sheet.
    pub print_scale: Option<[f64; 2]>,
    /// How the sheet differs from its plan then.
    pub shape: Option<Shape>,
}

/// What is known of the print that was photographed, beside its plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Print {
    /// How it came out across and up its sheet, where that was measured.
    pub scale: Option<[f64; 2]>,
    /// How far ink has spread, as the detections tell.
    pub ink: Option<InkEstimate>,
}

/// Why a file tells of no sheet.
#[derive(Debug, thiserror::Error)]
pub enum SheetError {
    /// Not the file of a calibration.
    #[error("not the .json that `calibrate` writes")]
    Foreign,
    /// A field is missing, or holds what it must not.
    #[error("field `{field}`: {problem}; make it anew with `calibrate --board-shape`")]
    Field {
        /// The field, such as `board_shape.reach_mm`.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// A calibration without shape.
    #[error("no `board_shape` in it: make it with `calibrate --board-shape`")]
    Flat,
}

#[derive(Deserialize)]
struct SheetOfFile {
    #[serde(default, deserialize_with = "quantity::print_scale::de")]
    print_scale: Option<[f64; 2]>,
    board_shape: Option<StoredShape>,
}

#[derive(Deserialize)]
struct StoredShape {
    #[serde(deserialize_with = "quantity::place_mm::de")]
    middle_mm: [f64; 3],
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    reach_mm: f64,
    #[serde(deserialize_with = "quantity::place_mm::de")]
    coefficients_mm: [f64; COUNT],
}

/// Reads the sheet of a calibration that found its shape.
pub fn read_sheet(text: &str) -> Result<Sheet, SheetError> {
    if json::schema(text.as_bytes()).ok().flatten().as_deref() != Some(SCHEMA) {
        return Err(SheetError::Foreign);
    }
    let file: SheetOfFile = json::read(text).map_err(|error| match error {
        ReadError::Json(_) => SheetError::Foreign,
        ReadError::Field { field, problem } => SheetError::Field { field, problem },
    })?;
    let StoredShape { middle_mm, reach_mm, coefficients_mm } =
        file.board_shape.ok_or(SheetError::Flat)?;
    let shape = Shape { middle_mm: middle_mm.into(), reach_mm, coefficients_mm };
    Ok(Sheet { print_scale: file.print_scale, shape: Some(shape) })
}

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/calibration/1";

#[derive(Serialize)]
struct CalibrationFile<'a> {
    schema: &'static str,
    model: String,
    width: u32,
    height: u32,
    parameters: Vec<Parameter>,
    correlations: Vec<Vec<f64>>,
    loose: Vec<String>,
    rms_px: f64,
    inlier_rms_px: f64,
    outliers: usize,
    sigma: f64,
    common_px: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    print_scale: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ink: Option<InkEstimate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_shape: Option<ShapeOfBoard>,
    views: Vec<View>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOut<'a>>,
    excluded: &'a [Excluded],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<FindingRecord>,
}

#[derive(Serialize)]
struct ShapeOfBoard {
    middle_mm: [f64; 3],
    reach_mm: f64,
    /// b₁ … b₇, a₁, a₂ of [`deltille_core::calibrate::Shape`].
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
    panel: PanelRef,
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
struct HeldOut<'a> {
    rms_px: f64,
    views: Vec<View>,
    excluded: &'a [Excluded],
}

/// The text of the file; `model` is the name of what was calibrated, `held_out` are the views that
/// only had their poses found.
pub fn write(
    solution: &Solution,
    model: &str,
    held_out: Option<&Solution>,
    print: Print,
) -> String {
    let found = solution.found().count();
    let correlations =
        (0..found).map(|i| (0..found).map(|j| solution.correlation(i, j)).collect()).collect();
    let parameters = solution.parameters.iter();
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
        inlier_rms_px: solution.inlier_rms_px(),
        outliers: solution.outlier_count(),
        sigma: solution.sigma,
        common_px: solution.common_px,
        print_scale: print.scale,
        ink: print.ink,
        board_shape: solution.shape.map(|found| ShapeOfBoard {
            middle_mm: found.shape.middle_mm.to_array(),
            reach_mm: found.shape.reach_mm,
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
            excluded: &test.excluded,
        }),
        views: solution.views.iter().map(view).collect(),
        excluded: &solution.excluded,
        findings: records(&solution.findings, &[]),
    };
    json::to_text(&file, 4)
}

fn view(view: &deltille_core::calibrate::ViewSolution) -> View {
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
