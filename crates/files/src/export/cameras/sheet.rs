//! The printed sheet in a calibration file: its scale and its shape, for later calibrations.

use glam::DVec3;
use serde::Deserialize;

use super::{calibration, rig};
use deltille_calibrate::{SHAPE_COEFFICIENTS as COUNT, Shape};
use deltille_core::json;
use deltille_core::json::ReadError;
use deltille_core::quantity;
use deltille_core::reading::in_words;
use deltille_core::setting::Setting::{CalibrationBoardShape, CalibrationWrite, RigWrite};
use deltille_core::targets::{TargetIdentity, check_result_of};
use deltille_layout::SheetLayout;

/// Measurements of the printed sheet that are known before a calibration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Print scale (measured length / stated length) across and up the sheet; `None` if it was not measured.
    pub print_scale: Option<[f64; 2]>,
    /// Deviation of the sheet from its plan after scaling; `None` if no shape was estimated.
    pub shape: Option<Shape>,
    /// The sheets of the only target, which contain the rotation of its panels on paper; empty if they are not described.
    pub sheets: Vec<SheetLayout>,
}

/// Error of reading a sheet from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// The file is not a calibration.
    #[error(
        "not a calibration written by {CalibrationWrite} or {RigWrite}: calibrate with {CalibrationBoardShape}"
    )]
    Foreign,
    /// The text is not complete.
    #[error("{0}")]
    Incomplete(String),
    /// A field is missing or has an invalid value.
    #[error("field `{field}`: {problem}; calibrate again with {CalibrationBoardShape}")]
    Field {
        /// The field, for example `board_shape.reach_mm`.
        field: String,
        /// The problem with the field.
        problem: String,
    },
    /// The calibration was made with another target.
    #[error("{0}")]
    OtherTarget(String),
    /// The calibration did not estimate a shape.
    #[error("no `board_shape` in this file: calibrate with {CalibrationBoardShape}")]
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
pub(in crate::export) struct StoredShape {
    #[serde(deserialize_with = "quantity::position_mm::de")]
    middle_mm: DVec3,
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    reach_mm: f64,
    #[serde(deserialize_with = "quantity::position_mm::de")]
    coefficients_mm: [f64; COUNT],
}

impl StoredShape {
    pub(in crate::export) fn shape(self) -> Shape {
        let Self { middle_mm, reach_mm, coefficients_mm } = self;
        Shape { middle_mm, reach_mm, coefficients_mm }
    }
}

/// Reads the sheet from a calibration or rig file with a shape. It must belong to `targets`, unless these are empty.
///
/// # Errors
/// Returns an error if the file is not a calibration, a field is not valid, the calibration was made with another target, or
/// no shape was estimated.
pub fn read_sheet(text: &str, targets: &[TargetIdentity]) -> Result<Sheet, SheetError> {
    let schema = json::schema(text.as_bytes()).ok().flatten();
    if !schema.is_some_and(|schema| [calibration::SCHEMA, rig::SCHEMA].contains(&schema.as_str())) {
        return Err(SheetError::Foreign);
    }
    let file: SheetOfFile = json::read(text).map_err(|error| match error {
        ReadError::Json(problem) => SheetError::Incomplete(in_words(&problem)),
        ReadError::Field { field, problem } => SheetError::Field { field, problem },
    })?;
    check_result_of(&file.calibrated_with, targets).map_err(SheetError::OtherTarget)?;
    let shape = file.board_shape.ok_or(SheetError::Flat)?.shape();
    Ok(Sheet { print_scale: file.print_scale, shape: Some(shape), sheets: Vec::new() })
}
