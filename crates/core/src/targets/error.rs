use super::family_ref::UnknownCodes;
use crate::setting::Setting::{
    self, BoardCols, BoardEdgeMm, BoardRows, PaperMarginMm, PaperPoster, PaperSize, TagFamily,
};

/// Why a target cannot be made. Messages name the setting to change, such as `BoardSpec::rows`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// A family that is not shipped, and which are.
    #[error("{0}")]
    UnknownFamily(String),
    /// The codes of a target's tags are not known.
    #[error(transparent)]
    UnknownCodes(#[from] UnknownCodes),
    /// A target that is known by its corners only has nothing to be made from.
    #[error("a listed target is read from its list, it cannot be made anew")]
    Listed,
    /// A value that is no use by itself.
    #[error("{setting}: {problem}")]
    Invalid {
        /// The field or variant, such as `BoardSpec::rows`.
        setting: Setting,
        /// What is wrong and what would do.
        problem: String,
    },
    /// Tags are asked for and no family was given, or another one.
    #[error("{TagFamily}: the target carries tags of {wanted}, {given}")]
    Family {
        /// The family asked for.
        wanted: String,
        /// What was given instead.
        given: String,
    },
    /// More tags than codes.
    #[error(
        "{setting}: tags {first} to {last} are needed, but family {family} ends at {end}: {instead}"
    )]
    IdsRunOut {
        /// The field to change, such as `TagSpec::first_id`.
        setting: Setting,
        /// First id needed.
        first: u32,
        /// Last id needed.
        last: u64,
        /// Name of the family.
        family: String,
        /// Last id that the family has.
        end: u64,
        /// What would do: a lower first id, fewer tags, a larger family.
        instead: String,
    },
    /// Targets to be used together share ids.
    #[error("{setting}: {what} {first} to {last} overlap those of `{other}`: start at {free}")]
    Overlap {
        /// The field to change, such as `TagSpec::first_id`.
        setting: Setting,
        /// Ids of what.
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
        "{PaperSize}: {rows} × {cols} corners with {edge} edges and what is printed around them do \
         not fit {paper}: take larger paper, {}fewer {BoardRows} or {BoardCols}, or {}",
        if *packed { String::new() } else { format!("several pages by {PaperPoster}, ") },
        match fitting_edge_mm {
            Some(mm) => format!("{BoardEdgeMm} of at most {mm} mm"),
            None => format!("a smaller {PaperMarginMm}"),
        }
    )]
    DoesNotFit {
        /// Rows of corners.
        rows: u32,
        /// Corners in each row.
        cols: u32,
        /// The edge, such as `20 mm`.
        edge: String,
        /// The paper, such as `A4`.
        paper: String,
        /// Whether there are to be several boards on a sheet.
        packed: bool,
        /// Largest edge in whole millimetres that fits.
        fitting_edge_mm: Option<u32>,
    },
}

impl TargetError {
    /// A setting that is refused.
    #[doc(hidden)]
    pub fn invalid(setting: Setting, problem: impl Into<String>) -> Self {
        Self::Invalid { setting, problem: problem.into() }
    }
}

/// A field, and what is wrong with it.
pub type Problem = (String, String);

/// The error of a field.
///
/// # Errors
/// Always.
pub fn problem<T>(field: impl Into<String>, problem: impl Into<String>) -> Result<T, Problem> {
    Err((field.into(), problem.into()))
}
