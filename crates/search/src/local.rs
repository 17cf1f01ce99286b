//! Local search from nothing, for the small families: the same codes for the same seed and rounds,
//! also when it was interrupted and went on from a [`Checkpoint`].
//!
//! Limits: words of up to 25 bits; larger ones are too many to count conflicts for.

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

/// What whole rounds have found, to go on from there.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct Checkpoint {
    /// Rounds that are done.
    pub rounds_done: u32,
    /// Codes after these, in the order of the search.
    pub codes: Vec<u64>,
}

impl Search {
    /// Moves in a round of the shipped program.
    pub const STEPS: u64 = 200_000;

    /// A search of so many rounds of [`Self::STEPS`] moves.
    pub fn new(seed: u64, rounds: u32) -> Self {
        Self { seed, rounds, steps: Self::STEPS }
    }

    /// The codes found, in the order of a family.
    ///
    /// # Errors
    /// Where the search was cancelled.
    pub fn codes(&self, screen: &Screen, control: Control) -> Result<Vec<u64>, FamilyError> {
        let mut checkpoint = Checkpoint::default();
        self.resume(screen, &mut checkpoint, &|_| true, control)?;
        Ok(checkpoint.family_codes(screen))
    }

    /// Does the rounds that a checkpoint lacks; `save` is called after each, and tells whether to
    /// go on. When it is cancelled, the checkpoint holds the rounds that were finished.
    ///
    /// # Errors
    /// Where the checkpoint is of another search, or this one was cancelled.
    pub fn resume(
        &self,
        screen: &Screen,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint) -> bool,
        control: Control,
    ) -> Result<(), FamilyError> {
        let bits = screen.words().dimension().bits();
        if bits > MAX_BITS {
            let problem = format!("local search works up to {MAX_BITS} bits, not with {bits}");
            return Err(FamilyError::field("bits", problem));
        }
        let effort =
            Effort { seed: self.seed, rounds: self.rounds, steps: self.steps, most: usize::MAX };
        let halt = || control.is_cancelled();
        while checkpoint.rounds_done < self.rounds {
            control.check()?;
            let codes = round(screen, &checkpoint.codes, effort, checkpoint.rounds_done, halt);
            // How far an interrupted round came depends on the moment.
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

    /// The record of a search that did `rounds` rounds.
    pub fn construction(&self, rounds: u32) -> Construction {
        Construction::Search { seed: self.seed, rounds, steps: self.steps }
    }
}

impl Checkpoint {
    /// The codes in the order of a family: by the smallest of the three turned words.
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
    fn a_search_that_was_interrupted_finds_the_same() {
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
