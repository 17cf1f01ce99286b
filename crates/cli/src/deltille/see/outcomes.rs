//! Outcomes of the images of `deltille detect`, printed in their order.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Mutex;

use crate::interrupt;
use crate::output::{self, log};
use crate::run::{self, BAD_INPUT, FAILED};
use deltille::detect::InkEstimate;
use deltille::export::tables::ImageRecord;
use deltille_core::words::counted;

/// Outcome of an image.
pub enum Outcome {
    Seen(Box<Found>),
    Skipped,
}

/// Detections in an image.
pub struct Found {
    /// The line to print.
    pub line: String,
    /// The ink spread estimated from the image.
    pub ink: Option<InkEstimate>,
    /// Whether the requested target or grid was found.
    pub is_there: bool,
    /// The table row, if tables are written.
    pub row: Option<ImageRecord>,
}

/// Returns the table row of an image, if it has one.
pub fn row_of(name: Option<String>, result: &mut anyhow::Result<Outcome>) -> Option<ImageRecord> {
    match result {
        Ok(Outcome::Seen(found)) => found.row.take(),
        Ok(Outcome::Skipped) => None,
        Err(error) => Some(ImageRecord::unread(name?, run::message(error))),
    }
}

/// Prints the results of the images in order, as soon as they are available.
pub struct Report {
    /// Whether images that show the target are not reported.
    is_silent: bool,
    /// With a single image, its error is the error of the command.
    single: bool,
    /// How to resume after an interruption.
    go_on: &'static str,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    next: usize,
    waiting: BTreeMap<usize, anyhow::Result<Outcome>>,
    failed: usize,
    skipped: usize,
    found: usize,
    error: Option<anyhow::Error>,
}

impl Report {
    pub fn new(single: bool, is_silent: bool, go_on: &'static str) -> Self {
        let report = Self { single, is_silent, go_on, state: Mutex::default() };
        interrupt::set_status(report.status());
        report
    }

    /// Describes the progress so far.
    pub fn status(&self) -> String {
        format!("{} done{}", counted(self.done(), "image"), self.go_on)
    }

    pub fn add(&self, index: usize, result: anyhow::Result<Outcome>) {
        self.print(index, result);
        interrupt::set_status(self.status());
    }

    fn print(&self, index: usize, result: anyhow::Result<Outcome>) {
        let mut state = self.state.lock().expect("no thread panics here");
        state.waiting.insert(index, result);
        loop {
            let next = state.next;
            let Some(result) = state.waiting.remove(&next) else { return };
            state.next += 1;
            match result {
                Ok(Outcome::Skipped) => state.skipped += 1,
                Ok(Outcome::Seen(found)) => {
                    state.found += usize::from(found.is_there);
                    // Output that cannot be printed is lost, as with `println`.
                    if self.is_silent && found.is_there {
                        continue;
                    }
                    if let Err(error) = output::print(&found.line) {
                        state.error.get_or_insert(error);
                    }
                }
                Err(error) => {
                    state.failed += 1;
                    if self.single {
                        state.error = Some(error);
                    } else {
                        run::report(&error);
                    }
                }
            }
        }
    }

    /// Counts an image that failed in the second pass.
    pub fn fail_again(&self, error: &anyhow::Error) {
        run::report(error);
        self.state.lock().expect("no thread panics here").failed += 1;
    }

    fn done(&self) -> usize {
        let state = self.state.lock().expect("no thread panics here");
        state.next + state.waiting.len()
    }

    pub fn end(self) -> anyhow::Result<ExitCode> {
        let State { next: all, failed, skipped, found, error, .. } =
            self.state.into_inner().expect("no thread panics here");
        if let Some(error) = error {
            return Err(error);
        }
        if skipped > 0 {
            log!(
                "{skipped} of {} skipped, because they already have results",
                counted(all, "image")
            );
        }
        if failed == 0 {
            let nothing = found == 0 && skipped == 0;
            return Ok(if nothing { ExitCode::from(FAILED) } else { ExitCode::SUCCESS });
        }
        if all > 1 {
            log!("error: {failed} of {all} images failed");
        }
        Ok(ExitCode::from(if failed == all { BAD_INPUT } else { FAILED }))
    }
}
