//! Constructs that are not allowed.

use serde::Serialize;

/// A construct that is not allowed, or hidden content.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ConstructFinding {
    /// The file has a construct that viewers may render differently. Other programs may then show
    /// something other than the page that is verified here.
    #[error("{place}: {construct} (viewers may render it differently)")]
    Construct {
        /// Its location, in the terms of the format.
        place: String,
        /// The construct or problem.
        construct: String,
    },
    /// A line of a text format differs from the one that the program writes.
    #[error("{place}: {found}: the file was damaged or edited; generate it again")]
    OtherLine {
        /// Its location, such as `line 12`.
        place: String,
        /// The beginning of the line found there, or a note that the file ends.
        found: String,
    },
    /// Content that is not visible on the page: text that differs from the target's, or marks beyond the page.
    #[error("{place}: {problem}")]
    Unseen {
        /// Its location, in the terms of the format.
        place: String,
        /// The construct or problem.
        problem: String,
    },
}
