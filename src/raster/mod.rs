//! Grey images: storage, sampling, blur, reading and writing.
//!
//! Row-major, y down, pixel centres at integer coordinates.

mod gray;

pub use gray::{Gray, Intensity};
