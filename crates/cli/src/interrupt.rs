//! Ctrl-C, and being told to end: a flag that long work looks at, and a way out for work that does not.

use std::borrow::Cow;
use std::io::Write;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use crate::output::tell;
use deltille::export::atomic;
use deltille_core::words::shown;

/// How long work may take to come to its own end after the signal; then it is left as it stands.
const PATIENCE: Duration = Duration::from_millis(300);

/// Exit codes of programs that a signal ends, as a shell has them: 128 and the signal's number.
const SIGNALLED: u8 = 128;
#[cfg(unix)]
const HANGUP: u8 = 1;
const INTERRUPT: u8 = 2;

static FLAG: AtomicBool = AtomicBool::new(false);
static SIGNAL: AtomicU8 = AtomicU8::new(INTERRUPT);
static KEEPS: AtomicBool = AtomicBool::new(false);
static STANDING: Mutex<Cow<'static, str>> = Mutex::new(Cow::Borrowed("the work was not finished"));

/// The flag that becomes true with the first signal.
pub fn flag() -> &'static AtomicBool {
    &FLAG
}

/// Whether a signal has come.
pub fn is_raised() -> bool {
    FLAG.load(Ordering::Relaxed)
}

/// The exit code after the signal that came.
pub fn exit_code() -> u8 {
    SIGNALLED + SIGNAL.load(Ordering::Relaxed)
}

/// From here on the work looks at the flag often and has something to keep: only a second signal
/// makes it leave that.
pub fn keeps_results() {
    KEEPS.store(true, Ordering::Relaxed);
}

/// What is to be said where the work is left from here on.
pub fn stands(how: impl Into<Cow<'static, str>>) {
    *STANDING.lock().unwrap_or_else(PoisonError::into_inner) = how.into();
}

/// Ends the process: what it is writing is removed, and one line says how things stand.
pub fn leave(how: Option<&str>) -> ! {
    // Whoever comes second waits here for the end.
    let _nothing_more = atomic::abandon();
    let standing = STANDING.lock().unwrap_or_else(PoisonError::into_inner);
    let how = shown(how.unwrap_or(&standing)).into_owned();
    // The terminal may be what has gone away.
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
        tell!("what was found is being written; a second signal leaves it");
    });
}

/// Begins to listen. Where that fails a signal ends the process at once, and the next run tidies up.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut wanted = vec![SIGINT, SIGTERM];
    wanted.extend((!ignores(HANGUP)).then_some(SIGHUP));
    if let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) {
        std::thread::spawn(move || signals.forever().for_each(|signal| raise(signal as u8)));
    }
}

/// Whether the process was started with a signal ignored, as `nohup` does. Where the system does not
/// tell, it is left alone.
#[cfg(unix)]
fn ignores(signal: u8) -> bool {
    let Ok(status) = std::fs::read_to_string("/proc/self/status") else { return true };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Begins to listen.
#[cfg(not(unix))]
pub fn listen() {
    let _ = ctrlc::set_handler(|| raise(INTERRUPT));
}
