//! Progress on standard error: bars on a terminal; otherwise, occasional lines for long searches.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::output::log;
use deltille::family::Progress;
use deltille_core::words::counted;

/// Creates a bar with position and remaining time, for `total` units of work called `unit`; silent if standard error
/// is not a terminal.
pub fn bar(total: u64, unit: &str) -> ProgressBar {
    let position = if unit.is_empty() { String::new() } else { format!("{{human_pos}} {unit}  ") };
    let template = format!(
        "{{elapsed_precise}} {{wide_bar}} {{percent:>3}} %  {position}{{eta_precise}} left  {{msg}}"
    );
    let style = ProgressStyle::with_template(&template).expect("the template is well formed");
    ProgressBar::new(total).with_style(style)
}

/// Progress of a code search: a bar on a terminal, otherwise a line every ten seconds.
pub struct SearchProgress {
    bar: ProgressBar,
    /// Largest number of codes of any attempt so far; each attempt starts with few.
    codes: AtomicUsize,
    /// Time of the last line; `None` on a terminal.
    last: Option<Mutex<Instant>>,
}

impl SearchProgress {
    /// Interval between lines.
    const EVERY: Duration = Duration::from_secs(10);

    /// Creates a progress display for `total` units of work called `unit`.
    pub fn new(total: u64, unit: &str) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        let last = (!is_terminal).then(|| Mutex::new(Instant::now()));
        Self { bar: bar(total, unit), codes: AtomicUsize::new(0), last }
    }

    /// Shows the progress of the search.
    pub fn show(&self, progress: Progress) {
        let Progress { done, total, codes, .. } = progress;
        let before = self.codes.fetch_max(codes, Ordering::Relaxed);
        let codes = counted(codes.max(before), "code");
        let Some(last) = &self.last else {
            self.bar.set_position(done);
            self.bar.set_message(codes);
            return;
        };
        let mut last = last.lock().expect("no thread panics here");
        if last.elapsed() >= Self::EVERY {
            *last = Instant::now();
            log!("{} %, {codes}", 100 * done / total.max(1));
        }
    }

    /// Removes the bar.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
