//! Local search without initial codes, for the small families. The same seed and rounds give the same codes, even if
//! the search was interrupted and resumed from a [`Checkpoint`].
//!
//! Limits: words of up to 25 bits; for larger ones, counting conflicts takes too long.

use serde::{Deserialize, Serialize};

use super::polish::{Effort, MAX_BITS, round};
use deltille_core::family::{Construction, Control, FamilyError, Screen};

/// Parameters of a local search.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Search {
    /// Seed of the random choices.
    pub seed: u64,
    /// Rounds, each with new candidates.
    pub rounds: u32,
    /// Moves in each round.
    pub steps: u64,
}

/// Result of the completed rounds, from which the search can be resumed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Checkpoint {
    /// Number of completed rounds.
    pub rounds_done: u32,
    /// Codes after these rounds, in the order of the search.
    pub codes: Vec<u64>,
}

impl Search {
    /// Number of moves in a round of the shipped program.
    pub const STEPS: u64 = 200_000;

    /// Creates a search of the given number of rounds of [`Self::STEPS`] moves.
    pub fn new(seed: u64, rounds: u32) -> Self {
        Self { seed, rounds, steps: Self::STEPS }
    }

    /// Returns the codes found, in the order of a family.
    ///
    /// # Errors
    /// Returns an error if the search was cancelled.
    pub fn codes(&self, screen: &Screen, control: Control) -> Result<Vec<u64>, FamilyError> {
        let mut checkpoint = Checkpoint::default();
        self.resume(screen, &mut checkpoint, &|_| true, control)?;
        Ok(checkpoint.family_codes(screen))
    }

    /// Completes the rounds that a checkpoint lacks. Calls `save` after each; its result determines whether to
    /// continue. After cancelling, the checkpoint contains the completed rounds.
    ///
    /// # Errors
    /// Returns an error if the checkpoint belongs to another search, or this one was cancelled.
    pub fn resume(
        &self,
        screen: &Screen,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint) -> bool,
        control: Control,
    ) -> Result<(), FamilyError> {
        let bits = screen.words().dimension().bits();
        if bits > MAX_BITS {
            let problem = format!("local search supports at most {MAX_BITS} bits, not {bits}");
            return Err(FamilyError::field("bits", problem));
        }
        let effort =
            Effort { seed: self.seed, rounds: self.rounds, steps: self.steps, most: usize::MAX };
        let halt = || control.is_cancelled();
        while checkpoint.rounds_done < self.rounds {
            control.check()?;
            let codes = round(screen, &checkpoint.codes, effort, checkpoint.rounds_done, halt);
            // The progress of an interrupted round depends on its timing.
            control.check()?;
            checkpoint.codes = codes;
            checkpoint.rounds_done += 1;
            let go_on = save(checkpoint);
            let (done, found) = (checkpoint.rounds_done, checkpoint.codes.len());
            control.tell(done.into(), self.rounds.into(), found);
            if !go_on {
                break;
            }
        }
        Ok(())
    }

    /// Returns the record of a search with `rounds` rounds.
    pub fn construction(&self, rounds: u32) -> Construction {
        Construction::Search { seed: self.seed, rounds, steps: self.steps }
    }
}

impl Checkpoint {
    /// Returns the codes in the order of a family: by the smallest of the three rotated words.
    pub fn family_codes(&self, screen: &Screen) -> Vec<u64> {
        let mut codes = self.codes.clone();
        codes.sort_unstable_by_key(|&code| screen.words().canonical(code));
        codes
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use deltille_core::family::{Rules, TagWords};
    use deltille_core::lattice::Dimension;

    #[test]
    fn interrupted_searches_find_the_same() {
        let words = TagWords::new(Dimension::from_bits(16).unwrap());
        let screen = Screen::new(words, 7, &Rules::published(7));
        let search = Search { seed: 5, rounds: 4, steps: 3_000 };
        let whole = search.codes(&screen, Control::default()).unwrap();

        let cancel = AtomicBool::new(false);
        let control = Control::default().cancel(&cancel);
        let mut checkpoint = Checkpoint::default();
        let stop = |c: &Checkpoint| {
            cancel.store(c.rounds_done == 2, Ordering::Relaxed);
            true
        };
        let stopped = search.resume(&screen, &mut checkpoint, &stop, control);
        assert!(matches!(stopped, Err(FamilyError::Cancelled)));
        assert_eq!(checkpoint.rounds_done, 2);
        search.resume(&screen, &mut checkpoint, &|_| true, Control::default()).unwrap();
        assert_eq!(checkpoint.family_codes(&screen), whole);
    }
}
