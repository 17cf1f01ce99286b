//! Deltille calibration targets: code families, verified print files, detection and calibration.
//!
//! A *deltille grid* is the triangular tiling coloured black and white; a *DelTag* is a triangular
//! 2D code inside one of its black tiles (Ha et al., "Deltille Grids for Geometric Camera
//! Calibration", ICCV 2017). This crate makes such targets, finds them in photographs and proves
//! every file it writes by reading it back.
//!
//! The modules form floors; each imports only from floors below it:
//!
//! | floor | module | its one job |
//! |---|---|---|
//! | 0 | [`limits`] | how much of a file is read, and panics of other code |
//! | 1 | [`lattice`] | the triangular lattice: vertices, tiles, symmetries, the cells of a tag |
//! | 1 | [`raster`] | grey images: storage, sampling, blur, files |
//! | 1 | [`camera`] | camera models and poses |
//! | 2 | [`family`] | DelTag code families: search, certificates, decoding, files |
//! | 3 | [`target`] | what exists in the world: panels, corners and tags in millimetres |
//! | 4 | [`artwork`] | what is drawn, in millimetres, independent of file type |
//! | 4 | [`detect`] | from pixels to labelled corners |
//! | 5 | [`synth`] | a target seen by a camera, as an image |
//! | 5 | [`calibrate`] | from detections to calibrated cameras |
//! | 6 | [`export`] | artwork, targets and results to files and back |
//! | 6 | [`report`] | a calibration as a page to look at |
//! | 7 | [`verify`] | an artifact read back from disk and compared with its target |
//! | 8 | [`experiment`] | simulations that measure the library itself |
//! | 9 | `cli` | the programs' arguments, progress and messages |
//!
//! Conventions: lengths in millimetres, angles in radians, pixel centres at integer coordinates,
//! images row-major with y down, the board frame right-handed with x right and y up on the print.

pub mod artwork;
pub mod calibrate;
pub mod camera;
#[cfg(feature = "cli")]
pub mod cli;
pub mod detect;
pub mod experiment;
pub mod export;
pub mod family;
mod json;
pub mod lattice;
pub mod limits;
mod name;
mod quantity;
pub mod raster;
pub mod report;
pub mod synth;
pub mod target;
pub mod verify;
mod words;
