//! When the rows of calibrated cameras are exposed: the readout of a rolling shutter, and offsets and drifts of the clocks of a
//! rig, from the frames of a moving target.
//!
//! Input: cameras, their poses on the rig, and views with time stamps. Output: a [`values::Timing`].
//!
//! 1. `values` has the input and the result as values.
//! 2. `motion` is the smooth path of the target through five successive frames of the first camera.
//! 3. `equations` forms the normal equations of one frame, without the pose of the target in it.
//! 4. `run` starts the offsets by a search, and iterates 2 and 3.
//! 5. `compensated` moves corners to where a global shutter and synchronous clocks would have seen them.

pub(crate) mod compensated;
mod equations;
mod motion;
pub(crate) mod run;
#[cfg(test)]
pub(crate) mod simulated;
pub(crate) mod values;
