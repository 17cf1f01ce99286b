//! Long searches in legs: each is a separate search that starts from the best result so far, with its own random
//! numbers.
//!
//! Between two legs, a search can be interrupted and resumed from a [`Checkpoint`] later. A step of work is a leg, so
//! a search by work gives the same result with and without a break. For a budget of time, a leg is a tenth of it, but
//! at least a minute.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::budget::Budget;
use super::request::{Best, Start};
use deltille_core::family::{Construction, Control, Family, FamilyError, Progress};

/// Result of the legs of a search so far, from which it can be resumed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Checkpoint {
    /// Number of completed legs.
    pub legs_done: u32,
    /// Seconds searched, for a budget of time.
    pub seconds: f64,
    /// The best codes so far.
    pub codes: Vec<u64>,
    /// Construction of these codes.
    pub construction: Option<Construction>,
}

/// Shortest leg of a search by time.
const SHORTEST: Duration = Duration::from_secs(60);

impl Best {
    /// Searches and makes a family of the result, at least as large as the one it starts from. Reports progress in
    /// thousandths. Cancelling ends the search with the best family so far; it fails only if nothing was found yet.
    ///
    /// # Errors
    /// Returns an error if the rules are invalid, or the search was cancelled before anything was found.
    pub fn family(
        &self,
        name: &str,
        start: Option<Start>,
        control: Control,
    ) -> Result<Family, FamilyError> {
        self.resume(name, start, &mut Checkpoint::default(), &|_| (), control)
    }

    /// Like [`Self::family`], but resumes from a checkpoint and calls `save` after each leg. After
    /// cancelling, the checkpoint contains the completed legs. In a search by time, it also
    /// contains the result of the interrupted one.
    ///
    /// # Errors
    /// Like [`Self::family`], and returns an error if the checkpoint is inconsistent.
    pub fn resume(
        &self,
        name: &str,
        start: Option<Start>,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint),
        control: Control,
    ) -> Result<Family, FamilyError> {
        self.rules.check(self.dimension.bits())?;
        let screen = self.screen();
        if let Some(Construction::Algebraic(construction)) = &checkpoint.construction {
            // The codes are listed again, because those in the file may be wrong.
            checkpoint.codes = construction.codes(&screen)?;
        } else if checkpoint.construction.is_none()
            && let Some(start) = &start
        {
            checkpoint.codes = start.codes.clone();
            checkpoint.construction = Some(Construction::Algebraic(start.construction.clone()));
        }
        while let Some((budget, share)) = self.next_leg(checkpoint) {
            let seed = self.seed.wrapping_add(u64::from(checkpoint.legs_done) << 32);
            let leg = Self { budget, seed, ..self.clone() };
            let begin = match &checkpoint.construction {
                Some(Construction::Algebraic(construction)) => Some(Start {
                    family: name.to_owned(),
                    codes: checkpoint.codes.clone(),
                    construction: construction.clone(),
                }),
                _ => None,
            };
            let (known, before) = (checkpoint.codes.len(), self.done(checkpoint));
            let report = |progress: Progress| {
                let done = before + share * progress.done as f64 / progress.total as f64;
                let codes =
                    progress.codes.max(known).min(self.limit.map_or(usize::MAX, |n| n as usize));
                control.tell((1000.0 * done.min(1.0)) as u64, 1000, codes);
            };
            let since = budget.now();
            let found = leg.leg(&screen, begin.as_ref(), control.report(&report));
            let found = match found {
                Err(FamilyError::Cancelled) if known > 0 => None,
                found => Some(found?),
            };
            let better = found.filter(|(codes, _)| codes.len() > known);
            if control.is_cancelled() && matches!(self.budget, Budget::Work(_)) {
                // The progress of an interrupted leg depends on its timing.
                return match better {
                    Some((codes, construction)) => self.made(name, codes, construction),
                    None => self.best_of(name, checkpoint),
                };
            }
            checkpoint.legs_done += 1;
            checkpoint.seconds += (budget.now() - since).as_secs_f64();
            if let Some((codes, construction)) = better {
                (checkpoint.codes, checkpoint.construction) = (codes, Some(construction));
            }
            save(checkpoint);
            if control.is_cancelled() || checkpoint.codes.len() >= self.most() {
                break;
            }
        }
        self.best_of(name, checkpoint)
    }

    /// Returns the budget of the next leg and its fraction of the whole; `None` at the end.
    fn next_leg(&self, checkpoint: &Checkpoint) -> Option<(Budget, f64)> {
        match self.budget {
            Budget::Time(time, clock) => {
                let left =
                    time.saturating_sub(Duration::try_from_secs_f64(checkpoint.seconds).ok()?);
                // A leg too short to find anything is not worth exceeding the budget.
                let over = checkpoint.legs_done > 0 && left < time.mul_f64(0.02).max(SHORTEST / 60);
                let leg = SHORTEST.max(time / 10);
                let leg = if left < leg.mul_f64(1.5) { left } else { leg };
                let share = leg.as_secs_f64() / time.as_secs_f64().max(1e-3);
                (!over).then_some((Budget::Time(leg, clock), share))
            }
            Budget::Work(steps) => {
                let steps = steps.max(1);
                (checkpoint.legs_done < steps).then(|| (Budget::Work(1), 1.0 / f64::from(steps)))
            }
        }
    }

    /// Returns the fraction of the budget that is spent.
    fn done(&self, checkpoint: &Checkpoint) -> f64 {
        match self.budget {
            Budget::Time(time, _) => checkpoint.seconds / time.as_secs_f64().max(1e-3),
            Budget::Work(steps) => f64::from(checkpoint.legs_done) / f64::from(steps.max(1)),
        }
    }

    fn best_of(&self, name: &str, checkpoint: &Checkpoint) -> Result<Family, FamilyError> {
        match &checkpoint.construction {
            Some(construction) => self.made(name, checkpoint.codes.clone(), construction.clone()),
            None => Err(FamilyError::Cancelled),
        }
    }

    fn made(
        &self,
        name: &str,
        codes: Vec<u64>,
        construction: Construction,
    ) -> Result<Family, FamilyError> {
        Family::new(name, self.dimension, self.distance, codes, self.rules.clone(), construction)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use deltille_core::lattice::Dimension;

    #[test]
    fn interrupted_searches_by_work_find_the_same() {
        let search = Best::new(Dimension::from_bits(9).unwrap(), 4, Budget::Work(3)).seed(5);
        let whole = search.family("d9h4", None, Control::default()).unwrap();

        let mut checkpoint = Checkpoint::default();
        for piece in 1..=3 {
            let cancel = AtomicBool::new(false);
            let control = Control::default().cancel(&cancel);
            let stop = |_: &Checkpoint| cancel.store(piece < 3, Ordering::Relaxed);
            search.resume("d9h4", None, &mut checkpoint, &stop, control).unwrap();
            assert_eq!(checkpoint.legs_done, piece);
            // As read from a file.
            let text = serde_json::to_string(&checkpoint).unwrap();
            checkpoint = serde_json::from_str(&text).unwrap();
        }
        let family = search.resume("d9h4", None, &mut checkpoint, &|_| (), Control::default());
        assert_eq!(family.unwrap(), whole);
    }

    #[test]
    fn completed_legs_count() {
        let clock: deltille_core::Clock = || Duration::ZERO;
        let time = Budget::Time(Duration::from_secs(600), clock);
        let search = Best::new(Dimension::from_bits(9).unwrap(), 4, time);
        let left = |legs_done, seconds| {
            let checkpoint = Checkpoint { legs_done, seconds, ..Checkpoint::default() };
            search.next_leg(&checkpoint).map(|(budget, _)| match budget {
                Budget::Time(time, _) => time.as_secs(),
                Budget::Work(_) => panic!("a leg of a budget of time has a time"),
            })
        };
        assert_eq!(left(0, 0.0), Some(60));
        assert_eq!(left(9, 530.0), Some(70));
        assert_eq!(left(10, 599.0), None);
        assert_eq!(left(1, f64::NAN), None);
    }
}
