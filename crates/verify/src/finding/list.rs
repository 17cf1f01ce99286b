//! Deviations of a list for other detectors.

use serde::Serialize;

/// A deviation of a list for other detectors.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ListFinding {
    /// The list differs from the target.
    #[error("{problem}")]
    Listed {
        /// Description of the difference.
        problem: String,
    },
}
