//! Helpers shared by several tests.

pub mod command;
pub mod folder;
pub mod glb;
pub mod page;
pub mod png;
pub mod solids;
pub mod verdict;
pub mod view;

use std::path::{Path, PathBuf};

/// The folder of the repository.
pub const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Returns a folder of the photographs and published artifacts. Tests that use it are ignored if `build.rs` has not
/// found it.
pub fn data(folder: &str) -> PathBuf {
    let beside = || Path::new(REPOSITORY).join("../shared/data");
    std::env::var_os("DELTILLE_DATA").map_or_else(beside, PathBuf::from).join(folder)
}
