//! False positives in natural images, which are rarer than for fair coin tosses.
//!
//! Neighbouring cells of content that is not a tag are mostly equal. The probability of the word w in a bordered
//! triangle cut from a natural image depends only on its number of differing pairs c(w),
//!
//! ```text
//!     P(w) = P(c = c(w)) / |{v : c(v) = c(w)}|
//! ```
//!
//! with the distribution of c that `families/natural/sample.py` measured in 32 photographs. It predicts the rate of
//! natural words within t cells of a code to 10 %, and for other photographs within a factor of 3
//! ([`NATURAL_FACTOR`]; `docs/families.md`, “False positives”).
//!
//! Limits: triangular tags only. Textures have higher rates than the mean, grass 2.4 times as high.
//! Tags of other families are not natural images.

use std::collections::BTreeMap;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::family::rules::parts;
use crate::family::{Family, TagWords, ball};
use crate::lattice::{Dimension, GridKind};

/// Natural false positive rate per bordered triangle that [`Family::recommended_correction`] accepts: one in 10,000.
/// With [`TRIANGLES_PER_MEGAPIXEL`], a false tag then occurs less than once in 40,000 megapixels.
pub const ACCEPTED_FALSE_POSITIVES: f64 = 1e-4;

/// Upper limit of triangles in natural images that the detector reads as tags, per megapixel. It found no grid in
/// 12.8 megapixels of photographs, which has a probability of 4 % at this rate.
pub const TRIANGLES_PER_MEGAPIXEL: f64 = 0.25;

/// Accuracy of the natural false positive rates as a factor for other images. Largest deviations in images that were
/// not used for the model: 2.6 times fewer than predicted (d36h11, five corrected cells), 3 times more (d49h12),
/// others 1.8.
pub const NATURAL_FACTOR: f64 = 3.0;

/// One line per number of cells: that number, and ln P of a word by the number of its differing pairs.
const TABLE: &str = include_str!("../../../families/natural/words.txt");

/// Probabilities of words in natural images.
///
/// ```
/// use deltille_core::family::NaturalWords;
/// use deltille_core::lattice::Dimension;
///
/// let words = NaturalWords::new(Dimension::from_bits(9)?);
/// let all: f64 = (0..1 << 9).map(|word| words.probability(word)).sum();
/// assert!((all - 1.0).abs() < 0.01, "{all}");
/// assert!(words.probability(0) > 100.0 * words.probability(0b0_1010_1010));
/// # Ok::<(), deltille_core::lattice::DimensionError>(())
/// ```
#[derive(Clone, Debug)]
pub struct NaturalWords {
    words: TagWords,
    /// Probability P by number of differing pairs.
    chances: Vec<f64>,
    /// Cells with arbitrary content.
    free: u64,
}

impl NaturalWords {
    /// Creates the model for triangular tags of a dimension.
    pub fn new(dimension: Dimension) -> Self {
        let bits = dimension.bits().to_string();
        let of_bits = |line: &&str| line.split(' ').next() == Some(&bits);
        let line = TABLE.lines().find(of_bits).unwrap_or_default();
        let logs = line.split(' ').skip(1).filter_map(|log| log.parse::<f64>().ok());
        let chances = logs.map(f64::exp).collect();
        Self { words: TagWords::new(dimension), chances, free: 0 }
    }

    /// Declares cells with arbitrary content; they are black in every word.
    #[must_use]
    pub fn with_free(self, free: u64) -> Self {
        Self { free, ..self }
    }

    /// Returns the probability that a bordered triangle contains a word.
    pub fn probability(&self, word: u64) -> f64 {
        let shown = parts(self.free).map(|part| self.words.differing_pairs(word | part));
        shown.map(|pairs| self.chances[pairs as usize]).sum()
    }

    /// Returns the probability that a bordered triangle contains a word within `errors` cells of a
    /// code in one of its rotations. Enumerates all these words.
    pub fn probability_near(&self, code: u64, errors: u32) -> f64 {
        (0..=errors).map(|radius| self.sphere(code, radius)).sum()
    }

    /// Returns the probability of the words that differ from a code in exactly `radius` cells.
    fn sphere(&self, code: u64, radius: u32) -> f64 {
        let bits = self.words.dimension().bits();
        let used = subsets(bits, radius).filter(|flips| flips & self.free == 0);
        used.map(|flips| self.probability(code ^ flips)).sum()
    }

    /// Returns ln Σ P(w) exp Σ l s(w) over all words w, with the half log-odds l that cells are white and s = ±1 for
    /// white and black cells. This is the log-likelihood of the measurement in natural images, up to the same factor
    /// that Σ l s has for a code. `half_odds` are by bit.
    ///
    /// The sums proceed cell by cell from the base to the apex. They are grouped by the number of
    /// differing pairs so far, and by the colours of cells with a later neighbour: inverted ones
    /// below, and the one to the left.
    pub fn log_likelihood(&self, half_odds: &[f32]) -> f64 {
        let rows = self.words.dimension().rows();
        let (counts, states) = (self.chances.len(), 1usize << rows);
        // The last bit of a state is the colour of the cell to the left; bit c is that of the inverted cell of column
        // c.
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

    /// Returns the probabilities of a word at distance 0, 1, … `most` from one of the codes, by the codes' number of
    /// differing pairs. All rotations count, and balls around codes do not overlap.
    pub(in crate::family) fn by_pairs(&self, codes: &[u64], most: u32) -> BTreeMap<u32, Vec<f64>> {
        /// Number of words evaluated for each radius; if there are more, a sample is drawn.
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
                    let of_drawn = |_| {
                        self.probability(code ^ drawn_subset(bits, self.free, radius, &mut random))
                    };
                    (0..drawn).map(of_drawn).sum::<f64>() * all / f64::from(drawn)
                };
                *sum += 3.0 * step as f64 * chance;
            }
        }
        by_pairs
    }
}

impl Family {
    /// Returns the probability that a bordered triangle in a natural image is mistaken for a tag, for 0, 1, …,
    /// [`Self::correctable`] corrected bits. Returns `None` for square tags and position codes. In contrast,
    /// [`Self::false_positive_rates`] assumes fair coin tosses. Above about 100,000 words, the
    /// words near the codes
    /// are sampled, always in the same way; the rates are then accurate to 10 %.
    pub fn natural_false_positive_rates(&self) -> Option<Vec<f64>> {
        if self.kind() != GridKind::Deltille || self.is_position_family() {
            return None;
        }
        let words = NaturalWords::new(self.dimension()).with_free(self.free_cells());
        let by_pairs = words.by_pairs(self.codes(), self.correctable());
        Some(cumulated(by_pairs.values(), self.correctable()))
    }

    /// Returns the largest number of corrected cells at which the natural false positive rate per bordered triangle
    /// is at most `accepted`, for programs that trust single tags. The usual limit is [`ACCEPTED_FALSE_POSITIVES`].
    /// Returns `None` if the rate is larger without correction, or unknown.
    pub fn recommended_correction(&self, accepted: f64) -> Option<u32> {
        corrected_within(&self.natural_false_positive_rates()?, accepted)
    }
}

/// Returns the largest number of corrected cells whose rate is at most `accepted`, from rates for 0, 1, … of them;
/// `None` if there is none.
pub fn corrected_within(rates: &[f64], accepted: f64) -> Option<u32> {
    let fitting = rates.iter().take_while(|rate| **rate <= accepted).count();
    fitting.checked_sub(1).map(|most| most as u32)
}

/// Sums rows, then accumulates over distances.
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

/// Returns all words of `bits` bits with `ones` set, in increasing order (Gosper).
fn subsets(bits: u32, ones: u32) -> impl Iterator<Item = u64> {
    let all = u64::MAX >> (u64::BITS - bits);
    let first = (1u64 << ones) - 1;
    let next = move |&word: &u64| {
        // With no ones, there is one word.
        let zeros = (ones > 0).then(|| word.trailing_zeros())?;
        let carried = word.checked_add(word & word.wrapping_neg())?;
        let next = carried | ((word ^ carried) >> 2 >> zeros);
        (next <= all).then_some(next)
    };
    std::iter::successors((first <= all).then_some(first), next)
}

/// Draws a random word of `bits` bits with `ones` set, all in cells that are not free.
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

    /// Compares the rates with those of all words, decoded one by one.
    #[test]
    fn rates_match_enumeration() {
        for name in ["d16h5", "delTag16h5"] {
            let family = Family::shipped(name).unwrap();
            let (decoder, natural) = (Decoder::new(&family), NaturalWords::new(family.dimension()));
            let rates = family.natural_false_positive_rates().unwrap();
            assert_eq!(rates.len(), 3);
            for (errors, rate) in (0..).zip(rates) {
                let taken = (0..1u64 << 16).filter(|&word| decoder.decode(word, errors).is_some());
                let sum: f64 = taken.map(|word| natural.probability(word)).sum();
                assert!((rate - sum).abs() < 1e-9 * sum, "{name}, {errors}: {rate}, {sum}");
            }
        }
    }

    /// Compares with the sum over all words, one by one.
    #[test]
    fn the_likelihood_matches_enumeration() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for bits in [9, 16] {
            let natural = NaturalWords::new(Dimension::from_bits(bits).unwrap());
            for strength in [0.0, 0.3, 2.6] {
                let odds: Vec<f32> =
                    (0..bits).map(|_| strength * random.random_range(-1.0..1.0)).collect();
                let of = |word: u64| -> f64 {
                    let sign = |bit: u32| if word >> bit & 1 == 1 { 1.0 } else { -1.0 };
                    let sum: f64 = (0..bits).map(|b| sign(b) * f64::from(odds[b as usize])).sum();
                    natural.probability(word) * sum.exp()
                };
                let all: f64 = (0..1 << bits).map(of).sum();
                let result = natural.log_likelihood(&odds);
                assert!(
                    (result - all.ln()).abs() < 1e-6,
                    "{bits} bits, {strength}: {result}, {}",
                    all.ln()
                );
            }
        }
    }

    #[test]
    fn sampled_rates_match_enumeration() {
        let family = Family::shipped("d25h9").unwrap();
        let natural = NaturalWords::new(family.dimension());
        let rates = family.natural_false_positive_rates().unwrap();
        let exact: f64 =
            family.codes().iter().map(|&code| 3.0 * natural.probability_near(code, 4)).sum();
        assert!((rates[4] / exact - 1.0).abs() < 0.02, "{} and {exact}", rates[4]);
    }

    /// Tests the last but one column of a table in `docs/families.md`, “False positives”,
    /// and that the rate in natural images is always lower than for fair coin tosses.
    #[test]
    fn recommended_limits_match_the_documentation() {
        let result = [
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
        assert_eq!(result.map(|(name, _)| name).to_vec(), shipped_names());
        for (name, limit) in result {
            let family = Family::shipped(name).unwrap();
            assert_eq!(family.recommended_correction(ACCEPTED_FALSE_POSITIVES), limit, "{name}");
            let natural = family.natural_false_positive_rates().unwrap();
            let fair = family.false_positive_rates();
            assert!(natural.iter().zip(fair).all(|(natural, fair)| *natural < fair), "{name}");
        }
    }
}
