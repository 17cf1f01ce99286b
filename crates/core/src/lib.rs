//! The core of [deltille](https://docs.rs/deltille): the values that layout, detection and calibration share.
//!
//! Functions take values and return values: nothing here opens a file, prints or reads a clock. The crate also builds
//! for `wasm32-unknown-unknown`.
//!
//! The modules form layers; each imports only from layers below it:
//!
//! | layer | module | purpose |
//! |---|---|---|
//! | 1 | [`lattice`] | the triangular and the square lattice: vertices, tiles, symmetries, the cells of a tag |
//! | 1 | [`raster`] | grey images: storage, sampling, blur |
//! | 1 | [`camera`] | camera models and poses |
//! | 1 | [`setting`] | the settings that messages name, and their display names |
//! | 2 | [`family`] | DelTag code families: files, certificates, decoding |
//! | 3 | [`targets`] | physical objects: panels, corners and tags in millimetres |
//! | 4 | [`detection`] | detection results of an image |
//!
//! The crates above it are `deltille-search` (families), `deltille-layout` (targets on paper), `deltille-detect`
//! (pixels to labelled corners) and `deltille-calibrate` (detections to cameras).
//!
//! Items that only these crates need are `#[doc(hidden)]`: they may change with any version.
//!
//! Conventions: lengths in millimetres, angles in radians, pixel centres at integer coordinates,
//! images row-major with y down, the board frame right-handed with x right and y up on the print.

#[doc(hidden)]
pub mod angles;
pub mod camera;
mod clock;
#[doc(hidden)]
pub mod damping;
pub mod detection;
pub mod family;
mod identity;
pub mod json;
pub mod lattice;
pub mod name;
pub mod polygon;
pub mod quantity;
pub mod raster;
pub mod reading;
pub mod setting;
pub mod statistics;
pub mod targets;
pub mod words;

pub use clock::Clock;
pub use glam;
pub use name::Name;
