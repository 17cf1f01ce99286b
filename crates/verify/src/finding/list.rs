//! Deviations of a list for other detectors.

use serde::Serialize;

/// A deviation of a list for other detectors.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ListFinding {
    /// The list is not that of the target.
    #[error("{problem}")]
    Listed {
        /// The difference in words.
        problem: String,
    },
}
