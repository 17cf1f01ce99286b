use super::family_ref::UnknownCodes;
use crate::setting::Setting::{
    self, BoardCols, BoardEdgeMm, BoardRows, PaperMarginMm, PaperPoster, PaperSize, TagFamily,
};

/// Why a target cannot be made. Messages name the setting to change, for example `BoardSpec::rows`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// The family is not shipped; the message lists those that are.
    #[error("{0}")]
    UnknownFamily(String),
    /// The codes of the target's tags are unknown.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
    /// The target is known by its corners only, so it cannot be made from a specification.
    #[error("this target comes from a list of corners, so it cannot be generated again")]
    Listed,
    /// A single value is invalid.
    #[error("{setting}: {problem}")]
    Invalid {
        /// The field or variant, for example `BoardSpec::rows`.
        setting: Setting,
        /// The problem and its remedy.
        problem: String,
    },
    /// The spec has tags, but no family or another family was given.
    #[error("{TagFamily}: the target has tags of {wanted}, {given}")]
    Family {
        /// The family that the spec names.
        wanted: String,
        /// Description of what was given instead.
        given: String,
    },
    /// The family has too few codes.
    #[error(
        "{setting}: tags {first} to {last} are needed, but family {family} ends at {end}; {instead}"
    )]
    IdsRunOut {
        /// The field to change, for example `TagSpec::first_id`.
        setting: Setting,
        /// First id needed.
        first: u32,
        /// Last id needed.
        last: u64,
        /// Name of the family.
        family: String,
        /// Last id of the family.
        end: u64,
        /// The remedy: a lower first id, fewer tags or a larger family.
        instead: String,
    },
    /// Targets that are to be used together share ids.
    #[error("{setting}: {what} {first} to {last} overlap those of `{other}`; start at {free}")]
    Overlap {
        /// The field to change, for example `TagSpec::first_id`.
        setting: Setting,
        /// Kind of the ids.
        what: &'static str,
        /// Lowest id.
        first: u32,
        /// Highest id.
        last: u32,
        /// The other target.
        other: String,
        /// Lowest id above those of the other target.
        free: u64,
    },
    /// The board is too large for the paper.
    #[error(
        "{PaperSize}: {rows} × {cols} corners with {edge} edges and the marks around them do \
         not fit {paper}; use larger paper, {}fewer {BoardRows} or {BoardCols}, or {}",
        if *packed { String::new() } else { format!("several pages ({PaperPoster}), ") },
        match fitting_edge_mm {
            Some(mm) => format!("{BoardEdgeMm} of at most {mm} mm"),
            None => format!("a smaller {PaperMarginMm}"),
        }
    )]
    DoesNotFit {
        /// Rows of corners.
        rows: u32,
        /// Number of corners in each row.
        cols: u32,
        /// The edge, for example `20 mm`.
        edge: String,
        /// The paper, for example `A4`.
        paper: String,
        /// Whether several boards share a sheet.
        packed: bool,
        /// Largest edge that fits, in whole millimetres.
        fitting_edge_mm: Option<u32>,
    },
}

impl TargetError {
    /// Creates the error of an invalid setting.
    #[doc(hidden)]
    pub fn invalid(setting: Setting, problem: impl Into<String>) -> Self {
        Self::Invalid { setting, problem: problem.into() }
    }
}

/// A field and its problem.
pub type Problem = (String, String);

/// Returns the error of a field.
///
/// # Errors
/// Always.
pub fn problem<T>(field: impl Into<String>, problem: impl Into<String>) -> Result<T, Problem> {
    Err((field.into(), problem.into()))
}
