//! Files, in memory or on disk, within limits.
//!
//! Input: file names and the source of their bytes. Output: the bytes, and the meaning of the names.
//!
//! 1. `names` assigns files to artifacts, and `format` assigns formats to extensions.
//! 2. `reader` reads artifacts from memory or disk, and runs third-party code on them.
//! 3. `error` says why an artifact cannot be read.

pub(super) mod error;
pub(super) mod format;
pub(super) mod names;
pub(super) mod reader;
