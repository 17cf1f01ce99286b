//! The clock of the machine.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// The time since this was first asked for.
pub fn now() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}
