//! What the deviations of an estimate are.

pub(in crate::calibrate) mod agreement;
pub(in crate::calibrate) mod board_errors;
pub(in crate::calibrate) mod halves;
pub(in crate::calibrate) mod known_so_far;
pub(in crate::calibrate) mod projection;
pub(in crate::calibrate) mod state_equations;
