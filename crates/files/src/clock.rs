//! The monotonic clock of the machine.

use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// Returns the time since the first call of this function in the process.
pub fn now() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    START.elapsed()
}
