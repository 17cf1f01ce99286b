//! Detection: from photographs to labelled corners.
//!
//! Input: photographs, and their targets. Output: detection files, in formats that other programs read.
//!
//! 1. `render` renders a synthetic photograph of a target with full ground truth.
//! 2. `detector_options` selects targets and methods.
//! 3. `detect` detects targets in many photographs in parallel, and writes the results; `outcomes` prints them.
//! 4. `refine` only refines corners that another program detected.

pub mod detect;
pub mod detector_options;
mod outcomes;
pub mod refine;
pub mod render;
