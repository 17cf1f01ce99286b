use serde::{Deserialize, Serialize};

use super::{FamilyError, TagWords};

/// What every single code of a family has to satisfy, besides its distance to the other codes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Share of the pairs of edge-adjacent cells that differ, at least; 0 to 1.
    pub min_complexity: f64,
    /// Distance from the all-black word, an untagged tile, at least: the number of white cells.
    pub black_distance: u32,
    /// Distance from the all-white word, at least: the number of black cells.
    pub white_distance: u32,
}

impl Rules {
    /// No rules: what is known of families from elsewhere.
    pub const NONE: Self = Self { min_complexity: 0.0, black_distance: 0, white_distance: 0 };

    /// The rules of the published families: half of the pairs differ, and the untagged tile is as
    /// far as another code (`docs/families.md`, “What a family is”). The distance from a code to its
    /// own turns is always h.
    pub fn published(distance: u32) -> Self {
        Self { min_complexity: 0.5, black_distance: distance, white_distance: 0 }
    }

    /// Checks that the numbers make sense for tags of `bits` cells; names the field that does not.
    ///
    /// # Errors
    /// The first field that does not, and why.
    pub fn check(&self, bits: u32) -> Result<(), FamilyError> {
        if !(0.0..=1.0).contains(&self.min_complexity) {
            let problem = format!("{} is not between 0 and 1", self.min_complexity);
            return Err(FamilyError::field("min_complexity", problem));
        }
        for (field, value) in
            [("black_distance", self.black_distance), ("white_distance", self.white_distance)]
        {
            if value > bits {
                let problem = format!("{value} is more than the {bits} bits of a tag");
                return Err(FamilyError::field(field, problem));
            }
        }
        Ok(())
    }
}

/// The rules made ready for one dimension and distance: a yes or no for every word.
#[derive(Clone, Debug)]
pub struct Screen {
    words: TagWords,
    distance: u32,
    /// Pairs of adjacent cells that must differ.
    pub(super) min_pairs: u32,
    black_distance: u32,
    white_distance: u32,
}

impl Screen {
    /// The words of `words` under `rules` and a distance from their own turns of at least `distance`.
    pub fn new(words: TagWords, distance: u32, rules: &Rules) -> Self {
        // The share is a decimal fraction from a file: 1e-9 keeps its rounding from adding a pair.
        let min_pairs = (rules.min_complexity * f64::from(words.pairs()) - 1e-9).ceil() as u32;
        let Rules { black_distance, white_distance, .. } = *rules;
        Self { words, distance, min_pairs, black_distance, white_distance }
    }

    /// The word arithmetic.
    pub fn words(&self) -> &TagWords {
        &self.words
    }

    /// Distance asked for between different tags, and different turns of one.
    pub fn distance(&self) -> u32 {
        self.distance
    }

    /// Whether a word, on its own, may be a code.
    #[inline]
    pub fn admits(&self, word: u64) -> bool {
        self.look_is_fine(word) && self.words.turn_distance(word) >= self.distance
    }

    /// Whether a word satisfies the rules, its own turns aside.
    #[inline]
    pub fn look_is_fine(&self, word: u64) -> bool {
        let white = word.count_ones();
        white >= self.black_distance
            && self.words.dimension().bits() - white >= self.white_distance
            && self.words.differing_pairs(word) >= self.min_pairs
    }
}
