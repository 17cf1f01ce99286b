//! Two calibrations of one camera: `comparison` of their projections with what both are known to, and the `verdict`.

pub(crate) mod comparison;
pub(crate) mod verdict;
