use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::{Once, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// Stack of a thread that runs code of others, bytes: their readers call themselves for each level
/// of a file. Only what is used of it is memory.
const STACK_BYTES: usize = 256 << 20;

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Broken {
    /// The code panicked.
    #[error("its reader failed within; the file is damaged, or made to do that")]
    Panic,
    /// The time is over.
    #[error("the time is over")]
    Time,
}

thread_local! {
    static IS_QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs code of others; a panic within is an error, and nothing is printed of it.
///
/// # Errors
/// [`Broken::Panic`].
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
    // What the code was at work on is not looked at after a panic.
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    IS_QUIET.set(before);
    result.map_err(|_| Broken::Panic)
}

/// Runs code of others as [`caught`] does, on a thread with a deep stack, for so long. After that
/// it goes on unheard, until it or the program ends.
///
/// # Errors
/// [`Broken::Panic`], or [`Broken::Time`].
pub fn bounded<T: Send + 'static>(
    time: Duration,
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<T, Broken> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().stack_size(STACK_BYTES);
    let run = move || {
        // Nobody listens any more where the time was over.
        let _ = sender.send(caught(work));
    };
    thread.spawn(run).map_err(|_| Broken::Panic)?;
    receiver.recv_timeout(time).map_err(|_| Broken::Time)?
}

/// Where code of others runs, which may panic or never end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Guard {
    /// On the thread of the caller, without a clock, as [`caught`] does: where there are no threads,
    /// as in a browser. Endless work is not noticed, nor is there a deeper stack.
    #[default]
    Here,
    /// On a thread of its own, and only for so long, as [`bounded`] does.
    Timed,
}

impl Guard {
    /// Runs code of others, for at most `time` where there is a clock.
    ///
    /// # Errors
    /// [`Broken::Panic`], or [`Broken::Time`].
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

    /// When a time that begins now is over; never where there is no clock.
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
    fn panics_and_endless_work_are_errors() {
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
