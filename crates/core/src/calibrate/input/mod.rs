//! What a calibration is made from.

pub(in crate::calibrate) mod calibration;
pub(in crate::calibrate) mod grid;
pub(in crate::calibrate) mod loss;
pub(in crate::calibrate) mod observation;
pub(in crate::calibrate) mod order;
pub(in crate::calibrate) mod panel;
pub(in crate::calibrate) mod reference;
pub(in crate::calibrate) mod sample;
pub(in crate::calibrate) mod views;
pub(in crate::calibrate) mod weights;
