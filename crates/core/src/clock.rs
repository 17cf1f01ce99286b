//! Time, which the caller brings: the core has no clock of its own.

use std::time::Duration;

/// A monotonic clock: the time since a moment that stays the same, whichever it is.
pub type Clock = fn() -> Duration;
