use crate::reading::in_words;
use crate::setting::Setting::FamilyToJson;

/// What is wrong with a family, its text or its name.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FamilyError {
    /// No shipped family and no file of this name.
    #[error(
        "no family is called `{name}`: give one of {}, or the path of a .json family file",
        shipped.join(", ")
    )]
    Unknown {
        /// The name asked for.
        name: String,
        /// The families that come with the library.
        shipped: Vec<&'static str>,
    },
    /// Not JSON, cut off, or with a field missing, unknown or of the wrong type.
    #[error("not a family file: {}; generate it anew with {FamilyToJson}", in_words(.0))]
    Json(#[from] serde_json::Error),
    /// Another schema, or another version of it.
    #[error(
        "field `schema` is `{found}`, this version reads `{}`: generate the file anew with \
         {FamilyToJson}",
        crate::family::SCHEMA
    )]
    Schema {
        /// The schema that the file names.
        found: String,
    },
    /// A field holds what it must not.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field.
        field: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// The file is well formed, and contradicts itself.
    #[error("field `{field}`: {problem}")]
    Claim {
        /// The field.
        field: String,
        /// What does not hold.
        problem: String,
    },
    /// The search was stopped from outside.
    #[error("interrupted; nothing was written")]
    Cancelled,
}

impl FamilyError {
    /// A problem of a field.
    #[doc(hidden)]
    pub fn field(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Field { field: field.into(), problem: problem.into() }
    }

    /// Whether a file was read whole, and what it claims does not hold.
    pub fn is_broken_claim(&self) -> bool {
        matches!(self, Self::Claim { .. })
    }
}
