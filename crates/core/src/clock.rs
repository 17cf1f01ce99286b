//! Time, which the caller brings: the core has no clock of its own.

use std::time::Duration;

/// The time since any moment that stays the same.
pub type Clock = fn() -> Duration;
