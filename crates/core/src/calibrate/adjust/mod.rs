//! Adjustment with gross errors removed.

pub(in crate::calibrate) mod added_unknowns;
pub(in crate::calibrate) mod finding;
pub(in crate::calibrate) mod gross_errors;
pub(in crate::calibrate) mod lack_of_fit;
pub(in crate::calibrate) mod reweighting;
pub(in crate::calibrate) mod view_consistency;
