//! Two calibrations of one camera.

pub(in crate::calibrate) mod comparison;
pub(in crate::calibrate) mod verdict;
