//! Grey images: storage, sampling, blur, reading and writing.
//!
//! Row-major, y down, pixel centres at integer coordinates.

mod bands;
mod blur;
mod coverage;
mod gray;
pub mod io;
mod pyramid;

pub use bands::{bands, fill_bands};
pub use blur::gaussian;
pub use coverage::Coverage;
pub use gray::{Gray, Intensity};
pub use io::{AnyGray, FileNotes, ImageError, Photograph, photograph, pixels, read, read_within};
pub use pyramid::{PYRAMID_FULL_SCALE, Pyramid};
