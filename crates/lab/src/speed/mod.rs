//! Run times of what users wait for, measured on one thread: `deltille bench all`.
//!
//! Input: nothing but a seed; all images and corners are simulated. Output: rows of a table.
//!
//! 1. `images`: photographs with and without boards, patterns, and frames of a video;
//! 2. `seeing`: detection in them;
//! 3. `making`: files of a target, made and verified;
//! 4. `solving`: calibrations.

mod images;
mod making;
mod seeing;
mod solving;

use std::sync::LazyLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

use deltille::clock;
use deltille_core::statistics::{median, quantile};

/// Number of runs. The fastest counts: it is the one least slowed down by other processes.
const RUNS: usize = 3;

/// Reason why a run time cannot be measured.
#[derive(Debug, thiserror::Error)]
pub enum SpeedError {
    /// A target cannot be made or photographed.
    #[error(transparent)]
    Photograph(#[from] crate::photographs::PhotographError),
    /// A target cannot be built.
    #[error(transparent)]
    Target(#[from] deltille::targets::TargetError),
    /// A file cannot be made.
    #[error(transparent)]
    Make(#[from] deltille::export::artifacts::MakeError),
    /// A file cannot be verified.
    #[error(transparent)]
    Verify(#[from] deltille::verify::VerifyError),
    /// The result of a run is wrong, so its time means nothing.
    #[error("{0}")]
    Wrong(String),
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What was measured.
    pub what: String,
    /// Number of measurements, such as images.
    pub count: usize,
    /// Median, ms.
    pub median_ms: f64,
    /// Longest, ms.
    pub worst_ms: f64,
    /// What was found or made, in words.
    pub result: String,
}

impl Row {
    fn new(what: impl Into<String>, ms: &[f64], result: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            count: ms.len(),
            median_ms: median(ms.to_vec()).unwrap_or(0.0),
            worst_ms: quantile(&mut ms.to_vec(), 1.0).unwrap_or(0.0),
            result: result.into(),
        }
    }
}

/// A group of rows that are measured together.
pub type Group = fn(seed: u64) -> Result<Vec<Row>, SpeedError>;

/// All groups, in the order of the table.
pub const GROUPS: [Group; 5] =
    [seeing::boards, seeing::video, seeing::absent, making::files, solving::cameras];

/// Groups that take minutes and gigabytes.
pub const LARGE: [Group; 1] = [solving::large];

/// The thread on which everything is timed.
static THREAD: LazyLock<ThreadPool> = LazyLock::new(|| {
    ThreadPoolBuilder::new().num_threads(1).build().expect("a thread can be started")
});

/// Returns the fastest of several runs, ms, and the last result.
fn fastest<T: Send>(runs: usize, mut run: impl FnMut() -> T + Send) -> (f64, T) {
    let (mut best, mut result) = timed(&mut run);
    for _ in 1..runs {
        let (ms, again) = timed(&mut run);
        (best, result) = (best.min(ms), again);
    }
    (best, result)
}

/// Returns the time of a run, ms, and its result.
fn timed<T: Send>(run: impl FnOnce() -> T + Send) -> (f64, T) {
    THREAD.install(|| {
        let start = clock::now();
        let result = run();
        ((clock::now() - start).as_secs_f64() * 1e3, result)
    })
}
