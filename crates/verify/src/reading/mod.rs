//! Files, in memory or on disk, within limits.
//!
//! Comes in: names of files, and where their bytes are. Goes out: bytes, and what the names say.
//!
//! 1. `names` tells which file is a part of which artifact, `format` what an extension stands for.
//! 2. `reader` takes bytes from artifacts in memory or on disk, and runs code of others on them.
//! 3. `error` says why something cannot be read.

pub(super) mod error;
pub(super) mod format;
pub(super) mod names;
pub(super) mod reader;
