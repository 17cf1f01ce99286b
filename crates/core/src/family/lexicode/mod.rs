//! The published construction: a lexicode over an arithmetic progression of candidates.
//!
//! Candidates v(i) = start + i·step mod 2^b are tried in order. A candidate is kept if it satisfies
//! the [`Rules`] and its distance is at least h from its own rotations and from every rotation of
//! every code kept before (`docs/families.md`, “The published construction”). This is the AprilTag
//! construction (Olson, "AprilTag: A robust
//! and flexible visual fiducial system", ICRA 2011) with three rotations instead of four.
//!
//! Codes found early exclude nearly all of 2^36 candidates. So only the first 2^27 are tried in order. A sweep over
//! all words then finds the few that the codes so far leave open (see `sweep.rs`), and these are tried in the order
//! of the candidates. The result has the same codes in the same order as if every candidate had been tried.

mod sweep;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use self::sweep::Sweep;
use crate::family::{Construction, Control, Family, FamilyError, Rules, Screen, TagWords};
use crate::lattice::Dimension;

/// Step of the published families, a prime.
pub const STEP: u64 = 982_451_653;

/// Number of candidates in the first chunk; small, because there are no codes yet to filter against.
const FIRST_CHUNK: u64 = 1 << 10;
/// Maximum number of candidates in a chunk: a fraction of a second of work.
const MAX_CHUNK: u64 = 1 << 21;

/// Parameters of a lexicode.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Lexicode {
    /// Dimension of the tags.
    pub dimension: Dimension,
    /// Minimum distance h between any two codes in any rotation.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// First candidate.
    pub start: u64,
    /// Difference of successive candidates; odd, so that all 2^b words occur.
    pub step: u64,
    /// Number of candidates tried.
    pub candidates: u64,
}

impl Lexicode {
    /// Returns the parameters of the published family of these bits and distance. If none was
    /// published, `start` is `step` mod 2^b, and the other parameters follow the same rules.
    pub fn published(dimension: Dimension, distance: u32) -> Self {
        let start = match (dimension.bits(), distance) {
            (16, 5) => 0x24d6,
            (25, 7) => 0x08f_50a7,
            (25, 9) => 0x092_22e8,
            (36, 9) => 0x0_751f_5357,
            (36, 11) => 0x1_5f5d_7ed5,
            _ => STEP & dimension.mask(),
        };
        Self {
            dimension,
            distance,
            rules: Rules::published(distance),
            start,
            step: STEP,
            candidates: dimension.mask().saturating_add(1),
        }
    }

    /// Sets the rules for single codes.
    #[must_use]
    pub fn rules(self, rules: Rules) -> Self {
        Self { rules, ..self }
    }

    /// Runs the search. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// Returns an error if the rules are invalid, or the search was cancelled.
    pub fn codes(&self, control: Control) -> Result<Vec<u64>, FamilyError> {
        self.resume(&mut Checkpoint::default(), &|_| {}, control)
    }

    /// Resumes the search from a checkpoint, and reports new checkpoints. The codes are the same as without
    /// interruption.
    ///
    /// # Errors
    /// Returns an error if the rules are invalid, the checkpoint belongs to another search, or this one was
    /// cancelled.
    pub fn resume(
        &self,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint),
        control: Control,
    ) -> Result<Vec<u64>, FamilyError> {
        self.rules.check(self.dimension.bits())?;
        let screen = Screen::new(TagWords::new(self.dimension), self.distance, &self.rules);
        let sweeps = Sweep::suits(self.dimension.bits())
            && self.step % 2 == 1
            && self.candidates > FIRST_CANDIDATES
            && self.distance > MIN_DISTANCE;
        if sweeps && screen.is_robust() {
            let problem = "too many words remain open for a lexicode of this many bits: use `best`";
            return Err(FamilyError::field("robust", problem));
        }
        let first = if sweeps { FIRST_CANDIDATES } else { self.candidates };
        let kept = self.in_turn(&screen, first, checkpoint, save, control)?;
        if !sweeps {
            return Ok(kept.codes);
        }
        self.sweep(&screen, &kept, checkpoint, save, control)?;
        self.take_open(&screen, kept, &checkpoint.open, control)
    }

    /// Tries the first `count` candidates in order.
    fn in_turn<'a>(
        &self,
        screen: &'a Screen,
        count: u64,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint),
        control: Control,
    ) -> Result<Kept<'a>, FamilyError> {
        let mut kept = Kept::of(checkpoint.codes.clone(), screen);
        let (mut from, mut chunk) = (checkpoint.candidates_done, FIRST_CHUNK);
        let mut saved = from;
        while from < count {
            let cancelled = control.is_cancelled();
            if from > saved && (cancelled || from - saved >= CHECKPOINT_CANDIDATES) {
                checkpoint.candidates_done = from;
                checkpoint.codes.clone_from(&kept.codes);
                save(checkpoint);
                saved = from;
            }
            if cancelled {
                return Err(FamilyError::Cancelled);
            }
            let to = (from + chunk).min(count);
            // Parallel code removes candidates that earlier chunks exclude; the rest is tried in order.
            let known = kept.turned.len();
            let left: Vec<u64> = (from..to)
                .into_par_iter()
                .map(|i| self.start.wrapping_add(i.wrapping_mul(self.step)) & self.dimension.mask())
                .filter(|&v| screen.admits(v) && kept.allows(v, 0))
                .collect();
            for v in left {
                if kept.allows(v, known) {
                    kept.push(v);
                }
            }
            control.tell(to, self.candidates, kept.codes.len());
            (from, chunk) = (to, (2 * chunk).min(MAX_CHUNK));
        }
        if saved < count {
            checkpoint.candidates_done = count;
            checkpoint.codes.clone_from(&kept.codes);
            save(checkpoint);
        }
        Ok(kept)
    }

    /// Finds all words that the codes so far leave open, part by part.
    fn sweep(
        &self,
        screen: &Screen,
        kept: &Kept<'_>,
        checkpoint: &mut Checkpoint,
        save: &dyn Fn(&Checkpoint),
        control: Control,
    ) -> Result<(), FamilyError> {
        /// Number of parts done between two checkpoints.
        const BATCH: usize = 8;
        let sweep = Sweep::new(screen, &kept.turned);
        while checkpoint.parts_done < sweep.parts() {
            let to = (checkpoint.parts_done + BATCH).min(sweep.parts());
            let found = sweep.run(checkpoint.parts_done..to, control);
            checkpoint.open.extend(found?);
            checkpoint.parts_done = to;
            save(checkpoint);
            let share = to as f64 / sweep.parts() as f64;
            let done =
                FIRST_CANDIDATES as f64 + share * (self.candidates - FIRST_CANDIDATES) as f64;
            control.tell(done as u64, self.candidates, kept.codes.len());
        }
        Ok(())
    }

    /// Tries the open words in the order of the candidates.
    fn take_open(
        &self,
        screen: &Screen,
        mut kept: Kept<'_>,
        open: &[u64],
        control: Control,
    ) -> Result<Vec<u64>, FamilyError> {
        let mask = self.dimension.mask();
        let inverse = inverse_of_odd(self.step);
        let number = |word: u64| word.wrapping_sub(self.start).wrapping_mul(inverse) & mask;
        // Of three rotations, the first among the candidates is tried first. If it is not taken, the same code
        // excludes the others.
        let mut in_order: Vec<u64> = open
            .par_iter()
            .filter_map(|&word| screen.words().rotations(word).map(number).into_iter().min())
            .filter(|&number| number < self.candidates)
            .collect();
        in_order.par_sort_unstable();
        in_order.dedup();
        for chunk in in_order.chunks(MAX_CHUNK as usize / 64) {
            control.check()?;
            let known = kept.turned.len();
            let left: Vec<u64> = chunk
                .par_iter()
                .map(|i| self.start.wrapping_add(i.wrapping_mul(self.step)) & mask)
                .filter(|&v| kept.allows(v, 0))
                .collect();
            for v in left {
                if kept.allows(v, known) {
                    kept.push(v);
                }
            }
            control.tell(self.candidates, self.candidates, kept.codes.len());
        }
        Ok(kept.codes)
    }

    /// Runs the search and makes a family of the codes.
    ///
    /// # Errors
    /// Returns an error if the rules or the name are invalid, or the search was cancelled.
    pub fn family(&self, name: &str, control: Control) -> Result<Family, FamilyError> {
        self.family_of(name, self.codes(control)?)
    }

    /// Makes a family of the codes that a search has found.
    ///
    /// # Errors
    /// Returns an error if the name states other bits or another distance.
    pub fn family_of(&self, name: &str, codes: Vec<u64>) -> Result<Family, FamilyError> {
        let construction = Construction::Lexicode {
            start: TagWords::new(self.dimension).hex(self.start),
            step: self.step,
            candidates: self.candidates,
        };
        Family::new(name, self.dimension, self.distance, codes, self.rules.clone(), construction)
    }
}

/// Number of candidates tried one by one before a sweep finds the rest.
const FIRST_CANDIDATES: u64 = 1 << 27;

/// Largest distance at which the first codes leave too many words open to list them.
const MIN_DISTANCE: u32 = 7;

/// Number of candidates tried between two checkpoints: a few seconds of work, and a few kilobytes
/// in a file.
const CHECKPOINT_CANDIDATES: u64 = 1 << 23;

/// State of a long search, from which it can be resumed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Number of candidates that were tried in order.
    pub candidates_done: u64,
    /// Codes among these.
    pub codes: Vec<u64>,
    /// Number of completed parts of the sweep.
    pub parts_done: usize,
    /// Words found open in these parts.
    pub open: Vec<u64>,
}

/// Returns the inverse modulo 2^64 by Newton's iteration: each step doubles the number of correct bits.
fn inverse_of_odd(x: u64) -> u64 {
    (0..5).fold(x, |y, _| y.wrapping_mul(2u64.wrapping_sub(x.wrapping_mul(y))))
}

/// Codes kept so far, with their rotations next to each other.
struct Kept<'a> {
    codes: Vec<u64>,
    turned: Vec<u64>,
    screen: &'a Screen,
}

impl<'a> Kept<'a> {
    fn of(codes: Vec<u64>, screen: &'a Screen) -> Self {
        let turned = codes.iter().flat_map(|&code| screen.words().rotations(code)).collect();
        Self { codes, turned, screen }
    }

    /// Returns whether `word` is far enough from the rotated codes with index `from` or higher.
    fn allows(&self, word: u64, from: usize) -> bool {
        self.screen.is_apart_from(word, &self.turned[from..])
    }

    fn push(&mut self, word: u64) {
        self.codes.push(word);
        self.turned.extend(self.screen.words().rotations(word));
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::family::algebra::{Arrangement, CycleSpace};

    /// Compares the sweep with the definition, on random words of one part of the tree.
    #[test]
    fn the_sweep_finds_all_open_words() {
        let dimension = Dimension::from_bits(36).unwrap();
        let screen = Screen::new(TagWords::new(dimension), 13, &Rules::published(13));
        let mut search = Lexicode::published(dimension, 13);
        search.candidates = 100;
        let kept = Kept::of(search.codes(Control::default()).unwrap(), &screen);
        let fine = |w: u64| screen.admits(w) && kept.allows(w, 0);
        let sweep = Sweep::new(&screen, &kept.turned);
        // The last part fixes the symbols 011 111 111.
        let part = sweep.parts() - 1;
        let mut open = sweep.run(part..part + 1, Control::default()).unwrap();
        open.sort_unstable();
        assert!(!open.is_empty() && open.iter().all(|&w| fine(w)));

        let space = CycleSpace::of(dimension);
        let plain = Arrangement::plain(space);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut met = 0;
        for _ in 0..200_000 {
            let word = 0b011_111_111u64 << 27 | random.random::<u64>() >> 37;
            let tag = plain.apply(dimension, &[word])[0];
            if fine(tag) {
                met += 1;
                assert!(open.binary_search(&screen.words().canonical(tag)).is_ok());
            }
        }
        assert!(met > 100, "{met}");
    }

    #[test]
    fn inverses_are_inverse() {
        for x in [1, 3, STEP, u64::MAX] {
            assert_eq!(inverse_of_odd(x).wrapping_mul(x), 1);
        }
    }
}
