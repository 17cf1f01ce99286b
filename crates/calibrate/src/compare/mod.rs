//! Two calibrations of one camera: `comparison` of their projections with what both are known to, and the `verdict`.

pub(in crate::calibrate) mod comparison;
pub(in crate::calibrate) mod verdict;
