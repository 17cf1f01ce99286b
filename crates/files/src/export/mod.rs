//! Artwork, targets and detections to files and back, one module per format.
//!
//! Writers of artwork take shapes in millimetres and only change units and syntax; those of
//! targets and detections make text. Files appear whole or not at all, see [`atomic`],
//! and several as one, see [`staging`]; what a file is that is there already tells [`kind`].

pub mod atomic;
pub mod calibration;
pub mod camera;
pub mod comparison;
pub mod csv;
pub mod detection;
pub mod dsc;
pub mod dxf;
mod estimate;
mod finding;
#[cfg(feature = "meshes")]
pub mod gltf;
pub mod kind;
#[cfg(feature = "meshes")]
pub mod mesh;
mod motion;
pub mod npy;
#[cfg(feature = "meshes")]
pub mod obj;
pub mod orpc;
#[cfg(feature = "print")]
pub mod overlay;
#[cfg(feature = "print")]
pub mod pdf;
#[cfg(feature = "print")]
pub mod png;
pub mod pose;
pub mod rig;
pub mod saved;
pub mod staging;
pub mod stl;
#[cfg(feature = "print")]
mod supersample;
#[cfg(feature = "print")]
pub mod svg;
pub mod truth;
pub mod undistortion;

use std::path::PathBuf;

#[cfg(feature = "print")]
pub use supersample::{Block, SUBPIXELS, render as supersample};

/// Why an artifact was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
    /// A page larger than the format allows.
    #[error("{path}: a page of {width_mm} x {height_mm} mm is too large, {limit}")]
    TooLarge {
        /// The file asked for.
        path: PathBuf,
        /// Page width, mm.
        width_mm: f64,
        /// Page height, mm.
        height_mm: f64,
        /// The limit, and what to do.
        limit: String,
    },
}

/// What made a file, as it stands in all files that have a place for it.
pub const GENERATOR: &str = concat!("deltille ", env!("CARGO_PKG_VERSION"));

/// The file name of sheet `index` (from 0) of `count`: `name.svg`, or `name-2.svg` when there are
/// several.
pub fn sheet_file_name(name: &str, index: usize, count: usize, extension: &str) -> String {
    match count {
        1 => format!("{name}.{extension}"),
        _ => format!("{name}-{}.{extension}", index + 1),
    }
}
