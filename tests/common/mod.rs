//! What several tests share.

use std::path::{Path, PathBuf};

/// A folder of the real data, or `None` with a printed reason where it is absent.
pub fn data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("DELTILLE_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    let path = root.join(folder);
    if !path.is_dir() {
        println!("skipped: no {} (set DELTILLE_DATA)", path.display());
        return None;
    }
    Some(path)
}
