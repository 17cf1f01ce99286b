//! Artwork, targets and results to files and back, one module for each format.
//!
//! Writers of artwork take shapes in millimetres and only convert units and syntax; writers of
//! targets and results return text. Files appear completely or not at all (see [`atomic`]), and
//! sets of files together (see [`staging`]); [`kind`] recognises what an existing file is before it
//! is replaced.

#[cfg(all(feature = "meshes", feature = "print"))]
pub mod artifacts;
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
#[cfg(feature = "meshes")]
pub mod inlay;
pub mod kind;
#[cfg(feature = "print")]
pub mod laser_svg;
#[cfg(feature = "meshes")]
pub mod mesh;
#[cfg(feature = "meshes")]
mod meshing;
mod motion;
pub mod next_view;
pub mod npy;
#[cfg(feature = "meshes")]
pub mod obj;
pub mod orpc;
#[cfg(feature = "overlay")]
pub mod overlay;
#[cfg(feature = "print")]
pub mod pdf;
#[cfg(feature = "print")]
pub mod png;
pub mod pose;
pub mod rig;
pub mod saved;
#[cfg(feature = "meshes")]
pub mod scene;
pub mod sheet;
#[cfg(feature = "meshes")]
pub mod solid_mesh;
pub mod staging;
pub mod stl;
#[cfg(feature = "print")]
mod supersample;
#[cfg(feature = "print")]
pub mod svg;
#[cfg(feature = "parquet")]
pub mod tables;
#[cfg(feature = "meshes")]
pub mod texture;
#[cfg(feature = "meshes")]
pub mod threemf;
/// Board poses beside a `.dsc`.
pub mod tp;
pub mod truth;
pub mod undistortion;

use std::path::PathBuf;

#[cfg(feature = "print")]
pub use supersample::{Block, SUBPIXELS, render as supersample};

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
    /// A page is larger than the format allows.
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

/// Name and version of this program, as all file formats with a place for it state them.
pub const GENERATOR: &str = concat!("deltille ", env!("CARGO_PKG_VERSION"));

/// The file name of the drawing of a board for a laser: `name-laser.dxf`, `name-laser.svg`.
pub fn laser_file_name(name: &str, extension: &str) -> String {
    format!("{name}-laser.{extension}")
}

/// The file name of sheet `index` (from 0) of `count`: `name.svg`, or `name-2.svg` when there are
/// several.
pub fn sheet_file_name(name: &str, index: usize, count: usize, extension: &str) -> String {
    match count {
        1 => format!("{name}.{extension}"),
        _ => format!("{name}-{}.{extension}", index + 1),
    }
}
