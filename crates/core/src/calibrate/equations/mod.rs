//! Normal equations, and their minimum.

pub(in crate::calibrate) mod local_share;
pub(in crate::calibrate) mod minimise;
pub(in crate::calibrate) mod normal;
