//! The pose of a target in an image of a known camera.

use super::diagnose::diagnosis::Diagnosis;
use super::diagnose::messages::Messages;
use super::error::CalibrationError;
use super::estimate::values::Estimate;
use super::input::calibration::Calibration;
use deltille_core::detection::Detection;

impl Calibration {
    /// Solves for the pose of the target in one image of a known camera, as [`Self::solve`] does. The inner error is a
    /// sentence that says why no pose was found; `seen` is the detection.
    ///
    /// # Errors
    /// Returns an error if the calibration itself is invalid.
    pub fn located(&self, seen: &Detection) -> Result<Result<Estimate, String>, CalibrationError> {
        let found = match self.solve() {
            Err(error @ CalibrationError::OtherSize { .. }) => return Ok(Err(error.to_string())),
            found => found?,
        };
        let said = found.diagnose();
        let foreign = said.iter().find(|said| matches!(said, Diagnosis::WrongCamera { .. }));
        if let Some(foreign) = foreign {
            return Ok(Err(Messages::new(&found, None).sentence(foreign)));
        }
        if found.frames.is_empty() {
            let excluded = found.excluded.first().map(|out| out.reason.to_string());
            let reason = || seen.reasons.first().map(ToString::to_string);
            return Ok(Err(excluded
                .or_else(reason)
                .unwrap_or_else(|| "no target found".to_owned())));
        }
        Ok(Ok(found))
    }
}
