//! Deltille calibration targets: code families, verified print files, detection and calibration.
//!
//! A *deltille grid* is the triangular tiling coloured black and white; a *DelTag* is a triangular 2D code inside one
//! of its black tiles (Ha et al., "Deltille Grids for Geometric Camera Calibration", ICCV 2017). This crate makes these
//! targets, detects them in images, and verifies every file it writes by reading it back.
//!
//! The modules form layers; each imports only from layers below it:
//!
//! | layer | module | purpose | crate |
//! |---|---|---|---|
//! | 1 | [`lattice`] | the triangular lattice: vertices, tiles, symmetries, the cells of a tag | `deltille-core` |
//! | 1 | [`raster`] | grey images: storage, sampling, blur | |
//! | 1 | [`camera`] | camera models and poses | |
//! | 1 | [`setting`] | the settings that messages refer to, and their names | |
//! | 2 | [`family`] | DelTag code families: certificates and decoding; [`family::search`] is `deltille-search` | |
//! | 3 | [`targets`] | physical targets: panels, corners and tags in millimetres | |
//! | 4 | [`layout`] | targets on paper: sheets with labels, check bars and cutting lines | `deltille-layout` |
//! | 4 | [`artwork`] | drawings in millimetres, independent of file type | |
//! | 5 | [`synth`] | synthetic images of a target | |
//! | 4 | [`detect`] | from pixels to labelled corners | `deltille-detect` |
//! | 5 | [`calibrate`] | from detections to calibrated cameras | `deltille-calibrate` |
//! | 6 | [`limits`] | limits on the resources that a file may use, and handling of panics in
//! third-party code | `deltille-files` |
//! | 6 | [`photograph`] | images in any common format | |
//! | 7 | [`frames`] | frames of photographs, videos and recordings | `deltille-frames` |
//! | 6 | [`export`] | writing and reading of artwork, targets and results | |
//! | 6 | [`report`] | calibration reports as HTML | |
//! | 7 | [`verify`] | comparison of artifacts with their target | `deltille-verify` |
//!
//! The underlying crates may change with any version; programs can rely on what this crate re-exports. The programs
//! `deltag` and `deltille` are in the crate `deltille-cli`.
//!
//! Conventions: lengths in millimetres, angles in radians, pixel centres at integer coordinates,
//! images row-major with y down, the board frame right-handed with x right and y up on the print.

pub use deltille_core::{Clock, Name, camera, glam, lattice, raster, setting, targets};
#[cfg(feature = "print")]
pub use deltille_files::logo;
#[cfg(feature = "report")]
pub use deltille_files::report;
#[cfg(feature = "files")]
pub use deltille_files::{
    SheetUseError, camera_file, clock, export, known_lengths, limits, robot_poses, target_file,
};
#[cfg(feature = "photographs")]
pub use deltille_files::{photograph, remap};
#[cfg(any(feature = "recordings", feature = "videos"))]
pub use deltille_frames as frames;
pub use deltille_layout::{artwork, synth};
#[cfg(feature = "verify")]
pub use deltille_verify as verify;

pub use {deltille_calibrate as calibrate, deltille_detect as detect, deltille_layout as layout};

/// Code families: rules, search, certificates and decoding; families by name or from their files.
pub mod family {
    pub use deltille_core::family::*;
    #[cfg(feature = "files")]
    pub use deltille_files::family_file::{FamilyFileError, read, resolve};
    pub use deltille_search as search;
}

/// The example program in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
