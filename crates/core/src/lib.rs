//! The core of [deltille](https://docs.rs/deltille): the values that layout, detection and calibration share.
//!
//! Values in, values out: nothing here opens a file, prints, or asks a clock. It builds for
//! `wasm32-unknown-unknown` too.
//!
//! The modules form floors; each imports only from floors below it:
//!
//! | floor | module | its one job |
//! |---|---|---|
//! | 1 | [`lattice`] | the triangular and the square lattice: vertices, tiles, symmetries, the cells of a tag |
//! | 1 | [`raster`] | grey images: storage, sampling, blur |
//! | 1 | [`camera`] | camera models and poses |
//! | 1 | [`setting`] | the settings that messages name, and what they are called |
//! | 2 | [`family`] | DelTag code families: files, certificates, decoding |
//! | 3 | [`targets`] | what exists in the world: panels, corners and tags in millimetres |
//! | 4 | [`detection`] | what a detector finds in an image |
//!
//! The crates above it are `deltille-search` (families), `deltille-layout` (targets on paper), `deltille-detect` (from pixels to
//! labelled corners) and `deltille-calibrate` (from detections to cameras).
//!
//! What these crates need of this one and users do not is `#[doc(hidden)]`: it may change with any version.
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
