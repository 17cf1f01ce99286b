//! Whole commands and laws of the library. One program, as linking takes longer than running most of it; a part is run by
//! its path: `cargo test --release --test it detect::reasons`.

#![allow(unreachable_pub, reason = "tests have no interface")]

mod calibrate;
mod chapters;
mod common;
mod detect;
mod families;
mod files;
mod make;
mod verify;
mod vocabulary;

/// Files that are changed so that they keep their form; the fuzz targets share them.
#[path = "../../fuzz/src/files/mod.rs"]
mod changed;
