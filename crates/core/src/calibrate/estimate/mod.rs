//! The result.

pub(in crate::calibrate) mod assemble;
pub(in crate::calibrate) mod coverage;
pub(in crate::calibrate) mod image_circle;
pub(in crate::calibrate) mod lens_end;
pub(in crate::calibrate) mod target_map;
pub(in crate::calibrate) mod uncertainty_map;
pub(in crate::calibrate) mod values;
