//! Detection results as values; the crate `deltille-detect` contains the detector.
//!
//! 1. `values`: a [`Detection`] of an image, with its grids, corners and tags;
//! 2. `reason`: why labels are missing;
//! 3. `tone`, `ink`: the estimated tone curve of the camera and ink spread of the print;
//! 4. `watch`: which images of a stream are worth keeping.

mod ink;
mod reason;
mod tone;
mod values;
mod watch;

pub use ink::{Ink, InkEstimate};
pub use reason::{OtherSettings, Reason, ReasonKind};
pub use tone::{Curve, Piece, TERMS, TONE_PARAMS, Tone, ToneEstimate};
pub use values::{DecodedTag, Detection, Grid, GridCorner};
pub use watch::{FrameStatus, Watch};

/// Shortest median edge of an accepted grid without a confirming tag, px. In smaller tiles, blur
/// leaves only the fundamental frequency, which is the same for squares, dots and threads.
pub const MIN_UNTAGGED_EDGE_PX: f64 = 7.0;
