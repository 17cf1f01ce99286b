//! Unknowns and observations of a bundle adjustment.

pub(in crate::calibrate) mod bundle;
pub(in crate::calibrate) mod corner_gauge;
pub(in crate::calibrate) mod corner_map;
pub(in crate::calibrate) mod panels;
pub(in crate::calibrate) mod roughness;
pub(in crate::calibrate) mod shape;
pub(in crate::calibrate) mod unknowns;
pub(in crate::calibrate) mod whitening;
