//! A flag by which somebody else ends a calibration.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag by which somebody else ends a calibration, see [`Calibration::stopped_by`](crate::Calibration::stopped_by).
///
/// It says nothing of what is calibrated: any two are equal.
#[derive(Clone, Debug, Default)]
pub(super) struct Stop(Option<Arc<AtomicBool>>);

impl Stop {
    /// A flag that may be raised.
    pub(crate) fn by(flag: Arc<AtomicBool>) -> Self {
        Self(Some(flag))
    }

    /// Whether the work is to end.
    pub(crate) fn is_raised(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

impl PartialEq for Stop {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Calibration, CalibrationError, Model};
    use super::*;
    use deltille_core::camera::Pose;

    #[test]
    fn a_calibration_ends_when_it_is_told_to() {
        let flag = Arc::new(AtomicBool::new(true));
        let calibration = Calibration::new([Pose::IDENTITY]).camera("c", Vec::new(), Model::Radtan);
        assert_ne!(calibration.solve(), Err(CalibrationError::Stopped));
        let stopped = calibration.clone().stopped_by(flag);
        assert_eq!(stopped, calibration);
        assert_eq!(stopped.solve(), Err(CalibrationError::Stopped));
    }
}
