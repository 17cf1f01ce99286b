//! Words of the tags of a target, and the evidence of a tile's cells for each.

use deltille_core::family::Family;

/// Weight of the cell frequencies of the family relative to those of the target, as a number of
/// codes.
const FAMILY_WEIGHT: f64 = 16.0;

/// Minimum distance of a frequency from 0 and 1.
const MIN_FREQUENCY: f64 = 0.05;

/// Codes of a target in all rotations.
#[derive(Clone, Debug)]
pub(crate) struct TargetWords {
    ids: Vec<u32>,
    rotations: usize,
    /// Code i rotated k times is word i · turns + k.
    words: Vec<u64>,
    /// Frequency of white in each cell, by rotation.
    frequencies: Vec<Vec<f32>>,
}

impl TargetWords {
    /// Creates the words of some codes of a family.
    pub(crate) fn new(family: &Family, ids: Vec<u32>) -> Self {
        let cells = family.cells();
        let rotations = usize::from(family.kind().rotations());
        let bits = family.dimension().bits() as usize;
        let all_turns = |code: u64| {
            let mut all = vec![code];
            while all.len() < rotations {
                all.push(cells.rotate(all[all.len() - 1]));
            }
            all
        };
        let words: Vec<u64> =
            ids.iter().flat_map(|&id| all_turns(family.code(id).unwrap_or(0))).collect();
        let white = |codes: &mut dyn Iterator<Item = u64>| {
            let mut counts = vec![0.0; bits];
            for code in codes {
                for (bit, count) in counts.iter_mut().enumerate() {
                    *count += f64::from((code >> bit & 1) as u8);
                }
            }
            counts
        };
        let of_family = white(&mut family.codes().iter().copied());
        let of_target = white(&mut ids.iter().filter_map(|&id| family.code(id)));
        let frequency = |bit: usize| {
            let in_family = of_family[bit] / family.codes().len().max(1) as f64;
            let frequency =
                (of_target[bit] + FAMILY_WEIGHT * in_family) / (ids.len() as f64 + FAMILY_WEIGHT);
            frequency.clamp(MIN_FREQUENCY, 1.0 - MIN_FREQUENCY) as f32
        };
        let mut frequencies = vec![(0..bits).map(frequency).collect::<Vec<f32>>()];
        while frequencies.len() < rotations {
            let last = &frequencies[frequencies.len() - 1];
            frequencies
                .push(cells.rotation().iter().map(|&from| last[usize::from(from)]).collect());
        }
        Self { ids, rotations, words, frequencies }
    }

    /// Returns the number of words.
    pub(crate) fn len(&self) -> usize {
        self.words.len()
    }

    /// Returns the number of rotations of a code.
    pub(crate) fn rotations(&self) -> usize {
        self.rotations
    }

    /// Returns the index of the code with an id.
    pub(crate) fn code_of(&self, id: u32) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// Returns all words.
    pub(crate) fn iter(&self) -> impl Iterator<Item = u64> {
        self.words.iter().copied()
    }

    /// Returns a word.
    pub(crate) fn word(&self, index: usize) -> u64 {
        self.words[index]
    }

    /// Returns Λ of every word, nats: the log-likelihood ratio of the word to words drawn from the
    /// cell frequencies.
    pub(crate) fn evidence(&self, half_odds: &[f32]) -> Vec<f32> {
        let unrelated = self.unrelated(half_odds);
        let products = self.products(half_odds).into_iter().enumerate();
        products.map(|(index, product)| product - unrelated[index % self.rotations]).collect()
    }

    /// Returns the sum of these values over the cells, positive for white ones and negative for black ones, of every
    /// word.
    pub(crate) fn products(&self, values: &[f32]) -> Vec<f32> {
        let bytes = values.len().div_ceil(8);
        // Sum of the values of the white cells, for each value of each byte of 8 cells.
        let mut sums = vec![[0.0f32; 256]; bytes];
        for (byte, sums) in sums.iter_mut().enumerate() {
            for value in 1..256usize {
                let lowest = value.trailing_zeros() as usize;
                let of_lowest = values.get(8 * byte + lowest).copied().unwrap_or(0.0);
                sums[value] = sums[value & (value - 1)] + of_lowest;
            }
        }
        let total: f32 = values.iter().sum();
        let product = |&word: &u64| {
            let white: f32 = sums
                .iter()
                .enumerate()
                .map(|(byte, sums)| sums[(word >> (8 * byte) & 0xff) as usize])
                .sum();
            2.0 * white - total
        };
        self.words.iter().map(product).collect()
    }

    /// Returns Λ of any word, nats.
    pub(crate) fn evidence_of(&self, word: u64, half_odds: &[f32]) -> f32 {
        let sign = |bit: usize| if word >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let sum: f32 = half_odds.iter().enumerate().map(|(bit, odds)| sign(bit) * odds).sum();
        sum - self.unrelated(half_odds)[0]
    }

    /// Returns Σ ln( p e^l + (1 − p) e^−l ), by rotation.
    fn unrelated(&self, half_odds: &[f32]) -> Vec<f32> {
        let of_turn = |frequencies: &Vec<f32>| {
            let cells = half_odds.iter().zip(frequencies);
            cells.map(|(l, p)| (p * l.exp() + (1.0 - p) * (-l).exp()).ln()).sum()
        };
        self.frequencies.iter().map(of_turn).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;

    /// For any tile, the mean of e^Λ over words drawn from the cell frequencies is 1. By Markov's
    /// inequality, e^Λ of noise exceeds n less often than once in n. Computed together or one by
    /// one, Λ is the same.
    #[test]
    fn the_mean_evidence_of_drawn_words_is_one() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let family = Family::shipped("d16h5").unwrap();
        let words = TargetWords::new(&family, vec![0, 2, 5]);
        let bits = family.dimension().bits();
        for strength in [0.2, 1.0, 2.6] {
            let half_odds: Vec<f32> =
                (0..bits).map(|_| strength * rng.random_range(-1.0..1.0)).collect();
            let chance = |word: u64| -> f64 {
                let cells = words.frequencies[0].iter().enumerate();
                let of = |(bit, &p): (usize, &f32)| if word >> bit & 1 == 1 { p } else { 1.0 - p };
                cells.map(|cell| f64::from(of(cell))).product()
            };
            let evidence = |word| f64::from(words.evidence_of(word, &half_odds));
            let mean: f64 = (0..1u64 << bits).map(|word| chance(word) * evidence(word).exp()).sum();
            assert!((mean - 1.0).abs() < 1e-3, "{strength}: {mean}");
            let all = words.evidence(&half_odds);
            for code in 0..words.ids.len() {
                let index = code * words.rotations();
                let single = words.evidence_of(words.word(index), &half_odds);
                assert!((all[index] - single).abs() < 1e-4, "{strength}, code {code}");
            }
        }
    }
}
