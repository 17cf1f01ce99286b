//! Long work that Ctrl-C ends.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use deltille::limits;
use pyo3::prelude::*;

use super::errors::Fault;

/// How often signals are looked for.
const EVERY: Duration = Duration::from_millis(50);

/// How long work may take to come to its end after Ctrl-C; then it is left, and ends by itself.
const PATIENCE: Duration = Duration::from_secs(2);

/// Does work on a thread of its own, without the interpreter's lock, and looks for signals meanwhile. The work is told
/// by the flag that it is to end.
///
/// # Errors
/// What a signal's handler raises, such as `KeyboardInterrupt`, and where the work panics.
pub fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Arc<AtomicBool>) -> T + Send + 'static,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (sender, mut receiver) = mpsc::sync_channel(1);
    let flag = stop.clone();
    // The receiver is gone where the work was left.
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
