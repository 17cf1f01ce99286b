use crate::reading::in_words;
use crate::setting::Setting::FamilyToJson;

/// The problem with a family, its text or its name.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyError {
    /// There is no shipped family and no file of this name.
    #[error(
        "unknown family `{name}`: use one of {}, or the path of a .json family file",
        shipped.join(", ")
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// Names of the shipped families.
        shipped: Vec<&'static str>,
    },
    /// The text is not JSON or is truncated, or a field is missing, unknown or of the wrong type.
    #[error("not a family file: {}; generate it again with {FamilyToJson}", in_words(.0))]
    Json(#[from] serde_json::Error),
    /// The schema or its version is not supported.
    #[error(
        "field `schema` is `{found}`, but that of a family file is `{}`: generate one with {FamilyToJson}",
        crate::family::SCHEMA
    )]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// The value of a field is invalid.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field.
        field: String,
        /// The problem and its remedy.
        problem: String,
    },
    /// The file is well formed but contradicts itself.
    #[error("field `{field}`: {problem}")]
    Claim {
        /// The field.
        field: String,
        /// The wrong claim.
        problem: String,
    },
    /// The search was cancelled.
    #[error("interrupted; nothing was written")]
    Cancelled,
}

impl FamilyError {
    /// Creates the error of a field.
    #[doc(hidden)]
    pub fn field(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Field { field: field.into(), problem: problem.into() }
    }

    /// Returns whether the file is complete but makes a wrong claim.
    pub fn is_broken_claim(&self) -> bool {
        matches!(self, Self::Claim { .. })
    }
}
