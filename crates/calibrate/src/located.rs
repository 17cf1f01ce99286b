//! Where a target is in a picture of a known camera.

use super::diagnose::diagnosis::Diagnosis;
use super::diagnose::words::Words;
use super::error::CalibrationError;
use super::estimate::values::Estimate;
use super::input::calibration::Calibration;
use deltille_core::detection::Detection;

impl Calibration {
    /// [`Self::solve`] for one picture of a known camera: the pose of the target in it, or a sentence that says why
    /// there is none; `seen` is the detection.
    ///
    /// # Errors
    /// Where the calibration itself is wrong.
    pub fn located(&self, seen: &Detection) -> Result<Result<Estimate, String>, CalibrationError> {
        let found = match self.solve() {
            Err(error @ CalibrationError::OtherSize { .. }) => return Ok(Err(error.to_string())),
            found => found?,
        };
        let said = found.diagnose();
        let foreign = said.iter().find(|said| matches!(said, Diagnosis::ForeignCamera { .. }));
        if let Some(foreign) = foreign {
            return Ok(Err(Words::new(&found, None).sentence(foreign)));
        }
        if found.frames.is_empty() {
            let excluded = found.excluded.first().map(|out| out.reason.to_string());
            let reason = || seen.reasons.first().map(ToString::to_string);
            return Ok(Err(excluded
                .or_else(reason)
                .unwrap_or_else(|| "no target in it".to_owned())));
        }
        Ok(Ok(found))
    }
}
