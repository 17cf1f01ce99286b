//! The published construction: a lexicode over an arithmetic progression of candidates.
//!
//! Candidates v(i) = start + i·step mod 2^b are taken in turn; one is kept when it satisfies the
//! [`Rules`], is at least h from its own turns, and at least h from every turn of every code kept
//! before (FORMATS §3). This is the AprilTag construction (Olson, "AprilTag: A robust and flexible
//! visual fiducial system", ICRA 2011) with three turns in place of four.

use rayon::prelude::*;

use super::{Construction, Control, Family, FamilyError, Rules, Screen, TagWords};
use crate::lattice::Dimension;

/// The step of the published families, a prime.
pub const STEP: u64 = 982_451_653;

/// Candidates in the first chunk; few, because there is nothing yet to filter them against.
const FIRST_CHUNK: u64 = 1 << 10;
/// Candidates in a chunk at most: a fraction of a second of work.
const LARGEST_CHUNK: u64 = 1 << 21;

/// Parameters of a lexicode.
#[derive(Clone, Debug, PartialEq)]
pub struct Lexicode {
    /// Dimension of the tags.
    pub dimension: Dimension,
    /// Distance h.
    pub distance: u32,
    /// Rules for single codes.
    pub rules: Rules,
    /// First candidate.
    pub start: u64,
    /// Difference of successive candidates; odd, so that all 2^b words are met.
    pub step: u64,
    /// Number of candidates tried.
    pub candidates: u64,
}

impl Lexicode {
    /// The parameters of the published family of these bits and distance; where none was
    /// published, the same with `start` = `step` mod 2^b.
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
            candidates: dimension.mask() + 1,
        }
    }

    /// Runs the search. Does not depend on the number of threads.
    pub fn codes(&self, control: Control) -> Result<Vec<u64>, FamilyError> {
        let screen = Screen::new(TagWords::new(self.dimension), self.distance, &self.rules);
        let mut kept = Kept { codes: Vec::new(), turned: Vec::new(), distance: self.distance };
        let (mut from, mut chunk) = (0, FIRST_CHUNK);
        while from < self.candidates {
            control.check()?;
            let to = (from + chunk).min(self.candidates);
            // What earlier chunks forbid is sorted out in parallel, the rest is decided in order.
            let known = kept.turned.len();
            let left: Vec<u64> = (from..to)
                .into_par_iter()
                .map(|i| self.start.wrapping_add(i.wrapping_mul(self.step)) & self.dimension.mask())
                .filter(|&v| screen.admits(v) && kept.allows(v, 0))
                .collect();
            for v in left {
                if kept.allows(v, known) {
                    kept.push(v, screen.words());
                }
            }
            control.report(to, self.candidates, kept.codes.len());
            (from, chunk) = (to, (2 * chunk).min(LARGEST_CHUNK));
        }
        Ok(kept.codes)
    }

    /// Runs the search and makes a family of the codes.
    pub fn family(&self, name: &str, control: Control) -> Result<Family, FamilyError> {
        let construction = Construction::Lexicode {
            start: TagWords::new(self.dimension).hex(self.start),
            step: self.step,
            candidates: self.candidates,
        };
        let codes = self.codes(control)?;
        Family::new(name, self.dimension, self.distance, codes, self.rules.clone(), construction)
    }
}

/// Codes kept so far, with their turns side by side.
struct Kept {
    codes: Vec<u64>,
    turned: Vec<u64>,
    distance: u32,
}

impl Kept {
    /// Whether `word` is far enough from the turned codes from number `from` on.
    fn allows(&self, word: u64, from: usize) -> bool {
        self.turned[from..].iter().all(|other| (word ^ other).count_ones() >= self.distance)
    }

    fn push(&mut self, word: u64, words: &TagWords) {
        self.codes.push(word);
        self.turned.extend(words.turns(word));
    }
}
