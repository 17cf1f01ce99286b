//! Constructs that are not permitted.

use serde::Serialize;

/// A construct that is not permitted, or hidden content.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ConstructFinding {
    /// The file has a construct that not every viewer shows alike, so that other programs may show
    /// something else than is seen here.
    #[error("{place}: {construct}: not every viewer shows that alike")]
    Construct {
        /// Its place, in the terms of the format.
        place: String,
        /// The construct or problem.
        construct: String,
    },
    /// A line of a text format is not the one that the program writes.
    #[error("{place}: {found}: the file was damaged or edited since it was written: make it again")]
    OtherLine {
        /// Its place, such as `line 12`.
        place: String,
        /// What is there: how the line begins, or that the file ends.
        found: String,
    },
    /// Content that no picture of the page shows: texts that are not those of the target, or marks
    /// beside the page.
    #[error("{place}: {problem}")]
    Unseen {
        /// Its place, in the terms of the format.
        place: String,
        /// The construct or problem.
        problem: String,
    },
}
