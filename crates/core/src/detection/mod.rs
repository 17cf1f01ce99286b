//! What detection finds, as values; the detector is the crate `deltille-detect`.
//!
//! 1. `values`: a [`Detection`] of an image, with its grids, corners and tags;
//! 2. `reason`: why labels are missing;
//! 3. `tone`, `ink`: what was estimated of the camera's tone curve, and of the ink on the print;
//! 4. `watch`: which images of a stream are worth keeping.

mod ink;
mod reason;
mod tone;
mod values;
mod watch;

pub use ink::{Ink, InkEstimate};
pub use reason::{Reason, ReasonKind};
pub use tone::{Curve, Piece, TERMS, TONE_PARAMS, Tone, ToneEstimate};
pub use values::{DecodedTag, Detection, Grid, GridCorner};
pub use watch::{Glance, Watch};

/// The median edge of a grid that no tag vouches for is no shorter than this, px. Blur leaves nothing
/// of smaller tiles but their fundamental wave, and that is the same for squares, dots and threads.
pub const MIN_UNTAGGED_EDGE_PX: f64 = 7.0;
