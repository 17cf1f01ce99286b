//! Detections as JSON (FORMATS §9, schema `deltille/detection/1`), and back.

use serde::{Deserialize, Serialize};

use crate::detect::{Detection, Grid};

/// Schema and version that this crate writes and reads.
pub const SCHEMA: &str = "deltille/detection/1";

/// What is wrong with a detection file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DetectionFileError {
    /// Not JSON, cut off, or with a field missing, unknown or of the wrong type.
    #[error("not a detection file: {0}; make it anew with `deltille detect`")]
    Json(#[from] serde_json::Error),
    /// Another schema, or another version of it.
    #[error("field `schema` is `{found}`, this version reads `{SCHEMA}`: make the file anew")]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// A corner that cannot be one.
    #[error("grids[{grid}].corners[{corner}]: {problem}")]
    Corner {
        /// Index of the grid.
        grid: usize,
        /// Index of the corner.
        corner: usize,
        /// What is wrong.
        problem: &'static str,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DetectionFile {
    schema: String,
    image: String,
    width: u32,
    height: u32,
    grids: Vec<Grid>,
    timing_ms: std::collections::BTreeMap<String, f64>,
}

/// The text of the JSON file of one image, a corner a line.
pub fn write(detection: &Detection) -> String {
    crate::json::to_text(&DetectionFile::of(detection), 4)
}

/// The same as a single line, which it ends, for streams of detections.
pub fn write_line(detection: &Detection) -> String {
    crate::json::to_text(&DetectionFile::of(detection), 0)
}

impl DetectionFile {
    fn of(detection: &Detection) -> Self {
        let Detection { image, width, height, grids, timing_ms } = detection.clone();
        Self { schema: SCHEMA.to_owned(), image, width, height, grids, timing_ms }
    }
}

/// Reads the text of a detection file.
pub fn read(json: &str) -> Result<Detection, DetectionFileError> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    let Head { schema } = serde_json::from_str(json)?;
    if schema != SCHEMA {
        return Err(DetectionFileError::Schema { found: schema });
    }
    let file: DetectionFile = serde_json::from_str(json)?;
    let DetectionFile { schema: _, image, width, height, grids, timing_ms } = file;
    for (grid, of_grid) in grids.iter().enumerate() {
        for (corner, found) in of_grid.corners.iter().enumerate() {
            // Negations, so that what is no number is refused too.
            let usable = |[xx, xy, yy]: [f64; 3]| xx > 0.0 && yy > 0.0 && xx * yy > xy * xy;
            if !found.cov.is_none_or(usable) {
                let problem = "`cov` is no covariance xx, xy, yy";
                return Err(DetectionFileError::Corner { grid, corner, problem });
            }
        }
    }
    Ok(Detection { image, width, height, grids, timing_ms })
}
