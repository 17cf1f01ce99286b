//! Calibrations of cameras and rigs, read back from their JSON.
//!
//! 1. `record` has the structure of the JSON.
//! 2. `error` says why a file cannot be read.
//! 3. `estimate` converts the records into an [`Estimate`].
//!
//! Quantities that a file does not contain stay empty: corners (unless residuals were requested), findings and lack of fit
//! (files describe them in words), and refined panel poses (they are in the refined target). The
//! reason for excluding a view is the text in the file.

mod error;
mod estimate;
mod record;

use deltille_calibrate::{Estimate, Reference};
use deltille_core::json;
use deltille_core::json::ReadError;
use deltille_core::reading::in_words;
use deltille_core::targets::{Target, TargetIdentity, check_result_of};
use serde::Deserialize;

use self::estimate::Panels;
use self::record::{Rig, Single};
use super::{calibration, rig};

pub use self::error::SavedError;
pub(in crate::export) use self::record::SavedPose;

/// Reads the estimate of a camera or a rig from its JSON; `reference` is the target that was photographed.
///
/// # Errors
/// Returns an error if the text is not a calibration, if a field is not valid, or if the calibration was made with another
/// target.
pub fn read(text: &str, reference: &Reference) -> Result<Estimate, SavedError> {
    let found = estimate(text, Some(reference))?;
    let given: Vec<TargetIdentity> = reference.targets().iter().map(Target::identity).collect();
    check_result_of(&found.calibrated_with, &given).map_err(SavedError::OtherTarget)?;
    Ok(found)
}

fn estimate(text: &str, reference: Panels) -> Result<Estimate, SavedError> {
    let wrong = |error| match error {
        ReadError::Json(problem) => SavedError::Incomplete(in_words(&problem)),
        ReadError::Field { field, problem } => SavedError::Field { field, problem },
    };
    match json::schema(text.as_bytes()).ok().flatten().as_deref() {
        Some(calibration::SCHEMA) => json::read::<Single>(text).map_err(wrong)?.estimate(reference),
        Some(rig::SCHEMA) => json::read::<Rig>(text).map_err(wrong)?.estimate(reference),
        _ => Err(SavedError::Foreign),
    }
}

/// Reads the estimate of a camera or a rig without its target. The panels of corners are then identified by id only.
///
/// # Errors
/// Returns an error if the text is not a calibration, or if a field is not valid.
pub fn read_without_target(text: &str) -> Result<Estimate, SavedError> {
    estimate(text, None)
}

/// Returns the reasons not to use the calibration of a file: the texts of its [failures](calibration::is_failure).
pub fn failures(text: &str) -> Vec<String> {
    #[derive(Deserialize)]
    struct SavedDiagnoses {
        #[serde(default)]
        diagnoses: Vec<SavedDiagnosis>,
    }
    #[derive(Deserialize)]
    struct SavedDiagnosis {
        kind: String,
        text: String,
    }
    let saved = serde_json::from_str::<SavedDiagnoses>(text);
    let diagnoses = saved.map(|saved| saved.diagnoses).unwrap_or_default();
    let failures = diagnoses.into_iter().filter(|found| calibration::is_failure(&found.kind));
    failures.map(|found| found.text).collect()
}
