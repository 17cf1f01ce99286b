//! Progress on standard error: bars on a terminal, and of long searches a line now and then elsewhere.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::output::tell;
use deltille::family::Progress;
use deltille_core::words::counted;

/// A bar with position and estimate, for `total` units of work called `unit`; silent where standard
/// error is not a terminal.
pub fn bar(total: u64, unit: &str) -> ProgressBar {
    let position = if unit.is_empty() { String::new() } else { format!("{{human_pos}} {unit}  ") };
    let template = format!(
        "{{elapsed_precise}} {{wide_bar}} {{percent:>3}} %  {position}{{eta_precise}} left  {{msg}}"
    );
    let style = ProgressStyle::with_template(&template).expect("the template is well formed");
    ProgressBar::new(total).with_style(style)
}

/// A search for codes: a bar on a terminal, and a line every ten seconds elsewhere.
pub struct SearchProgress {
    bar: ProgressBar,
    /// The most codes of any attempt so far: the next one begins with few.
    codes: AtomicUsize,
    /// When the last line was written; `None` on a terminal.
    last: Option<Mutex<Instant>>,
}

impl SearchProgress {
    /// How often a line is written.
    const EVERY: Duration = Duration::from_secs(10);

    /// Of `total` units of work called `unit`.
    pub fn new(total: u64, unit: &str) -> Self {
        let is_terminal = std::io::stderr().is_terminal();
        let last = (!is_terminal).then(|| Mutex::new(Instant::now()));
        Self { bar: bar(total, unit), codes: AtomicUsize::new(0), last }
    }

    /// Shows how far the search has come.
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
            tell!("{} %, {codes}", 100 * done / total.max(1));
        }
    }

    /// Takes the bar away.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
