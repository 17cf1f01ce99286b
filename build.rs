//! Tells the tests whether the photographs are there that they are to be run on.

use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(has_data)");
    println!("cargo::rerun-if-env-changed=DELTILLE_DATA");
    println!("cargo::rerun-if-changed=build.rs");
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let root = std::env::var_os("DELTILLE_DATA").map_or_else(beside, PathBuf::from);
    if root.join("robot-hand").is_dir() {
        println!("cargo::rustc-cfg=has_data");
    }
}
