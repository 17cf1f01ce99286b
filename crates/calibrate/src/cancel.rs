//! A flag by which the caller stops a calibration.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag by which the caller stops a calibration, see [`Calibration::cancelled_by`](crate::Calibration::cancelled_by).
///
/// The flag is not part of the problem, so any two flags are equal.
#[derive(Clone, Debug, Default)]
pub(super) struct Stop(Option<Arc<AtomicBool>>);

impl Stop {
    /// Creates a flag that the caller may raise.
    pub(crate) fn by(flag: Arc<AtomicBool>) -> Self {
        Self(Some(flag))
    }

    /// Whether the calibration must stop.
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
    fn a_raised_flag_stops_a_calibration() {
        let flag = Arc::new(AtomicBool::new(true));
        let calibration = Calibration::new([Pose::IDENTITY]).camera("c", Vec::new(), Model::Radtan);
        assert_ne!(calibration.solve(), Err(CalibrationError::Stopped));
        let stopped = calibration.clone().cancelled_by(flag);
        assert_eq!(stopped, calibration);
        assert_eq!(stopped.solve(), Err(CalibrationError::Stopped));
    }
}
