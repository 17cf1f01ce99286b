//! Progress on standard error: bars on a terminal; otherwise, occasional lines for long searches.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::output::log;
use crate::terminal;
use deltille::family::Progress;
use deltille_core::words::counted;

/// Update interval of the elapsed time and of the spinner.
const TICK: Duration = Duration::from_millis(200);

/// Creates a bar with position and remaining time, for `total` units of work called `unit`; silent if standard error
/// is not a terminal.
pub fn bar(total: u64, unit: &str) -> ProgressBar {
    let position = if unit.is_empty() { String::new() } else { format!("{{human_pos}} {unit}  ") };
    let template = format!(
        "{{spinner}} {{elapsed_precise}} {{wide_bar}} {{percent:>3}} %  {position}{{eta_precise}} left  {{msg}}"
    );
    let style = ProgressStyle::with_template(&template).expect("the template is well formed");
    shown(ProgressBar::new(total).with_style(style))
}

/// A spinner with the elapsed time on a terminal, for work of unknown length; removed when it is dropped.
pub struct Spinner(ProgressBar);

impl Spinner {
    /// Creates a spinner beside a description of the work.
    pub fn new(work: &'static str) -> Self {
        let style = ProgressStyle::with_template("{spinner} {elapsed_precise}  {msg}");
        let spinner =
            ProgressBar::new_spinner().with_style(style.expect("the template is well formed"));
        Self(shown(spinner.with_message(work)))
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Returns a bar that is updated regularly, or hidden with `--quiet`.
fn shown(bar: ProgressBar) -> ProgressBar {
    if terminal::is_quiet() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    } else {
        bar.enable_steady_tick(TICK);
    }
    bar
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

/// Progress over frames: a line on a terminal, otherwise one every ten seconds.
pub struct FrameProgress {
    bar: ProgressBar,
    /// Number of frames, if known.
    total: Option<usize>,
    frames: usize,
    /// Number of frames that show a target.
    seen: usize,
    start: Instant,
    /// Time of the last line; `None` on a terminal.
    last: Option<Instant>,
}

impl FrameProgress {
    /// Creates a progress display for this number of frames, if it is known.
    pub fn new(total: Option<usize>) -> Self {
        let style = ProgressStyle::with_template("{elapsed_precise}  {msg}");
        let bar =
            ProgressBar::new_spinner().with_style(style.expect("the template is well formed"));
        if terminal::is_quiet() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let start = Instant::now();
        let last = (!std::io::stderr().is_terminal()).then_some(start);
        Self { bar, total, frames: 0, seen: 0, start, last }
    }

    /// Counts a frame. `part` is the fraction of the recording up to it, if known.
    pub fn add(&mut self, is_seen: bool, part: Option<f64>) {
        self.frames += 1;
        self.seen += usize::from(is_seen);
        let part = part.or(self.total.map(|total| self.frames as f64 / total.max(1) as f64));
        if let Some(last) = &mut self.last {
            if last.elapsed() < SearchProgress::EVERY {
                return;
            }
            *last = Instant::now();
            if !terminal::is_quiet() {
                log!("{}", self.line(part));
            }
        } else {
            self.bar.set_message(self.line(part));
        }
    }

    /// Describes the progress.
    fn line(&self, part: Option<f64>) -> String {
        let elapsed = self.start.elapsed().as_secs_f64();
        let left = part.filter(|part| *part > 0.0).map(|part| elapsed * (1.0 - part) / part);
        let left = left.map(|left| format!(", about {left:.0} s left")).unwrap_or_default();
        let frames = counted(self.frames, "frame");
        let rate = self.frames as f64 / elapsed.max(1e-3);
        format!("{frames}, {} with the target, {rate:.1} frames/s{left}", self.seen)
    }

    /// Removes the line, and reports the number of frames.
    pub fn end(self) {
        self.bar.finish_and_clear();
        if self.frames > 0 && !terminal::is_quiet() {
            log!("{}", self.line(None));
        }
    }
}
