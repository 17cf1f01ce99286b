//! Errors of reading a calibration.

use deltille_core::setting::Setting::{CalibrationWrite, RigWrite};

/// Error of reading a calibration from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedError {
    /// The file is neither the calibration of a camera nor of a rig.
    #[error("not a calibration written by {CalibrationWrite} or {RigWrite}")]
    Foreign,
    /// The text is not complete.
    #[error("{0}")]
    Incomplete(String),
    /// A field is missing or has an invalid value.
    #[error("field `{field}`: {problem}")]
    Field {
        /// The field, for example `cameras[1].views[3].rms_px`.
        field: String,
        /// The problem with the field.
        problem: String,
    },
    /// The calibration was made with another target.
    #[error("{0}")]
    OtherTarget(String),
    /// A corner lies on a panel that the target does not have.
    #[error("panel {0} is not on the target")]
    Panel(u32),
}
