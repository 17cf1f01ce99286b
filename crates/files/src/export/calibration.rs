//! Calibrations of a single camera as JSON, schema `deltille/calibration/1`: the camera with
//! standard deviations and correlations, every view with its pose and, on request, its residuals.

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use super::estimate::is_failure;
use super::estimate::{
    CoverageRecord, DiagnosisRecord, MapRecord, ParameterRecord, ProjectionRecord, ShapeRecord,
    ViewRecord, correlations, coverage, diagnoses, map, parameters, projection, shape, spline,
    views,
};
use super::finding::{FindingRecord, records};
use deltille_core::calibrate::{Diagnosis, Estimate, Excluded, SHAPE_COEFFICIENTS as COUNT, Shape};
use deltille_core::camera::SplineGrid;
use deltille_core::detect::InkEstimate;
use deltille_core::json::{self, ReadError};
use deltille_core::layout::SheetLayout;
use deltille_core::quantity;
use deltille_core::targets::{TargetIdentity, check_result_of};

/// What is known of the printed sheet before a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Print scale, measured over stated length, across and up the sheet; `None` where it was not measured.
    pub print_scale: Option<[f64; 2]>,
    /// Deviation of the sheet from its plan after that scale; `None` where no shape was estimated.
    pub shape: Option<Shape>,
    /// The sheets of the only target, which say how its panels are turned on paper; empty where they are not described.
    pub sheets: Vec<SheetLayout>,
}

/// What is known of the print that was photographed, besides its plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Print {
    /// Print scale, measured over stated length, across and up the sheet; `None` where it was not measured.
    pub scale: Option<[f64; 2]>,
    /// Ink spread estimated from the detections; `None` where it was not estimated.
    pub ink: Option<InkEstimate>,
}

/// Whether a file lists the residual of every corner, which makes up nearly all of its length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residuals {
    /// Views state their number of corners and the RMS residual only.
    #[default]
    LeftOut,
    /// Views list all corners.
    Listed,
}

/// Why no sheet can be read from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// The file is not a calibration.
    #[error(
        "not what `calibration::write` or `rig::write` made: make it by a calibration with `Calibration::board_shape`"
    )]
    Foreign,
    /// A field is missing, or has an invalid value.
    #[error(
        "field `{field}`: {problem}; make it anew by a calibration with `Calibration::board_shape`"
    )]
    Field {
        /// The field, such as `board_shape.reach_mm`.
        field: String,
        /// What is wrong.
        problem: String,
    },
    /// The calibration was made with another target.
    #[error("{0}")]
    OtherTarget(String),
    /// The calibration did not estimate a shape.
    #[error("no `board_shape` in it: make it by a calibration with `Calibration::board_shape`")]
    Flat,
}

#[derive(Deserialize)]
struct SheetOfFile {
    #[serde(default)]
    calibrated_with: Vec<TargetIdentity>,
    #[serde(default, deserialize_with = "quantity::print_scale::de")]
    print_scale: Option<[f64; 2]>,
    board_shape: Option<StoredShape>,
}

/// A shape as calibration and rig files store it.
#[derive(Deserialize)]
pub(super) struct StoredShape {
    #[serde(deserialize_with = "quantity::place_mm::de")]
    middle_mm: DVec3,
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    reach_mm: f64,
    #[serde(deserialize_with = "quantity::place_mm::de")]
    coefficients_mm: [f64; COUNT],
}

impl StoredShape {
    pub(super) fn shape(self) -> Shape {
        let Self { middle_mm, reach_mm, coefficients_mm } = self;
        Shape { middle_mm, reach_mm, coefficients_mm }
    }
}

/// Reads the sheet from a calibration or rig file that has a shape; `targets` are those whose sheet it should be, none if it may be
/// that of any.
///
/// # Errors
/// When the file is not a calibration, a field is not valid, it was made with another target, or no shape was estimated.
pub fn read_sheet(text: &str, targets: &[TargetIdentity]) -> Result<Sheet, SheetError> {
    let schema = json::schema(text.as_bytes()).ok().flatten();
    if !schema.is_some_and(|schema| [SCHEMA, super::rig::SCHEMA].contains(&schema.as_str())) {
        return Err(SheetError::Foreign);
    }
    let file: SheetOfFile = json::read(text).map_err(|error| match error {
        ReadError::Json(_) => SheetError::Foreign,
        ReadError::Field { field, problem } => SheetError::Field { field, problem },
    })?;
    check_result_of(&file.calibrated_with, targets).map_err(SheetError::OtherTarget)?;
    let shape = file.board_shape.ok_or(SheetError::Flat)?.shape();
    Ok(Sheet { print_scale: file.print_scale, shape: Some(shape), sheets: Vec::new() })
}

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/calibration/1";

#[derive(Serialize)]
struct CalibrationFile<'a> {
    schema: &'static str,
    model: String,
    width: u32,
    height: u32,
    /// The grid of a spline.
    #[serde(skip_serializing_if = "Option::is_none")]
    spline: Option<SplineGrid>,
    parameters: Vec<ParameterRecord<'a>>,
    correlations: Vec<Vec<f64>>,
    loose: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    projection: Option<ProjectionRecord>,
    rms_px: f64,
    inlier_rms_px: f64,
    corners: usize,
    outliers: usize,
    coverage: CoverageRecord,
    sigma: f64,
    common_px: Option<f64>,
    #[serde(skip_serializing_if = "<[TargetIdentity]>::is_empty")]
    calibrated_with: &'a [TargetIdentity],
    #[serde(skip_serializing_if = "Option::is_none")]
    print_scale: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ink: Option<InkEstimate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    board_shape: Option<ShapeRecord>,
    #[serde(skip_serializing_if = "Option::is_none")]
    target_map: Option<MapRecord<'a>>,
    views: Vec<ViewRecord<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<HeldOut<'a>>,
    excluded: &'a [Excluded],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    findings: Vec<FindingRecord>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    diagnoses: Vec<DiagnosisRecord<'a>>,
}

#[derive(Serialize)]
struct HeldOut<'a> {
    rms_px: f64,
    views: Vec<ViewRecord<'a>>,
    excluded: &'a [Excluded],
}

/// The JSON text of the calibration of a single camera, with the diagnoses that were made; `None`
/// for an estimate without cameras.
pub fn write(
    found: &Estimate,
    said: &[Diagnosis],
    print: Print,
    residuals: Residuals,
) -> Option<String> {
    let camera = found.cameras.first()?;
    let held_out = found.held_out.as_deref();
    let held_out = held_out.and_then(|test| Some((test, test.cameras.first()?)));
    let file = CalibrationFile {
        schema: SCHEMA,
        model: camera.model.map_or("fixed".to_owned(), |model| model.to_string()),
        width: camera.camera.width,
        height: camera.camera.height,
        spline: spline(camera),
        parameters: parameters(camera),
        correlations: correlations(camera),
        loose: &camera.ill_conditioned,
        projection: projection(camera),
        rms_px: found.rms_px,
        inlier_rms_px: found.inlier_rms_px(),
        corners: found.corner_count(),
        outliers: found.outlier_count(),
        coverage: coverage(camera),
        sigma: found.sigma,
        common_px: found.common_px,
        calibrated_with: &found.calibrated_with,
        print_scale: print.scale,
        ink: print.ink,
        board_shape: found.shape.map(shape),
        target_map: found.map.as_ref().map(|of_target| map(found, of_target)),
        views: views(found, camera, residuals),
        held_out: held_out.map(|(test, camera)| HeldOut {
            rms_px: test.rms_px,
            views: views(test, camera, residuals),
            excluded: &test.excluded,
        }),
        excluded: &found.excluded,
        findings: records(found, print.scale),
        diagnoses: diagnoses(found, said, print.scale),
    };
    Some(json::to_text(&file, 4))
}
