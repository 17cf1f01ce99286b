//! Time. The core has no clock of its own; the caller supplies one.

use std::time::Duration;

/// A monotonic clock: the time since an arbitrary fixed moment.
pub type Clock = fn() -> Duration;
