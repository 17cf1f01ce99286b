//! Artwork, targets and results to files and back, one module for each format.
//!
//! In the order of their use: `pages` (artwork as PDF, SVG, PNG, and drawings for cutters), `meshes` (targets in space),
//! `detections` (lists of boards), `cameras` (calibrations and their applications). `writing` writes files to disk, and
//! [`artifacts`] makes all files of a target.
//!
//! Writers of artwork take shapes in millimetres and only convert units and syntax; writers of targets and results return text.
//! Files appear completely or not at all (see [`atomic`]), and sets of files together (see [`staging`]). [`kind`] recognises an
//! existing file before it is replaced.

#[cfg(all(feature = "meshes", feature = "print"))]
pub mod artifacts;
mod cameras;
mod detections;
mod meshes;
pub mod named;
mod pages;
mod writing;

pub use cameras::format::{
    CAMERA_FORMATS, CameraFormat, Overlaps, Placed, RIG_FORMATS, RigFile, RigFormat, Written,
};
pub use cameras::{
    acceptance, calibration, camera, check, comparison, covariance, hand_eye, next_view, pose, rig,
    saved, sheet, timing, truth, undistortion,
};
pub use detections::format::{DETECTION_FORMATS, DetectionFormat};
#[cfg(feature = "overlay")]
pub use detections::overlay;
#[cfg(feature = "parquet")]
pub use detections::tables;
pub use detections::{csv, detection, dsc, npy, orpc, tp};
pub use meshes::stl;
#[cfg(feature = "meshes")]
pub use meshes::{gltf, inlay, mesh, obj, scene, solid_mesh, texture, threemf};
pub use pages::dxf;
#[cfg(feature = "print")]
pub use pages::{laser_svg, pdf, png, svg};
pub use writing::{atomic, kind, staging};

use std::path::PathBuf;

#[cfg(feature = "print")]
pub use pages::supersample::{Block, SUBPIXELS, render as supersample};

/// Error of writing a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] atomic::WriteError),
    /// A page is larger than the format allows.
    #[error("{path}: a page of {width_mm} x {height_mm} mm is too large: {limit}")]
    TooLarge {
        /// The requested file.
        path: PathBuf,
        /// Page width, mm.
        width_mm: f64,
        /// Page height, mm.
        height_mm: f64,
        /// The limit and the remedy.
        limit: String,
    },
}

/// Name and version of this program, written to all file formats with a field for it.
pub const GENERATOR: &str = concat!("deltille ", env!("CARGO_PKG_VERSION"));

/// The file name of the drawing of a board for a laser: `name-laser.dxf`, `name-laser.svg`.
pub fn laser_file_name(name: &str, extension: &str) -> String {
    format!("{name}-laser.{extension}")
}

/// The file name of sheet `index` (from 0) of `count`: `name.svg`, or for several sheets `name-2.svg`.
pub fn sheet_file_name(name: &str, index: usize, count: usize, extension: &str) -> String {
    match count {
        1 => format!("{name}.{extension}"),
        _ => format!("{name}-{}.{extension}", index + 1),
    }
}
