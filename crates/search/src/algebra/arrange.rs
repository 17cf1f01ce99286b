//! The assignment of the cycles of a code to the cycles of the tag, by simulated annealing.
//!
//! Permuting cycles, rotating them in place and adding a word that the rotation fixes preserve distances and
//! invariance ([`Arrangement`]). But they determine how many words are complex enough to be tags. Annealing maximises
//! that number over these choices; it finds a good arrangement, not provably the best. All words are judged at once,
//! 64 per machine word, by counting differing neighbours in bit slices.

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use deltille_core::family::algebra::cycles_in;
use deltille_core::family::algebra::{Arrangement, CycleSpace};
use deltille_core::family::{Rules, Screen, TagWords};
use deltille_core::lattice::{Dimension, TagCells};

/// 512 words of the code, one bit each.
type Slice = [u64; 8];

/// Scores the arrangements of one code, and searches for a good one.
#[derive(Clone, Debug)]
pub struct Arranger {
    dimension: Dimension,
    space: CycleSpace,
    words: Vec<u64>,
    /// slices[i][bit]: bit `bit` of words 512·i to 512·i + 511.
    slices: Vec<Vec<Slice>>,
    edges: Vec<[u8; 2]>,
    min_pairs: u32,
    black_distance: u32,
    white_distance: u32,
    free_centre: bool,
    /// Number of differing pairs that a partially counted word may lack, and its contribution to
    /// the count.
    nearly: Option<(u32, f64)>,
    /// Sums of two words of the code that may be too light with hidden cells, one of each orbit.
    sums: Vec<u64>,
    screen: Screen,
    /// Cycles of the tag whose cells are free. The last cycles of the code, which it does not use,
    /// are assigned to them.
    free_cycles: Vec<u8>,
    is_centre_free: bool,
}

impl Arranger {
    /// Prepares the words of a code, in cycle coordinates, one of each orbit. With `free_centre`, the central bit of
    /// each word may be chosen afterwards, and a word counts if either choice satisfies the rules.
    pub fn new(
        dimension: Dimension,
        distance: u32,
        rules: &Rules,
        words: Vec<u64>,
        free_centre: bool,
    ) -> Self {
        let space = CycleSpace::of(dimension);
        let screen = Screen::new(TagWords::new(dimension), distance, rules);
        let free = rules.free.map_or(0, |free| free.mask(dimension));
        let counts = |&[a, b]: &[u8; 2]| (free >> a | free >> b) & 1 == 0;
        let cells = TagCells::new(dimension);
        let edges = cells.neighbours().iter().copied().filter(counts);
        let slices = words
            .chunks(512)
            .map(|chunk| {
                let slice = |bit: u32| {
                    let mut slice = [0; 8];
                    for (i, word) in chunk.iter().enumerate() {
                        slice[i / 64] |= (word >> bit & 1) << (i % 64);
                    }
                    slice
                };
                (0..space.bits()).map(slice).collect()
            })
            .collect();
        Self {
            dimension,
            space,
            slices,
            edges: edges.collect(),
            min_pairs: screen.min_pairs(),
            black_distance: rules.black_distance,
            white_distance: rules.white_distance,
            words,
            free_centre: free_centre && space.centre,
            nearly: None,
            sums: Vec::new(),
            screen,
            free_cycles: cycles_in(dimension, free),
            is_centre_free: free.count_ones() % 3 == 1,
        }
    }

    /// Takes into account sums of two words of the code, in cycle coordinates. Hidden cells may
    /// make these sums too light. Of n words, at least n / (1 + s) are compatible if s sums are too
    /// light.
    pub fn with_sums(mut self, mut sums: Vec<u64>) -> Self {
        sums.retain(|&word| self.space.canonical(word) == word);
        self.sums = sums;
        self
    }

    /// Returns a lower bound for the fraction of words that are compatible with hidden cells.
    fn share_apart(&self, arrangement: &Arrangement) -> f64 {
        if self.sums.is_empty() {
            return 1.0;
        }
        let plain = Arrangement { inverted: 0, ..arrangement.clone() };
        let on_tag = plain.apply(self.dimension, &self.sums);
        let light = on_tag.into_iter().filter(|&word| !self.screen.is_apart(word)).count();
        1.0 / (1.0 + light as f64)
    }

    /// Counts a word that lacks up to `pairs` differing pairs as the fraction `worth` of a word,
    /// for the annealing only. If the code has distance to spare, changing one cell may repair the
    /// word.
    pub fn with_nearly(mut self, pairs: u32, worth: f64) -> Self {
        self.nearly = Some((pairs.min(self.min_pairs), worth));
        self
    }

    /// Returns the number of words that satisfy the rules under an arrangement.
    pub fn score(&self, arrangement: &Arrangement) -> u32 {
        let weights = self.weights(arrangement.inverted);
        self.count(arrangement, &weights, self.min_pairs)
    }

    /// Returns the guaranteed number of codes of an arrangement; with hidden cells, only some of the words that
    /// satisfy the rules are compatible.
    pub fn sure(&self, arrangement: &Arrangement) -> usize {
        (self.share_apart(arrangement) * f64::from(self.score(arrangement))) as usize
    }

    /// Computes the objective of the annealing.
    fn worth(&self, arrangement: &Arrangement, weights: &[Slice]) -> f64 {
        let share = self.share_apart(arrangement);
        let good = share * f64::from(self.count(arrangement, weights, self.min_pairs));
        self.nearly.map_or(good, |(pairs, worth)| {
            let nearly =
                share * f64::from(self.count(arrangement, weights, self.min_pairs - pairs));
            good + worth * (nearly - good)
        })
    }

    /// Computes the objective of [`Self::anneal`] for one arrangement.
    pub fn judge(&self, arrangement: &Arrangement) -> f64 {
        self.worth(arrangement, &self.weights(arrangement.inverted))
    }

    /// Returns the number of cycles that can be arranged: the first ones, as those on free cells are fixed.
    fn movable(&self) -> usize {
        self.space.cycles as usize - self.free_cycles.len()
    }

    /// Returns the number of cycles that may be inverted, including the central bit unless it is free or chosen for
    /// each word.
    fn flips(&self) -> u32 {
        let centre = self.space.centre && !self.free_centre && !self.is_centre_free;
        self.movable() as u32 + u32::from(centre)
    }

    /// Returns an arrangement that differs in one choice.
    pub fn changed(&self, arrangement: &Arrangement, random: &mut impl Rng) -> Arrangement {
        let n = self.movable();
        let mut next = arrangement.clone();
        match random.random_range(0..10) {
            0..4 => next.places.swap(random.random_range(0..n), random.random_range(0..n)),
            4..7 => {
                let start = &mut next.starts[random.random_range(0..n)];
                *start = (*start + random.random_range(1..3)) % 3;
            }
            _ => next.inverted ^= 1 << random.random_range(0..self.flips()),
        }
        next
    }

    /// Returns the words that are far enough from all black and all white, as bit slices; the positions of cycles do
    /// not matter for this.
    fn weights(&self, inverted: u32) -> Vec<Slice> {
        let translation =
            Arrangement { inverted, ..Arrangement::plain(self.space) }.translation(self.space);
        let bits = self.space.bits();
        let centre = u64::from(self.free_centre) << (bits - 1);
        let fine = |word: u64| {
            // With a free centre, the better choice counts.
            let white = (word | centre).count_ones();
            let black = bits - (word & !centre).count_ones();
            white >= self.black_distance && black >= self.white_distance
        };
        self.words
            .chunks(512)
            .map(|chunk| {
                let mut slice = [0; 8];
                for (i, word) in chunk.iter().enumerate() {
                    slice[i / 64] |= u64::from(fine(word ^ translation)) << (i % 64);
                }
                slice
            })
            .collect()
    }

    fn count(&self, arrangement: &Arrangement, weights: &[Slice], min_pairs: u32) -> u32 {
        let to_tag = arrangement.bit_map(self.dimension);
        let mut code_bit = [0u8; 64];
        (0..).zip(&to_tag).for_each(|(i, &to)| code_bit[usize::from(to)] = i);
        let inverted = arrangement.translation(self.space);
        // For each edge between cells of the tag: the two bits of the code, and whether exactly one of them is
        // inverted.
        let edges: Vec<(u8, u8, u64)> = self
            .edges
            .iter()
            .map(|&[a, b]| {
                let (a, b) = (code_bit[usize::from(a)], code_bit[usize::from(b)]);
                let flip = (inverted >> a ^ inverted >> b) & 1;
                (a, b, flip.wrapping_neg())
            })
            .collect();
        let centre = self.free_centre.then(|| self.space.bits() as u8 - 1);
        self.slices
            .iter()
            .zip(weights)
            .map(|(slices, weights)| {
                let mut pass = enough(&edges, slices, centre, 0, min_pairs);
                if centre.is_some() {
                    let other = enough(&edges, slices, centre, u64::MAX, min_pairs);
                    pass = std::array::from_fn(|i| pass[i] | other[i]);
                }
                pass.iter().zip(weights).map(|(p, w)| (p & w).count_ones()).sum::<u32>()
            })
            .sum()
    }

    /// Anneals from a random arrangement, and returns the best objective and arrangement found. The objective is the
    /// number of words that satisfy the rules, plus the contribution of [`Arranger::with_nearly`]. The result depends
    /// only on `seed` and `steps`, unless `halt` returns true and ends the search early.
    pub fn anneal(&self, seed: u64, steps: u32, halt: impl Fn() -> bool) -> (f64, Arrangement) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let flips = self.flips();
        let mut now = Arrangement::plain(self.space);
        now.places.retain(|place| !self.free_cycles.contains(place));
        now.places.shuffle(&mut random);
        now.places.extend(&self.free_cycles);
        now.starts.iter_mut().for_each(|s| *s = random.random_range(0..3));
        now.inverted = random.random_range(0..1 << flips);
        let mut weights = self.weights(now.inverted);
        let mut score = self.worth(&now, &weights);
        let mut best = (score, now.clone());
        // The temperature decreases geometrically from the standard deviation of random scores to
        // that of single words.
        let hot = (self.words.len() as f64).sqrt().max(2.0) * 0.5;
        for step in 0..steps {
            if halt() {
                break;
            }
            let temperature = hot * (0.3 / hot).powf(f64::from(step) / f64::from(steps));
            let next = self.changed(&now, &mut random);
            let other = (next.inverted != now.inverted).then(|| self.weights(next.inverted));
            let next_score = self.worth(&next, other.as_ref().unwrap_or(&weights));
            let gain = next_score - score;
            if gain >= 0.0 || random.random::<f64>() < (gain / temperature).exp() {
                (now, score) = (next, next_score);
                weights = other.unwrap_or(weights);
                if score > best.0 {
                    best = (score, now.clone());
                }
            }
        }
        best
    }
}

/// Returns the words of a slice that have at least `min_pairs` pairs of differing neighbours, as a bit slice.
///
/// Counting starts at 64 − `min_pairs` and adds one for each differing pair, so it overflows into
/// bit 6 if and only if there are enough. With the 84 pairs of 64 cells, it overflows from 128 into
/// bit 7. Seven full adders process eight
/// pairs at a time.
fn enough(
    edges: &[(u8, u8, u64)],
    slices: &[Slice],
    centre: Option<u8>,
    centre_value: u64,
    min_pairs: u32,
) -> Slice {
    let last = if edges.len() < 64 { 6 } else { 7 };
    let start = (1 << last) - min_pairs;
    let mut count: [Slice; 8] =
        std::array::from_fn(|bit| [u64::from(start >> bit & 1).wrapping_neg(); 8]);
    let value = |bit: u8| {
        if Some(bit) == centre { [centre_value; 8] } else { slices[usize::from(bit)] }
    };
    for eight in edges.chunks(8) {
        let mut x = [[0u64; 8]; 8];
        for (x, &(a, b, flip)) in x.iter_mut().zip(eight) {
            let (a, b) = (value(a), value(b));
            *x = std::array::from_fn(|i| a[i] ^ b[i] ^ flip);
        }
        let [twos_a, twos_b, twos_c, twos_d] =
            [0, 2, 4, 6].map(|i| add(&mut count[0], &x[i], &x[i + 1]));
        let fours_a = add(&mut count[1], &twos_a, &twos_b);
        let fours_b = add(&mut count[1], &twos_c, &twos_d);
        let mut carry = add(&mut count[2], &fours_a, &fours_b);
        for digit in &mut count[3..=last] {
            let sum: Slice = std::array::from_fn(|i| digit[i] ^ carry[i]);
            carry = std::array::from_fn(|i| digit[i] & carry[i]);
            *digit = sum;
        }
    }
    count[last]
}

/// Adds two slices to a binary digit (a full adder) and returns the carries.
#[inline(always)]
fn add(digit: &mut Slice, a: &Slice, b: &Slice) -> Slice {
    let mut carry = [0; 8];
    for i in 0..8 {
        let half = digit[i] ^ a[i];
        carry[i] = (digit[i] & a[i]) | (half & b[i]);
        digit[i] = half ^ b[i];
    }
    carry
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bit_slices_count_what_the_screen_admits() {
        for (rows, distance) in [(4, 5), (5, 7), (6, 9), (7, 12), (8, 12)] {
            let dimension = Dimension::from_bits(rows * rows).unwrap();
            let mut random = ChaCha8Rng::seed_from_u64(7);
            let words: Vec<u64> =
                (0..700).map(|_| random.random::<u64>() & dimension.mask()).collect();
            let rules = Rules::published(distance);
            let screen = Screen::new(TagWords::new(dimension), distance, &rules);
            let arranger = Arranger::new(dimension, distance, &rules, words.clone(), false);
            let (score, arrangement) = arranger.anneal(3, 20, || false);
            let score = score as usize;
            let fine = |words: &[u64]| words.iter().filter(|&&w| screen.look_is_fine(w)).count();
            assert_eq!(score, fine(&arrangement.apply(dimension, &words)));
        }
    }
}
