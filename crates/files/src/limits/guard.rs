//! Guards for third-party code: panics become errors, and code that does not end is abandoned after
//! a time limit.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Once, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// Stack size of a thread that runs third-party code, bytes: readers recurse for each level of a
/// file. Only the used part takes memory.
const STACK_BYTES: usize = 256 << 20;

/// Reason why guarded code returned no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Broken {
    /// The code panicked, or no thread could be started for it.
    #[error("the reader crashed; the file is damaged or malicious")]
    Panic,
    /// The code did not finish in time.
    #[error("the time limit is exceeded")]
    Time,
}

thread_local! {
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs third-party code on the calling thread. A panic becomes an error, and its message is not
/// printed.
///
/// # Errors
/// Returns [`Broken::Panic`] if the code panics.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, Broken> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let otherwise = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_QUIET.get() {
                otherwise(info);
            }
        }));
    });
    let before = IS_QUIET.replace(true);
    // Inconsistent state is not used after a panic.
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    IS_QUIET.set(before);
    result.map_err(|_| Broken::Panic)
}

/// Runs third-party code like [`caught`], on a thread with a deep stack, for at most `time`.
/// After that the thread continues, ignored, until it or the process ends.
///
/// # Errors
/// Returns [`Broken::Panic`] or [`Broken::Time`].
pub fn bounded<T: Send + 'static>(
    time: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Broken> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().stack_size(STACK_BYTES);
    let run = move || {
        // After the time limit, the receiver no longer exists.
        let _ = sender.send(caught(work));
    };
    thread.spawn(run).map_err(|_| Broken::Panic)?;
    receiver.recv_timeout(time).map_err(|_| Broken::Time)?
}

/// How to run third-party code that may panic or never end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Guard {
    /// On the calling thread without a time limit, like [`caught`]: for platforms without threads, for example a
    /// browser. Endless loops are not detected, and the stack is not enlarged.
    #[default]
    Here,
    /// On a separate thread with a time limit, like [`bounded`].
    Timed,
}

impl Guard {
    /// Runs third-party code, for at most `time` with [`Guard::Timed`].
    ///
    /// # Errors
    /// Returns [`Broken::Panic`] or [`Broken::Time`].
    pub fn run<T: Send + 'static>(
        self,
        time: Duration,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Broken> {
        match self {
            Self::Here => caught(work),
            Self::Timed => bounded(time, work),
        }
    }

    /// The instant that lies `time` from now; `None` without a time limit.
    pub fn end(self, time: Duration) -> Option<Instant> {
        match self {
            Self::Here => None,
            Self::Timed => Instant::now().checked_add(time),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_and_endless_loops_become_errors() {
        assert_eq!(caught(|| 1), Ok(1));
        assert_eq!(caught(|| -> u8 { panic!("not to be seen") }), Err(Broken::Panic));
        let second = Duration::from_secs(10);
        assert_eq!(bounded(second, || 1), Ok(1));
        assert_eq!(bounded(second, || -> u8 { panic!("not to be seen") }), Err(Broken::Panic));
        assert_eq!(Guard::Here.run(Duration::ZERO, || 1), Ok(1));
        assert_eq!(Guard::Here.end(second), None);
        for guard in [Guard::Here, Guard::Timed] {
            assert_eq!(
                guard.run(second, || -> u8 { panic!("not to be seen") }),
                Err(Broken::Panic)
            );
        }
        let sleep = || thread::sleep(Duration::from_secs(60));
        assert_eq!(bounded(Duration::from_millis(20), sleep), Err(Broken::Time));
    }
}
