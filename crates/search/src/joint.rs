//! Arrangements judged by the result of local search.
//!
//! The number of a code's words that pass the rules is only part of an arrangement's worth. Other words can be
//! repaired or exchanged, and the number of compatible ones differs between arrangements. So annealing continues with
//! the number of codes at the end of a short local search. Up to 16 bits the search may exchange any words,
//! whose conflicts are listed once. For more bits, it exchanges words that do not pass for words
//! one cell away.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::independent::ConflictGraph;
use crate::algebra::arrange::Arranger;
use deltille_core::family::Screen;
use deltille_core::family::algebra::Arrangement;
use deltille_core::family::algebra::CosetUnion;
use deltille_core::family::algebra::{arranged, has_free_centre};

/// Largest number of bits at which the conflicts of all words are listed.
const LISTED_BITS: u32 = 16;

/// All words that the rules admit, one of each orbit, and their conflicts.
#[derive(Clone, Debug)]
pub(crate) struct AllWords {
    words: Vec<u64>,
    graph: ConflictGraph,
}

impl AllWords {
    /// Returns `None` if there are too many words, or `halt` returned true first.
    pub(crate) fn new(screen: &Screen, halt: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let words = screen.words();
        if words.dimension().bits() > LISTED_BITS {
            return None;
        }
        let all = 0..=words.dimension().mask();
        let all = all.filter(|&word| words.canonical(word) == word && screen.admits(word));
        let all: Vec<u64> = all.collect();
        let graph = ConflictGraph::of_words(screen, &all, halt);
        (!halt()).then_some(Self { words: all, graph })
    }

    /// Finds codes by a local search that starts from some of these words.
    fn search(&self, screen: &Screen, codes: &[u64], seed: u64, steps: u64) -> Vec<u64> {
        let index = |code: &u64| self.words.binary_search(&screen.words().canonical(*code)).ok();
        let initial: Vec<u32> = codes.iter().filter_map(index).map(|i| i as u32).collect();
        let found = self.graph.search(&initial, seed, steps, || false);
        found.into_iter().map(|i| self.words[i as usize]).collect()
    }
}

/// Annealing of one union of cosets.
pub(crate) struct Joint<'a> {
    pub screen: &'a Screen,
    pub union: &'a CosetUnion,
    pub arranger: &'a Arranger,
    pub all: Option<&'a AllWords>,
}

impl Joint<'_> {
    /// Returns the best arrangement found from `start`, and its codes.
    pub(crate) fn anneal(
        &self,
        start: &Arrangement,
        seed: u64,
        steps: u32,
        halt: &(dyn Fn() -> bool + Sync),
    ) -> (Arrangement, Vec<u64>) {
        /// Initial and final loss of codes that is accepted with a probability of 1/e.
        const HOT: f64 = 3.0;
        const COLD: f64 = 0.3;
        /// Fraction of the words by which the quick score may decrease.
        const CLEARLY_WORSE: f64 = 0.03;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut now = start.clone();
        let mut codes = self.codes(&now, random.random());
        let mut quick = self.arranger.judge(&now);
        let slack = CLEARLY_WORSE * quick.max(100.0);
        let mut best = (now.clone(), codes.clone());
        for step in 0..steps {
            if halt() {
                break;
            }
            let mut next = self.arranger.changed(&now, &mut random);
            if random.random_ratio(1, 3) {
                next = self.arranger.changed(&next, &mut random);
            }
            let next_quick = self.arranger.judge(&next);
            if next_quick < quick - slack && self.all.is_none() {
                continue;
            }
            let next_codes = self.codes(&next, random.random());
            let gain = next_codes.len() as f64 - codes.len() as f64;
            let temperature = HOT * (COLD / HOT).powf(f64::from(step) / f64::from(steps));
            if gain >= 0.0 || random.random::<f64>() < (gain / temperature).exp() {
                (now, codes, quick) = (next, next_codes, next_quick);
                if codes.len() > best.1.len() {
                    best = (now.clone(), codes.clone());
                }
            }
        }
        best
    }

    /// Returns the codes of an arrangement after a short local search.
    fn codes(&self, arrangement: &Arrangement, seed: u64) -> Vec<u64> {
        /// Number of moves if all words are candidates, and if repaired ones are.
        const MOVES: [u64; 2] = [3_000, 20_000];
        let mut codes = arranged(self.screen, self.union, arrangement);
        if let Some(all) = self.all {
            return all.search(self.screen, &codes, seed, MOVES[0]);
        }
        let repaired = self.repaired(arrangement, &codes);
        let graph = ConflictGraph::of_words(self.screen, &repaired, || false);
        let found = graph.search(&[], seed, MOVES[1], || false);
        codes.extend(found.into_iter().map(|i| repaired[i as usize]));
        codes
    }

    /// Returns admitted words one cell away from a word of the union that does not pass, and far enough from all
    /// passing `codes`.
    fn repaired(&self, arrangement: &Arrangement, codes: &[u64]) -> Vec<u64> {
        let words = self.screen.words();
        let dimension = words.dimension();
        let bits = dimension.bits();
        let centre = match has_free_centre(self.union) {
            true => 1 << arrangement.bit_map(dimension)[bits as usize - 1],
            false => 0,
        };
        let turned: Vec<u64> = codes.iter().flat_map(|&code| words.rotations(code)).collect();
        let passes = |word: u64| self.screen.admits(word) || self.screen.admits(word ^ centre);
        let fits =
            |word: &u64| self.screen.admits(*word) && self.screen.is_apart_from(*word, &turned);
        let all = arrangement.apply(dimension, &self.union.orbits());
        let failing = all.into_iter().filter(|&word| !passes(word));
        let near = failing.flat_map(|word| (0..bits).map(move |bit| word ^ 1 << bit));
        let near = near.flat_map(|word| [word, word ^ centre]).filter(fits);
        let mut near: Vec<u64> = near.map(|word| words.canonical(word)).collect();
        near.sort_unstable();
        near.dedup();
        near
    }
}
