use std::sync::atomic::{AtomicBool, Ordering};

use crate::family::FamilyError;

/// Progress of a long search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Units of work done.
    pub done: u64,
    /// Total units of work.
    pub total: u64,
    /// Number of codes found so far.
    pub codes: usize,
}

/// Callbacks to watch and stop a long search; the library itself prints nothing.
#[derive(Clone, Copy, Default)]
#[non_exhaustive]
pub struct Control<'a> {
    /// Stops the search soon after it becomes true.
    pub cancel: Option<&'a AtomicBool>,
    /// Called from time to time, from one thread at a time.
    pub report: Option<&'a (dyn Fn(Progress) + Sync)>,
}

impl<'a> Control<'a> {
    /// Sets a flag that stops the search soon after it becomes true.
    #[must_use]
    pub fn cancel(self, cancel: &'a AtomicBool) -> Self {
        Self { cancel: Some(cancel), ..self }
    }

    /// Sets a function that is called from time to time, from one thread at a time.
    #[must_use]
    pub fn report(self, report: &'a (dyn Fn(Progress) + Sync)) -> Self {
        Self { report: Some(report), ..self }
    }

    /// Returns whether the search was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }

    /// Checks that the search may continue.
    ///
    /// # Errors
    /// Returns an error if it was cancelled.
    #[doc(hidden)]
    pub fn check(&self) -> Result<(), FamilyError> {
        if self.is_cancelled() { Err(FamilyError::Cancelled) } else { Ok(()) }
    }

    /// Reports progress.
    #[doc(hidden)]
    pub fn tell(&self, done: u64, total: u64, codes: usize) {
        if let Some(report) = self.report {
            report(Progress { done, total, codes });
        }
    }
}
