//! Normal equations, and their minimum.

pub(in crate::calibrate) mod block;
pub(in crate::calibrate) mod covariances;
pub(in crate::calibrate) mod frame;
pub(in crate::calibrate) mod layout;
pub(in crate::calibrate) mod local_share;
pub(in crate::calibrate) mod minimise;
pub(in crate::calibrate) mod normal;
pub(in crate::calibrate) mod step;
