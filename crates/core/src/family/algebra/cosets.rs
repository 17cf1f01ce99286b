//! Unions of cosets of an invariant linear code K.

use std::collections::BTreeSet;

use super::ranked::Ranked;
use super::{CycleSpace, Span};

/// A union of cosets of a linear code. It is invariant under the rotation if its syndromes are whole orbits.
#[derive(Clone, Debug, PartialEq)]
pub struct CosetUnion {
    /// The space of the words.
    pub space: CycleSpace,
    /// The linear code whose cosets are united.
    pub code: Span,
    /// One word of each coset, in cycle coordinates; zero represents the code itself.
    pub cosets: Vec<u64>,
}

impl CosetUnion {
    /// Returns the smallest word of each orbit of three words, in cycle coordinates. Omits words that the rotation
    /// fixes, as they leave the orientation of a tag ambiguous.
    pub fn orbits(&self) -> Vec<u64> {
        let space = self.space;
        let words = self.cosets.iter().flat_map(|&c| self.code.words().map(move |w| w ^ c));
        words.filter(|&w| space.rotate(w) != w && space.canonical(w) == w).collect()
    }

    /// Returns the number of orbits of three words, and at most `most` of them, evenly distributed. A linear code of
    /// more than 24 dimensions is not listed.
    pub fn some_orbits(&self, most: usize) -> (usize, Vec<u64>) {
        const LISTED_DIMENSIONS: u32 = 24;
        if self.cosets == [0]
            && self.code.dimension() > LISTED_DIMENSIONS
            && let Some(ranked) = Ranked::new(self.space, &self.code)
        {
            let step = ranked.len().div_ceil(most as u64).max(1) | 1;
            let numbers = (0..ranked.len()).step_by(usize::try_from(step).unwrap_or(usize::MAX));
            let some = numbers.filter_map(|number| ranked.word(number)).collect();
            return (usize::try_from(ranked.len()).unwrap_or(usize::MAX), some);
        }
        let orbits = self.orbits();
        let (count, step) = (orbits.len(), orbits.len().div_ceil(most));
        (count, orbits.into_iter().step_by(step.max(1)).collect())
    }

    /// Returns the nonzero sums of two words that are lighter than `weight`, each once.
    pub fn differences_lighter_than(&self, weight: u32) -> Vec<u64> {
        let pairs = self.cosets.iter().enumerate();
        let shifts: BTreeSet<u64> = pairs
            .flat_map(|(i, a)| self.cosets[..=i].iter().map(move |b| self.code.reduce(a ^ b)))
            .collect();
        let words = shifts.into_iter().flat_map(|shift| self.code.words().map(move |w| w ^ shift));
        words.filter(|word| (1..weight).contains(&word.count_ones())).collect()
    }
}
