//! Detections in photographs, and lists of boards.
//!
//! [`detection`] is the JSON of a detection; [`csv`], [`orpc`] and `tables` are for other programs, and `format` lists all of
//! them. `overlay` draws a detection over the photograph. [`dsc`] and [`tp`] contain boards and their poses, [`npy`] arrays.

pub mod csv;
pub mod detection;
pub mod dsc;
pub(super) mod format;
pub mod npy;
pub mod orpc;
#[cfg(feature = "overlay")]
pub mod overlay;
mod positions;
#[cfg(feature = "parquet")]
pub mod tables;
pub mod tp;
