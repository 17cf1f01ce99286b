//! Deltille calibration targets: code families, verified print files, detection and calibration.
//!
//! A *deltille grid* is the triangular tiling coloured black and white; a *DelTag* is a triangular
//! 2D code inside one of its black tiles (Ha et al., "Deltille Grids for Geometric Camera
//! Calibration", ICCV 2017). This crate makes such targets, finds them in photographs and proves
//! every file it writes by reading it back.
//!
//! The modules form floors; each imports only from floors below it:
//!
//! | floor | module | its one job | crate |
//! |---|---|---|---|
//! | 1 | [`lattice`] | the triangular lattice: vertices, tiles, symmetries, the cells of a tag | `deltille-core` |
//! | 1 | [`raster`] | grey images: storage, sampling, blur | |
//! | 1 | [`camera`] | camera models and poses | |
//! | 1 | [`setting`] | the settings that messages name, and what they are called | |
//! | 2 | [`family`] | DelTag code families: certificates and decoding; [`family::search`] is `deltille-search` | |
//! | 3 | [`targets`] | what exists in the world: panels, corners and tags in millimetres | |
//! | 4 | [`layout`] | targets on paper: sheets with labels, check bars and cutting lines | `deltille-layout` |
//! | 4 | [`artwork`] | what is drawn, in millimetres, independent of file type | |
//! | 5 | [`synth`] | a target seen by a camera, as an image | |
//! | 4 | [`detect`] | from pixels to labelled corners | `deltille-detect` |
//! | 5 | [`calibrate`] | from detections to calibrated cameras | `deltille-calibrate` |
//! | 6 | [`limits`] | how much of a file is read, and panics of other code | `deltille-files` |
//! | 6 | [`photograph`] | photographs of any common format | |
//! | 6 | [`export`] | artwork, targets and results to files and back | |
//! | 6 | [`report`] | a calibration as a page to look at | |
//! | 7 | [`verify`] | an artifact read back and compared with its target | `deltille-verify` |
//!
//! These crates may change with any version; what this one re-exports is what programs can rely on. The programs `deltag` and
//! `deltille` are the crate `deltille-cli`.
//!
//! Conventions: lengths in millimetres, angles in radians, pixel centres at integer coordinates,
//! images row-major with y down, the board frame right-handed with x right and y up on the print.

pub use deltille_core::{Clock, Name, camera, glam, lattice, raster, setting, targets};
#[cfg(feature = "print")]
pub use deltille_files::logo;
#[cfg(feature = "report")]
pub use deltille_files::report;
#[cfg(feature = "files")]
pub use deltille_files::{SheetUseError, camera_file, clock, export, limits, target_file};
#[cfg(feature = "photographs")]
pub use deltille_files::{photograph, remap};
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

/// The program in the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
