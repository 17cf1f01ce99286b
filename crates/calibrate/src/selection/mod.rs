//! Selection of the frames of a recording that are used for a calibration.
//!
//! Input: the detections of all frames of one camera or of a rig, one after the other. Output: the frames to calibrate with.
//!
//! 1. `keyframes` keeps the stillest frame of each position of the target, a few hundred at most.
//! 2. `informative` selects those that together lower the projection uncertainty most.

mod informative;
pub(crate) mod keyframes;
