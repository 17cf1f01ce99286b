//! Ctrl-C and termination signals: a flag that long-running work checks, and a forced exit from
//! work that does not check it.

use std::borrow::Cow;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::output::log;
use deltille::export::atomic;
use deltille_core::words::shown;

/// Time that work has to end on its own after a signal, before the process exits.
const PATIENCE: Duration = Duration::from_millis(300);

/// Offset of the exit code of a process ended by a signal, as in shells: 128 plus the signal number.
const SIGNALLED: u8 = 128;
#[cfg(unix)]
const HANGUP: u8 = 1;
const INTERRUPT: u8 = 2;

static FLAG: AtomicBool = AtomicBool::new(false);
static SIGNAL: AtomicU8 = AtomicU8::new(INTERRUPT);
static KEEPS: AtomicBool = AtomicBool::new(false);
static FINISHES: AtomicBool = AtomicBool::new(false);
static STATUS: Mutex<Cow<'static, str>> = Mutex::new(Cow::Borrowed("the work was not finished"));

/// Returns the flag that becomes true with the first signal.
pub fn flag() -> &'static AtomicBool {
    &FLAG
}

/// Whether a signal has arrived that ends the work.
pub fn is_raised() -> bool {
    FLAG.load(Ordering::Relaxed) && !FINISHES.load(Ordering::Relaxed)
}

/// Whether a signal has ended the input, see [`end_input`].
pub fn has_ended_input() -> bool {
    FLAG.load(Ordering::Relaxed) && FINISHES.load(Ordering::Relaxed)
}

/// Returns the exit code for the signal that arrived.
pub fn exit_code() -> u8 {
    SIGNALLED + SIGNAL.load(Ordering::Relaxed)
}

/// Declares that from now on the work checks the flag often and has results to keep, so that only a second signal
/// aborts it.
pub fn keeps_results() {
    KEEPS.store(true, Ordering::Relaxed);
}

/// Declares the end of the input. If a signal has arrived, the work continues with the input so far, and a second signal aborts
/// it; otherwise the first one does.
pub fn end_input() {
    if is_raised() {
        FINISHES.store(true, Ordering::Relaxed);
    } else {
        KEEPS.store(false, Ordering::Relaxed);
    }
}

/// Sets the status that is printed if the work is aborted from now on.
pub fn set_status(status: impl Into<Cow<'static, str>>) {
    *STATUS.lock().unwrap_or_else(PoisonError::into_inner) = status.into();
}

/// Ends the process: removes partially written files, and prints the status on one line.
pub fn leave(how: Option<&str>) -> ! {
    // A second caller waits here until the process ends.
    let _nothing_more = atomic::abandon();
    let status = STATUS.lock().unwrap_or_else(PoisonError::into_inner);
    let how = shown(how.unwrap_or(&status)).into_owned();
    // The terminal may be gone.
    let _ = writeln!(std::io::stderr(), "interrupted: {how}");
    std::process::exit(exit_code().into())
}

fn raise(signal: u8) {
    SIGNAL.store(signal, Ordering::Relaxed);
    if FLAG.swap(true, Ordering::Relaxed) {
        leave(None);
    }
    std::thread::spawn(|| {
        std::thread::sleep(PATIENCE);
        if !KEEPS.load(Ordering::Relaxed) {
            leave(None);
        }
        std::thread::sleep(6 * PATIENCE);
        log!("writing the results; a second signal aborts");
    });
}

/// Starts to listen for signals. If this fails, a signal ends the process immediately, and the next run cleans up.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut wanted = vec![SIGINT, SIGTERM];
    wanted.extend((!ignores(HANGUP)).then_some(SIGHUP));
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) {
        std::thread::spawn(move || signals.forever().for_each(|signal| raise(signal as u8)));
    }
}

/// Whether the process was started with a signal ignored, as by `nohup`. If the system does not report it, the signal
/// counts as ignored.
#[cfg(unix)]
fn ignores(signal: u8) -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return true };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Starts to listen for signals.
#[cfg(not(unix))]
pub fn listen() {
    let _ = ctrlc::set_handler(|| raise(INTERRUPT));
}
