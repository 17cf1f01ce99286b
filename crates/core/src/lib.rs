//! The core of [deltille](https://docs.rs/deltille): what exists in the world, what a camera sees of it, and back.
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
//! | 2 | [`family`] | DelTag code families: search, certificates, decoding |
//! | 3 | [`targets`] | what exists in the world: panels, corners and tags in millimetres |
//! | 4 | [`layout`] | targets on paper: sheets with labels, check bars and cutting lines |
//! | 4 | [`artwork`] | what is drawn, in millimetres, independent of file type |
//! | 4 | [`detect`] | from pixels to labelled corners |
//! | 5 | [`synth`] | a target seen by a camera, as an image |
//! | 5 | [`calibrate`] | from detections to calibrated cameras |
//!
//! Conventions: lengths in millimetres, angles in radians, pixel centres at integer coordinates,
//! images row-major with y down, the board frame right-handed with x right and y up on the print.

mod angles;
pub mod artwork;
pub mod calibrate;
pub mod camera;
mod clock;
pub mod detect;
pub mod family;
mod identity;
pub mod json;
pub mod lattice;
pub mod layout;
pub mod name;
pub mod polygon;
pub mod quantity;
pub mod raster;
pub mod reading;
pub mod statistics;
pub mod synth;
pub mod targets;
pub mod words;

pub use clock::Clock;
pub use name::Name;
pub use {glam, nalgebra};
