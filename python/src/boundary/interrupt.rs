//! Runs long work that Ctrl-C can interrupt.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use deltille::limits;
use pyo3::prelude::*;

use super::errors::Fault;

/// Interval between checks for signals.
const EVERY: Duration = Duration::from_millis(50);

/// Time for work to stop after Ctrl-C. After that it is abandoned, and ends on its own.
const PATIENCE: Duration = Duration::from_secs(2);

/// Runs work on a separate thread, without the interpreter's lock, and checks for signals in the
/// meantime. The flag asks the work to stop.
///
/// # Errors
/// Returns the exception of a signal handler, such as `KeyboardInterrupt`, or an exception if the work panics.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Arc<AtomicBool>) -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = mpsc::sync_channel(1);
    let flag = stop.clone();
    // Sending fails if the work was abandoned and the receiver is gone.
    let run = move || drop(sender.send(limits::caught(|| work(&flag))));
    thread::Builder::new().name("deltille".to_owned()).spawn(run)?;
    loop {
        let waiting = &mut receiver;
        match py.detach(move || waiting.recv_timeout(EVERY)) {
            Ok(done) => return done.map_err(|broken| Fault::from(broken).into()),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Fault::from(limits::Broken::Panic).into());
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(raised) = py.check_signals() {
            stop.store(true, Ordering::Relaxed);
            let waiting = &mut receiver;
            let _ = py.detach(move || waiting.recv_timeout(PATIENCE));
            return Err(raised);
        }
    }
}
