use serde::{Deserialize, Serialize};

use crate::family::kernels::any_nearer;
use crate::family::{FamilyError, FreeCells, Robust, TagWords};
use crate::lattice::Dimension;

/// Conditions on every single code of a family, besides its distance to the other codes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Minimum fraction of pairs of edge-adjacent cells that differ; 0 to 1.
    pub min_complexity: f64,
    /// Minimum distance from the all-black word, an untagged tile: the number of white cells.
    pub black_distance: u32,
    /// Minimum distance from the all-white word: the number of black cells.
    pub white_distance: u32,
    /// Cells that may be hidden, and the minimum distance to other codes that remains then.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robust: Vec<Robust>,
    /// Cells that no code uses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub free: Option<FreeCells>,
}

impl Rules {
    /// No rules, for families from other sources.
    pub const NONE: Self = Self {
        min_complexity: 0.0,
        black_distance: 0,
        white_distance: 0,
        robust: Vec::new(),
        free: None,
    };

    /// Returns the rules of the published families: half of the pairs differ, and the untagged tile
    /// is at the same distance as another code (`docs/families.md`, “What a family is”). The
    /// distance from a code to its own rotations is always
    /// h.
    pub fn published(distance: u32) -> Self {
        Self { min_complexity: 0.5, black_distance: distance, ..Self::NONE }
    }

    /// Checks that the rules are valid for tags of `bits` cells.
    ///
    /// # Errors
    /// Returns the first invalid field and its problem.
    pub fn check(&self, bits: u32) -> Result<(), FamilyError> {
        if !(0.0..=1.0).contains(&self.min_complexity) {
            let problem = format!("{} is not between 0 and 1", self.min_complexity);
            return Err(FamilyError::field("min_complexity", problem));
        }
        for (field, value) in
            [("black_distance", self.black_distance), ("white_distance", self.white_distance)]
        {
            if value > bits {
                let problem = format!("{value} exceeds the {bits} bits of a tag");
                return Err(FamilyError::field(field, problem));
            }
        }
        let Ok(dimension) = Dimension::from_bits(bits) else { return Ok(()) };
        for (i, robust) in self.robust.iter().enumerate() {
            let seen = bits - robust.to.count(dimension);
            if !(1..=seen).contains(&robust.distance) {
                let problem = format!(
                    "{robust}: the distance must be from 1 to {seen}, the number of visible cells"
                );
                return Err(FamilyError::field("robust", problem));
            }
            if self.robust[..i].iter().any(|other| other.to == robust.to) {
                let problem = format!("{} appears twice", robust.to.name());
                return Err(FamilyError::field("robust", problem));
            }
        }
        Ok(())
    }
}

/// The rules prepared for one dimension and distance, to accept or reject words.
#[derive(Clone, Debug)]
pub struct Screen {
    words: TagWords,
    distance: u32,
    /// Number of pairs of adjacent cells that must differ.
    min_pairs: u32,
    black_distance: u32,
    white_distance: u32,
    /// Cells that no code uses.
    free: u64,
    /// Masks of possible hidden cells, and the distance that must remain.
    robust: Vec<(Vec<u64>, u32)>,
    reach: u32,
}

impl Screen {
    /// Creates a screen for `words` under `rules`, with codes `distance` apart from each other and from their own
    /// rotations.
    pub fn new(words: TagWords, distance: u32, rules: &Rules) -> Self {
        let free = rules.free.map_or(0, |free| free.mask(words.dimension()));
        let words = words.without(free);
        // The fraction is a decimal number from a file: 1e-9 keeps its rounding from adding a pair.
        let min_pairs = (rules.min_complexity * f64::from(words.pairs()) - 1e-9).ceil() as u32;
        let Rules { black_distance, white_distance, .. } = *rules;
        let dimension = words.dimension();
        let reach = |robust: &Robust| robust.distance + robust.to.count(dimension);
        // With fewer hidden cells than the distance can spare, there is no extra condition.
        let asked: Vec<&Robust> = rules.robust.iter().filter(|r| reach(r) > distance).collect();
        let farthest = asked.iter().map(|robust| reach(robust)).max().unwrap_or(distance);
        let robust = asked.into_iter().map(|r| (r.to.masks(dimension), r.distance)).collect();
        Self {
            words,
            distance,
            min_pairs,
            black_distance,
            white_distance,
            free,
            robust,
            reach: farthest,
        }
    }

    /// Returns the word arithmetic.
    pub fn words(&self) -> &TagWords {
        &self.words
    }

    /// Returns the required distance between different tags, and between different rotations of one.
    pub fn distance(&self) -> u32 {
        self.distance
    }

    /// Returns whether hidden cells impose conditions beyond the distance of two codes.
    pub fn is_robust(&self) -> bool {
        !self.robust.is_empty()
    }

    /// Returns the minimum number of pairs of neighbouring cells that differ in a word.
    #[doc(hidden)]
    pub fn min_pairs(&self) -> u32 {
        self.min_pairs
    }

    /// Returns the number of differing cells that is always sufficient, regardless of which cells
    /// they are.
    #[doc(hidden)]
    pub fn reach(&self) -> u32 {
        self.reach
    }

    /// Returns whether words with this difference are far enough apart, even with hidden cells.
    /// Rotating both words changes nothing, because the sets of hidden cells include all rotations.
    #[inline]
    pub fn is_apart(&self, difference: u64) -> bool {
        let count = difference.count_ones();
        let is_left = |(masks, distance): &(Vec<u64>, u32)| {
            masks.iter().all(|mask| (difference & !mask).count_ones() >= *distance)
        };
        count >= self.distance && (count >= self.reach || self.robust.iter().all(is_left))
    }

    /// Returns the differences of `distance` or more cells that are insufficient with hidden cells.
    #[doc(hidden)]
    pub fn hidden_differences(&self) -> Vec<u64> {
        let all = self.words.dimension().mask();
        let of_place = |mask: u64, distance: u32| {
            let seen = (0..distance).flat_map(move |ones| scattered(all & !mask, ones));
            seen.flat_map(move |seen| parts(mask).map(move |part| seen | part))
        };
        let mut found: Vec<u64> = (self.robust.iter())
            .flat_map(|(masks, distance)| masks.iter().map(|&mask| (mask, *distance)))
            .flat_map(|(mask, distance)| of_place(mask, distance))
            .filter(|word| word.count_ones() >= self.distance)
            .collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Returns whether a word is far enough from all words of a list.
    #[doc(hidden)]
    pub fn is_apart_from(&self, word: u64, list: &[u64]) -> bool {
        match self.is_robust() {
            false => !any_nearer(word, list, self.distance),
            true => list.iter().all(|other| self.is_apart(word ^ other)),
        }
    }

    /// Returns whether a word, on its own, may be a code.
    #[inline]
    pub fn admits(&self, word: u64) -> bool {
        self.look_is_fine(word) && self.is_apart(word ^ self.words.rotate(word))
    }

    /// Returns whether a word satisfies the rules, apart from the distance to its own rotations.
    #[inline]
    pub fn look_is_fine(&self, word: u64) -> bool {
        let white = word.count_ones();
        let used = self.words.dimension().bits() - self.free.count_ones();
        word & self.free == 0
            && white >= self.black_distance
            && white + self.white_distance <= used
            && self.words.differing_pairs(word) >= self.min_pairs
    }
}

/// Returns all words that are subsets of a mask.
pub(super) fn parts(mask: u64) -> impl Iterator<Item = u64> {
    let next = move |&part: &u64| (part != mask).then(|| part.wrapping_sub(mask) & mask);
    std::iter::successors(Some(0), next)
}

/// Returns the subsets of a mask with the given number of ones.
fn scattered(mask: u64, ones: u32) -> impl Iterator<Item = u64> {
    parts(mask).filter(move |part| part.count_ones() == ones)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn screen(bits: u32, distance: u32, robust: &str) -> Screen {
        let words = TagWords::new(Dimension::from_bits(bits).unwrap());
        let robust = vec![robust.parse().unwrap()];
        Screen::new(words, distance, &Rules { robust, ..Rules::NONE })
    }

    #[test]
    fn hidden_differences_are_complete() {
        for (distance, robust) in [(5, "edge"), (5, "apex=4"), (3, "tile=5")] {
            let screen = screen(16, distance, robust);
            let near = |word: &u64| word.count_ones() >= distance && !screen.is_apart(*word);
            let all: Vec<u64> = (0..1 << 16).filter(near).collect();
            assert_eq!(screen.hidden_differences(), all, "{robust}");
            assert!(!all.is_empty() && all.iter().all(|word| word.count_ones() < screen.reach()));
        }
        // A rule that already follows from the distance adds nothing.
        assert!(!screen(16, 7, "apex").is_robust());
    }
}
