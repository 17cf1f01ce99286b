//! Detections as JSON (FORMATS §9, schema `deltille/detection/1`), and back.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::detect::{Detection, Grid, InkEstimate, Reason, ToneEstimate};
use crate::json;

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
    /// A file of something else.
    #[error("this is a {found} file, not a detection: give what `deltille detect` wrote")]
    Kind {
        /// The schema that the file names.
        found: String,
    },
    /// A grid that is there already.
    #[error("grids[{grid}] is grids[{first}] again")]
    Again {
        /// Index of the second.
        grid: usize,
        /// Index of the first.
        first: usize,
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tone: Option<ToneEstimate>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ink: Option<InkEstimate>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    reasons: Vec<Reason>,
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
        let Detection { image, width, height, grids, tone, ink, reasons, timing_ms } =
            detection.clone();
        Self {
            schema: SCHEMA.to_owned(),
            image,
            width,
            height,
            grids,
            tone,
            ink,
            reasons,
            timing_ms,
        }
    }
}

/// Whether a text is JSON, but of something else than a detection.
pub fn is_foreign(text: &str) -> bool {
    json::schema(text.as_bytes())
        .is_ok_and(|schema| schema.as_deref().map(json::kind) != Some(json::kind(SCHEMA)))
}

/// Reads the text of a detection file.
pub fn read(text: &str) -> Result<Detection, DetectionFileError> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    let Head { schema } = serde_json::from_str(text)?;
    if json::kind(&schema) != json::kind(SCHEMA) {
        return Err(DetectionFileError::Kind { found: schema });
    }
    if schema != SCHEMA {
        return Err(DetectionFileError::Schema { found: schema });
    }
    let file: DetectionFile = serde_json::from_str(text)?;
    let DetectionFile { schema: _, image, width, height, grids, tone, ink, reasons, timing_ms } =
        file;
    // Corners that are there twice would count twice. A panel may be seen in pieces.
    let mut places = BTreeSet::new();
    for (grid, of_grid) in grids.iter().enumerate() {
        let again = |other: &Grid| !other.corners.is_empty() && other.corners == of_grid.corners;
        if let Some(first) = grids[..grid].iter().position(again) {
            return Err(DetectionFileError::Again { grid, first });
        }
        // Labels without a panel are those of their grid alone.
        let labels = of_grid.panel.map_or((None, grid), |panel| (Some(panel), 0));
        for (corner, found) in of_grid.corners.iter().enumerate() {
            // Negations, so that what is no number is refused too.
            let usable = |[xx, xy, yy]: [f64; 3]| xx > 0.0 && yy > 0.0 && xx * yy > xy * xy;
            if !found.cov.is_none_or(usable) {
                let problem = "`cov` is no covariance xx, xy, yy";
                return Err(DetectionFileError::Corner { grid, corner, problem });
            }
            if !places.insert((labels, found.row, found.col)) {
                let problem = "another corner has this row and column already";
                return Err(DetectionFileError::Corner { grid, corner, problem });
            }
        }
    }
    Ok(Detection { image, width, height, grids, tone, ink, reasons, timing_ms })
}
