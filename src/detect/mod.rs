//! From pixels to labelled corners.

mod detection;

pub use detection::{DecodedTag, Detection, Grid, GridCorner};
