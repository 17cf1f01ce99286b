//! What a calibration is made from.

pub(in crate::calibrate) mod calibration;
pub(in crate::calibrate) mod grid;
pub(in crate::calibrate) mod loss;
pub(in crate::calibrate) mod panel;
pub(in crate::calibrate) mod view;
