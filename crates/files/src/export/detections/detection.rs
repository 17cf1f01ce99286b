//! Detections as JSON (schema `deltille/detection/1`, `docs/formats.md`, “Detection”), and back.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use deltille_core::detection::{Detection, Grid, InkEstimate, Reason, ToneEstimate};
use deltille_core::json;
use deltille_core::json::ReadError;
use deltille_core::quantity;
use deltille_core::raster::FileNotes;
use deltille_core::reading::in_words;
use deltille_core::setting::Setting::DetectionWrite;
use deltille_core::targets::TargetIdentity;

/// Schema and version that this crate writes and reads.
pub const SCHEMA: &str = "deltille/detection/1";

/// Error of reading a detection file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DetectionFileError {
    /// The file is not JSON, or truncated.
    #[error("not a detection file: {}; create it again with {DetectionWrite}", in_words(.0))]
    Json(serde_json::Error),
    /// The file has another version of the schema.
    #[error(
        "field `schema` is `{found}`, but this version reads `{SCHEMA}`: create the file again"
    )]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// The file is not a detection.
    #[error("this is a {found} file, not a detection: use a file made by {DetectionWrite}")]
    Kind {
        /// The schema that the file names.
        found: String,
    },
    /// A field is missing or unknown, or has an invalid value.
    #[error("field `{field}`: {problem}; create the file again with {DetectionWrite}")]
    Field {
        /// The field, for example `grids[0].corners[3].x`.
        field: String,
        /// The problem.
        problem: String,
    },
    /// A grid repeats the corners of another one.
    #[error("grids[{grid}] repeats grids[{first}]")]
    Again {
        /// Index of the second.
        grid: usize,
        /// Index of the first.
        first: usize,
    },
    /// A corner is not valid: its covariance is not valid, or its label is not unique.
    #[error("grids[{grid}].corners[{corner}]: {problem}")]
    Corner {
        /// Index of the grid.
        grid: usize,
        /// Index of the corner.
        corner: usize,
        /// The problem.
        problem: String,
    },
}

impl From<ReadError> for DetectionFileError {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Json(error) => Self::Json(error),
            ReadError::Field { field, problem } => Self::Field { field, problem },
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DetectionFile {
    schema: String,
    image: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time_ns: Option<i64>,
    #[serde(deserialize_with = "quantity::side_px::de")]
    width: u32,
    #[serde(deserialize_with = "quantity::side_px::de")]
    height: u32,
    #[serde(default, skip_serializing_if = "FileNotes::is_empty")]
    file: FileNotes,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    targets: Vec<TargetIdentity>,
    grids: Vec<Grid>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    tone: Option<ToneEstimate>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ink: Option<InkEstimate>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    reasons: Vec<Reason>,
    #[serde(
        default,
        skip_serializing_if = "BTreeMap::is_empty",
        deserialize_with = "quantity::figure::de"
    )]
    timing_ms: BTreeMap<String, f64>,
}

/// Returns the JSON text of the detection in one image, with one corner per line; positions are in px.
///
/// ```
/// use deltille_core::detection::Detection;
/// use deltille_files::export::detection;
///
/// let found = Detection::new("desk.png", [640, 480], Vec::new());
/// assert_eq!(detection::read(&detection::write(&found))?, found);
/// # Ok::<(), detection::DetectionFileError>(())
/// ```
pub fn write(detection: &Detection) -> String {
    deltille_core::json::to_text(&DetectionFile::of(detection), 4)
}

/// Returns the same JSON as a single line with its line end, for streams of detections.
pub fn write_line(detection: &Detection) -> String {
    deltille_core::json::to_text(&DetectionFile::of(detection), 0)
}

impl DetectionFile {
    fn of(detection: &Detection) -> Self {
        let Detection {
            image,
            time_ns,
            width,
            height,
            file,
            targets,
            grids,
            tone,
            ink,
            reasons,
            timing_ms,
            ..
        } = detection.clone();
        Self {
            schema: SCHEMA.to_owned(),
            image,
            time_ns,
            width,
            height,
            file,
            targets,
            grids,
            tone,
            ink,
            reasons,
            timing_ms,
        }
    }
}

/// Whether a text is JSON with a schema other than that of a detection.
pub fn is_foreign(text: &str) -> bool {
    json::schema(text.as_bytes())
        .is_ok_and(|schema| schema.as_deref().map(json::kind) != Some(json::kind(SCHEMA)))
}

/// Reads the text of a detection file.
///
/// # Errors
/// Returns an error if the text is not a detection, has another version, or contains an invalid field, corner or grid.
pub fn read(text: &str) -> Result<Detection, DetectionFileError> {
    let found = json::named_schema(text)?;
    if json::kind(&found) != json::kind(SCHEMA) {
        return Err(DetectionFileError::Kind { found });
    }
    if found != SCHEMA {
        return Err(DetectionFileError::Schema { found });
    }
    let DetectionFile {
        image,
        time_ns,
        width,
        height,
        file,
        targets,
        grids,
        tone,
        ink,
        reasons,
        timing_ms,
        ..
    } = json::read(text)?;
    check_corners(&grids)?;
    let mut detection = Detection::new(image, [width, height], grids);
    detection.time_ns = time_ns;
    (detection.file, detection.targets) = (file, targets);
    (detection.tone, detection.ink) = (tone, ink);
    (detection.reasons, detection.timing_ms) = (reasons, timing_ms);
    Ok(detection)
}

/// Refuses repeated corners, and corners whose covariance is not valid.
pub(in crate::export) fn check_corners(grids: &[Grid]) -> Result<(), DetectionFileError> {
    // A repeated corner would count twice. A panel may be seen in several grids.
    let (mut places, mut firsts) = (BTreeSet::new(), BTreeMap::new());
    for (grid, of_grid) in grids.iter().enumerate() {
        let corners = serde_json::to_string(&of_grid.corners).map_err(DetectionFileError::Json)?;
        let first = *firsts.entry(corners).or_insert(grid);
        if first != grid && !of_grid.corners.is_empty() {
            return Err(DetectionFileError::Again { grid, first });
        }
        // Without a panel, labels are unique only within their grid.
        let labels =
            of_grid.panel.map_or((None, grid), |panel| (Some((&of_grid.target, panel)), 0));
        for (corner, found) in of_grid.corners.iter().enumerate() {
            if let Some(problem) = found.cov.and_then(|cov| check_covariance(cov).err()) {
                return Err(DetectionFileError::Corner { grid, corner, problem });
            }
            if !places.insert((labels, found.row, found.col)) {
                let problem = "another corner has the same row and column".to_owned();
                return Err(DetectionFileError::Corner { grid, corner, problem });
            }
        }
    }
    Ok(())
}

/// Checks the covariance of a corner.
fn check_covariance([xx, xy, yy]: [f64; 3]) -> Result<(), String> {
    for variance in [xx, yy] {
        let in_range = quantity::variance_px2::RANGE.check(variance);
        in_range.map_err(|what| format!("`cov`: a variance, {what}"))?;
    }
    // This comparison also rejects NaN.
    let usable = xx * yy > xy * xy;
    usable.then_some(()).ok_or_else(|| "`cov` is not a valid covariance xx, xy, yy".to_owned())
}
