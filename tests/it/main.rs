//! Tests of whole commands and of properties of the library. They are one program, because linking
//! takes longer than running most of them. The path of a module runs its tests: `cargo test
//! --release --test it detect::reasons`.

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

/// Mutations of files that preserve their format, shared with the fuzz targets.
#[path = "../../fuzz/src/files/mod.rs"]
mod changed;
