//! What is to be said about an estimate.

pub(in crate::calibrate) mod diagnosis;
pub(in crate::calibrate) mod model_selection;
pub(in crate::calibrate) mod one_state;
pub(in crate::calibrate) mod words;
