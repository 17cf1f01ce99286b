//! False positives in pictures of the world, which fair coins overstate.
//!
//! Neighbouring cells of what is no tag are mostly alike. Of a triangle with a border that is cut from a natural
//! picture the word w is seen with a probability that depends on its number of differing pairs c(w) alone,
//!
//! ```text
//!     P(w) = P(c = c(w)) / |{v : c(v) = c(w)}|
//! ```
//!
//! with the distribution of c that `families/natural/sample.py` found in 32 photographs. How often natural words are
//! within t cells of a code is predicted by that to a tenth, and for other photographs within a factor of 3
//! ([`NATURAL_FACTOR`]; `docs/families.md`, “False positives”).
//!
//! Limits: triangular tags. Textures show more than the mean, grass 2.4 times as much; other tags are no natural pictures.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::family::rules::parts;
use crate::family::{Family, TagWords, ball};
use crate::lattice::{Dimension, GridKind};

/// Natural false positives of a triangle with a border that are accepted by [`Family::recommended_correction`]: one in
/// 10,000, so that by [`TRIANGLES_PER_MEGAPIXEL`] a false tag is met less than once in 40,000 megapixels.
pub const ACCEPTED_FALSE_POSITIVES: f64 = 1e-4;

/// Triangles of natural pictures that the detector reads as tags, in a megapixel, at most: it found no grid in 12.8 megapixels of
/// photographs, which has a probability of 4 % where there are so many.
pub const TRIANGLES_PER_MEGAPIXEL: f64 = 0.25;

/// Natural false positives of other pictures are as stated within this factor. Largest deviations met in pictures that
/// took no part: 2.6 times fewer than stated (d36h11, five cells corrected), 3 times more (d49h12), others 1.8.
pub const NATURAL_FACTOR: f64 = 3.0;

/// A line for each number of cells: that number, and ln P of a word by the number of its pairs that differ.
const TABLE: &str = include_str!("../../../families/natural/words.txt");

/// How likely words are in natural pictures.
///
/// ```
/// use deltille_core::family::NaturalWords;
/// use deltille_core::lattice::Dimension;
///
/// let words = NaturalWords::new(Dimension::from_bits(9)?);
/// let all: f64 = (0..1 << 9).map(|word| words.chance(word)).sum();
/// assert!((all - 1.0).abs() < 0.01, "{all}");
/// assert!(words.chance(0) > 100.0 * words.chance(0b0_1010_1010));
/// # Ok::<(), deltille_core::lattice::DimensionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct NaturalWords {
    words: TagWords,
    /// P by differing pairs.
    chances: Vec<f64>,
    /// Cells that may show anything.
    free: u64,
}

impl NaturalWords {
    /// The words of triangular tags of a dimension.
    pub fn new(dimension: Dimension) -> Self {
        let bits = dimension.bits().to_string();
        let of_bits = |line: &&str| line.split(' ').next() == Some(&bits);
        let line = TABLE.lines().find(of_bits).unwrap_or_default();
        let logs = line.split(' ').skip(1).filter_map(|log| log.parse::<f64>().ok());
        let chances = logs.map(f64::exp).collect();
        Self { words: TagWords::new(dimension), chances, free: 0 }
    }

    /// The same with cells that may show anything; words have these black.
    #[must_use]
    pub fn with_free(self, free: u64) -> Self {
        Self { free, ..self }
    }

    /// Probability that a triangle with a border shows a word.
    pub fn chance(&self, word: u64) -> f64 {
        let shown = parts(self.free).map(|part| self.words.differing_pairs(word | part));
        shown.map(|pairs| self.chances[pairs as usize]).sum()
    }

    /// Probability that it shows a word within `errors` cells of a code in one of its turns; every such word is looked at.
    pub fn chance_near(&self, code: u64, errors: u32) -> f64 {
        (0..=errors).map(|radius| self.sphere(code, radius)).sum()
    }

    /// The same of the words that differ in `radius` cells.
    fn sphere(&self, code: u64, radius: u32) -> f64 {
        let bits = self.words.dimension().bits();
        let used = subsets(bits, radius).filter(|flips| flips & self.free == 0);
        used.map(|flips| self.chance(code ^ flips)).sum()
    }

    /// ln Σ P(w) exp Σ l s(w), over all words w, with the half log-odds l that cells are white and s = ±1 for white and
    /// black cells: how likely what was measured is in natural pictures, up to the factor that
    /// Σ l s has for a code. `half_odds` are by bit.
    ///
    /// Cell by cell from the base to the apex, the sums are kept by the number of differing pairs so far, and by the colours of
    /// those cells that have a neighbour to come: inverted ones below, and the one to the left.
    pub fn log_likelihood(&self, half_odds: &[f32]) -> f64 {
        let rows = self.words.dimension().rows();
        let (counts, states) = (self.chances.len(), 1usize << rows);
        // The colour of the cell to the left has the last bit of a state, that of the inverted cell of column c bit c.
        let left_of = |state: usize| state >> (rows - 1) & 1;
        let mut sums = vec![0.0; states * counts];
        sums[0] = 1.0;
        for (row, k) in (0..rows).flat_map(|row| (0..2 * (rows - row) - 1).map(move |k| (row, k))) {
            let above = rows - 1 - row;
            let odds = f64::from(half_odds[(rows * rows - 1 - above * above - k) as usize]);
            let (col, upright) = (k / 2, k.is_multiple_of(2));
            let mut next = vec![0.0; states * counts];
            for (state, colour) in (0..states).flat_map(|state| [(state, 0), (state, 1)]) {
                let below = state >> col & 1;
                let pairs = usize::from(k > 0 && left_of(state) != colour)
                    + usize::from(upright && row > 0 && below != colour);
                let kept = state & !(1 << col) & !(1 << (rows - 1));
                let slot = if upright { 0 } else { colour << col };
                let to = kept | slot | colour << (rows - 1);
                let weight = if colour == 1 { odds.exp() } else { (-odds).exp() };
                let from = &sums[state * counts..(state + 1) * counts - pairs];
                let into = &mut next[to * counts + pairs..(to + 1) * counts];
                into.iter_mut().zip(from).for_each(|(sum, part)| *sum += weight * part);
            }
            sums = next;
        }
        let of_state =
            |of: &[f64]| -> f64 { of.iter().zip(&self.chances).map(|(z, p)| z * p).sum() };
        sums.chunks(counts).map(of_state).sum::<f64>().ln()
    }

    /// Probabilities that it shows a word at distance 0, 1, … `most` of one of the codes that have so many differing
    /// pairs, by that number: all turns count, and balls around codes do not overlap.
    pub(in crate::family) fn by_pairs(&self, codes: &[u64], most: u32) -> BTreeMap<u32, Vec<f64>> {
        /// Words that are looked at of each radius; of more a part is drawn.
        const LOOKED_AT: f64 = 100_000.0;
        let bits = self.words.dimension().bits();
        let used = bits - self.free.count_ones();
        let step = codes.len().div_ceil(LOOKED_AT as usize).max(1);
        let mut by_pairs = BTreeMap::<u32, Vec<f64>>::new();
        let mut random = ChaCha8Rng::seed_from_u64(u64::from(bits));
        for &code in codes.iter().step_by(step) {
            let pairs = self.words.differing_pairs(code);
            let sums = by_pairs.entry(pairs).or_insert_with(|| vec![0.0; most as usize + 1]);
            for (radius, sum) in (0..).zip(sums) {
                let all =
                    ball(used, radius) - radius.checked_sub(1).map_or(0.0, |less| ball(used, less));
                let share = LOOKED_AT / (codes.len() as f64 * all);
                let chance = if share >= 1.0 {
                    self.sphere(code, radius)
                } else {
                    let drawn = (share * all * step as f64).ceil() as u32;
                    let of_drawn =
                        |_| self.chance(code ^ drawn_subset(bits, self.free, radius, &mut random));
                    (0..drawn).map(of_drawn).sum::<f64>() * all / f64::from(drawn)
                };
                *sum += 3.0 * step as f64 * chance;
            }
        }
        by_pairs
    }
}

impl Family {
    /// Probability that a triangle with a border in a natural picture is taken for a tag, for 0, 1, …,
    /// [`Self::correctable`] corrected bits; `None` of square tags and of place codes. Beside
    /// [`Self::false_positive_rates`], which are those of fair coins. Beyond some 100,000 words the words near the codes
    /// are drawn, always the same ones, and the figures are right to a tenth.
    pub fn natural_false_positive_rates(&self) -> Option<Vec<f64>> {
        if self.kind() != GridKind::Deltille || self.is_of_places() {
            return None;
        }
        let words = NaturalWords::new(self.dimension()).with_free(self.free_cells());
        let by_pairs = words.by_pairs(self.codes(), self.correctable());
        Some(cumulated(by_pairs.values(), self.correctable()))
    }

    /// The largest number of corrected cells with which natural false positives stay below `accepted` for each triangle with
    /// a border, for whoever believes single tags; usually of [`ACCEPTED_FALSE_POSITIVES`]. `None` where they do not even
    /// with nothing corrected, and where natural rates are not known.
    pub fn recommended_correction(&self, accepted: f64) -> Option<u32> {
        corrected_within(&self.natural_false_positive_rates()?, accepted)
    }
}

/// The largest number of corrected cells whose rate is at most `accepted`, of rates for 0, 1, … of them; `None` where there is
/// none.
pub fn corrected_within(rates: &[f64], accepted: f64) -> Option<u32> {
    let fitting = rates.iter().take_while(|rate| **rate <= accepted).count();
    fitting.checked_sub(1).map(|most| most as u32)
}

/// Sums of some rows, then over distances up to each.
pub(in crate::family) fn cumulated<'a>(
    rows: impl Iterator<Item = &'a Vec<f64>>,
    most: u32,
) -> Vec<f64> {
    let mut sums = vec![0.0; most as usize + 1];
    for row in rows {
        sums.iter_mut().zip(row).for_each(|(sum, chance)| *sum += chance);
    }
    let mut total = 0.0;
    for sum in &mut sums {
        total += *sum;
        *sum = total;
    }
    sums
}

/// All words of `bits` bits of which `ones` are set, each next one greater (Gosper).
fn subsets(bits: u32, ones: u32) -> impl Iterator<Item = u64> {
    let all = u64::MAX >> (u64::BITS - bits);
    let first = (1u64 << ones) - 1;
    let next = move |&word: &u64| {
        // Of no ones there is one word.
        let zeros = (ones > 0).then(|| word.trailing_zeros())?;
        let carried = word.checked_add(word & word.wrapping_neg())?;
        let next = carried | ((word ^ carried) >> 2 >> zeros);
        (next <= all).then_some(next)
    };
    std::iter::successors((first <= all).then_some(first), next)
}

/// One of them at random, of cells that are not free.
fn drawn_subset(bits: u32, free: u64, ones: u32, random: &mut ChaCha8Rng) -> u64 {
    let mut word = 0u64;
    while word.count_ones() < ones {
        word |= (1 << random.random_range(0..bits)) & !free;
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::{Decoder, shipped_names};

    /// Rates are those of all words, decoded one by one.
    #[test]
    fn rates_are_those_of_all_words() {
        for name in ["d16h5", "delTag16h5"] {
            let family = Family::shipped(name).unwrap();
            let (decoder, natural) = (Decoder::new(&family), NaturalWords::new(family.dimension()));
            let rates = family.natural_false_positive_rates().unwrap();
            assert_eq!(rates.len(), 3);
            for (errors, rate) in (0..).zip(rates) {
                let taken = (0..1u64 << 16).filter(|&word| decoder.decode(word, errors).is_some());
                let sum: f64 = taken.map(|word| natural.chance(word)).sum();
                assert!((rate - sum).abs() < 1e-9 * sum, "{name}, {errors}: {rate}, {sum}");
            }
        }
    }

    /// The sum over all words, one by one.
    #[test]
    fn the_likelihood_is_that_of_all_words() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for bits in [9, 16] {
            let natural = NaturalWords::new(Dimension::from_bits(bits).unwrap());
            for strength in [0.0, 0.3, 2.6] {
                let odds: Vec<f32> =
                    (0..bits).map(|_| strength * random.random_range(-1.0..1.0)).collect();
                let of = |word: u64| -> f64 {
                    let sign = |bit: u32| if word >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let sum: f64 = (0..bits).map(|b| sign(b) * f64::from(odds[b as usize])).sum();
                    natural.chance(word) * sum.exp()
                };
                let all: f64 = (0..1 << bits).map(of).sum();
                let told = natural.log_likelihood(&odds);
                assert!(
                    (told - all.ln()).abs() < 1e-6,
                    "{bits} bits, {strength}: {told}, {}",
                    all.ln()
                );
            }
        }
    }

    #[test]
    fn drawn_words_tell_what_all_words_tell() {
        let family = Family::shipped("d25h9").unwrap();
        let natural = NaturalWords::new(family.dimension());
        let rates = family.natural_false_positive_rates().unwrap();
        let exact: f64 =
            family.codes().iter().map(|&code| 3.0 * natural.chance_near(code, 4)).sum();
        assert!((rates[4] / exact - 1.0).abs() < 0.02, "{} and {exact}", rates[4]);
    }

    /// The last but one column of a table in `docs/families.md`, “False positives”; and natural pictures are always safer
    /// than fair coins.
    #[test]
    fn limits_of_what_ships_are_those_told() {
        let told = [
            ("d16h5", None),
            ("d25h7", Some(0)),
            ("d25h9", Some(1)),
            ("d36h9", Some(2)),
            ("d36h11", Some(3)),
            ("d49h12", Some(5)),
            ("d64h12", Some(5)),
            ("delTag16h5", None),
            ("delTag25h7", Some(1)),
            ("delTag25h9", Some(1)),
            ("delTag36h9", Some(2)),
            ("delTag36h11", Some(3)),
        ];
        assert_eq!(told.map(|(name, _)| name).to_vec(), shipped_names());
        for (name, limit) in told {
            let family = Family::shipped(name).unwrap();
            assert_eq!(family.recommended_correction(ACCEPTED_FALSE_POSITIVES), limit, "{name}");
            let natural = family.natural_false_positive_rates().unwrap();
            let fair = family.false_positive_rates();
            assert!(natural.iter().zip(fair).all(|(natural, fair)| *natural < fair), "{name}");
        }
    }
}
