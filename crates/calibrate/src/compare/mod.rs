//! Comparison of two calibrations of one camera: `comparison` tests the difference of their projections against their
//! uncertainties, `verdict` summarises it.

pub(crate) mod comparison;
pub(crate) mod verdict;
