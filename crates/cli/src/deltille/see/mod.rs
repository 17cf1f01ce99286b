//! Pictures: from photographs to labelled corners.
//!
//! Comes in: photographs, and the targets in them. Goes out: files of detections, in the formats that other programs read.
//!
//! 1. `render` takes a synthetic photograph of a target, for which all is known that the others find.
//! 2. `detector_options` says what to look for, and how.
//! 3. `detect` finds it in many photographs at once and writes what it found.
//! 4. `refine` only refines corners whose places another program found.

pub mod detect;
pub mod detector_options;
pub mod refine;
pub mod render;
