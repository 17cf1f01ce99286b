//! How long a search goes on, and how far it has come.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use deltille_core::Clock;

/// How long a search goes on.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum Budget {
    /// So long by a clock; how much is found depends on the machine.
    Time(Duration, Clock),
    /// So many steps: in each four batches of codes are drawn, the best are arranged once more, and codes are
    /// exchanged in one round of local search. What is found depends on the seed alone.
    Work(u32),
}

impl Budget {
    /// What the clock says; zero where work is counted.
    pub(super) fn now(self) -> Duration {
        match self {
            Budget::Time(_, clock) => clock(),
            Budget::Work(_) => Duration::ZERO,
        }
    }
}

/// How far a search has come.
pub(super) struct Spent {
    /// When the search began, by the clock of its budget; zero where work is counted.
    start: Duration,
    budget: Budget,
    /// Share of the budget that is spent before the first share is asked for.
    first: f64,
    /// Steps done of a search by work, and in all.
    done: AtomicU64,
    total: u64,
}

impl Spent {
    pub(super) fn new(budget: Budget, first: f64) -> Self {
        // Drawing, arranging, both at once and exchanging, and exchanging what is on record.
        let parts = if first > 0.0 { 5 } else { 4 };
        let total = match budget {
            Budget::Time(..) => 1,
            Budget::Work(steps) => parts * u64::from(steps.max(1)),
        };
        Self { start: budget.now(), budget, first, done: AtomicU64::new(0), total }
    }

    /// When a share of what follows the first share is spent; `None` where work is counted.
    pub(super) fn until(&self, share: f64) -> Option<End> {
        match self.budget {
            Budget::Time(time, clock) => {
                let at = self.start + time.mul_f64(self.first + (1.0 - self.first) * share);
                Some(End { clock, at })
            }
            Budget::Work(_) => None,
        }
    }

    /// Rounds of a kind: as many as are worked, or as the time gives.
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

/// When something ends.
#[derive(Clone, Copy)]
pub(super) struct End {
    clock: Clock,
    at: Duration,
}

impl End {
    /// An end that leaves so much of what is left.
    pub(super) fn after(self, share: f64) -> Self {
        let now = (self.clock)();
        Self { at: now + self.at.saturating_sub(now).mul_f64(share), ..self }
    }
}

/// Whether an end has come; without one it never does.
pub(super) fn is_past(end: Option<End>) -> bool {
    end.is_some_and(|end| (end.clock)() >= end.at)
}
