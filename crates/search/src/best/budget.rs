//! Budget and progress of a search.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use deltille_core::Clock;

/// Budget of a search.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Budget {
    /// Time by a clock; the result depends on the machine.
    Time(Duration, Clock),
    /// Number of steps. Each step draws four batches of codes, arranges the best once more, and exchanges codes in
    /// one round of local search. The result depends on the seed alone.
    Work(u32),
}

impl Budget {
    /// Returns the time of the clock; zero for a budget of work.
    pub(super) fn now(self) -> Duration {
        match self {
            Budget::Time(_, clock) => clock(),
            Budget::Work(_) => Duration::ZERO,
        }
    }
}

/// Progress of a search.
pub(super) struct Spent {
    /// Start time of the search, by the clock of its budget; zero for a budget of work.
    start: Duration,
    budget: Budget,
    /// Fraction of the budget that is spent before the first fraction is requested.
    first: f64,
    /// Steps completed by a search by work, and their total.
    done: AtomicU64,
    total: u64,
}

impl Spent {
    pub(super) fn new(budget: Budget, first: f64) -> Self {
        // Drawing, arranging, joint search with exchange, and exchange of the codes on record.
        let parts = if first > 0.0 { 5 } else { 4 };
        let total = match budget {
            Budget::Time(..) => 1,
            Budget::Work(steps) => parts * u64::from(steps.max(1)),
        };
        Self { start: budget.now(), budget, first, done: AtomicU64::new(0), total }
    }

    /// Returns the time when the given fraction of the rest of the budget is spent, after the
    /// fraction `first`; `None` for a budget of work.
    pub(super) fn until(&self, share: f64) -> Option<End> {
        match self.budget {
            Budget::Time(time, clock) => {
                let at = self.start + time.mul_f64(self.first + (1.0 - self.first) * share);
                Some(End { clock, at })
            }
            Budget::Work(_) => None,
        }
    }

    /// Returns the number of rounds of a phase: the steps of a budget of work, or `most` for a
    /// budget of time.
    pub(super) fn rounds(&self, most: u64) -> u64 {
        match self.budget {
            Budget::Time(..) => most,
            Budget::Work(steps) => u64::from(steps.max(1)),
        }
    }

    pub(super) fn step(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn thousandths(&self) -> u64 {
        let share = match self.budget {
            Budget::Time(time, clock) => {
                clock().saturating_sub(self.start).as_secs_f64() / time.as_secs_f64().max(1e-3)
            }
            Budget::Work(_) => self.done.load(Ordering::Relaxed) as f64 / self.total as f64,
        };
        (1000.0 * share.min(1.0)) as u64
    }
}

/// End time of a phase.
#[derive(Clone, Copy)]
pub(super) struct End {
    clock: Clock,
    at: Duration,
}

impl End {
    /// Returns an end that leaves the given fraction of the remaining time.
    pub(super) fn after(self, share: f64) -> Self {
        let now = (self.clock)();
        Self { at: now + self.at.saturating_sub(now).mul_f64(share), ..self }
    }
}

/// Returns whether an end has passed; false if there is none.
pub(super) fn is_past(end: Option<End>) -> bool {
    end.is_some_and(|end| (end.clock)() >= end.at)
}
