//! Which view of a target to take next.

pub(in crate::calibrate) mod body;
pub(in crate::calibrate) mod gain;
pub(in crate::calibrate) mod guide;
pub(in crate::calibrate) mod holding;
pub(in crate::calibrate) mod place;
#[cfg(test)]
mod tests;
pub(in crate::calibrate) mod words;
