//! Binary linear codes: bases, cosets and syndromes.

use super::LinearMap;

/// A binary linear code of length up to 64, stored as a reduced basis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// Rows with distinct leading bits, each leading bit set in its own row only; in decreasing order.
    rows: Vec<u64>,
}

impl Span {
    /// Creates the linear span of some words.
    pub fn of(words: impl IntoIterator<Item = u64>) -> Self {
        let mut span = Self::default();
        for word in words {
            span.insert(word);
        }
        span
    }

    /// Returns the dimension of the code.
    pub fn dimension(&self) -> u32 {
        self.rows.len() as u32
    }

    /// Returns the reduced basis (reduced row echelon form), by decreasing leading bit.
    pub fn rows(&self) -> &[u64] {
        &self.rows
    }

    /// Returns the representative of the coset of a word: the one that is zero at the leading bit of every row.
    pub fn reduce(&self, word: u64) -> u64 {
        self.rows.iter().fold(
            word,
            |word, &row| {
                if word >> row.ilog2() & 1 == 1 { word ^ row } else { word }
            },
        )
    }

    /// Returns whether the word is in the code.
    pub fn contains(&self, word: u64) -> bool {
        self.reduce(word) == 0
    }

    /// Adds a word to the span; returns false if the span already contained it.
    pub fn insert(&mut self, word: u64) -> bool {
        let word = self.reduce(word);
        if word == 0 {
            return false;
        }
        let lead = word.ilog2();
        for row in &mut self.rows {
            if *row >> lead & 1 == 1 {
                *row ^= word;
            }
        }
        let place = self.rows.partition_point(|&row| row > word);
        self.rows.insert(place, word);
        true
    }

    /// Returns all code words, each once, zero first, in Gray code order.
    pub fn words(&self) -> impl Iterator<Item = u64> + '_ {
        let mut word = 0;
        (0u64..1 << self.rows.len()).map(move |i| {
            if i > 0 {
                word ^= self.rows[i.trailing_zeros() as usize];
            }
            word
        })
    }

    /// Returns the subcode of words that are zero at every bit set in `mask`.
    pub fn vanishing_on(&self, mask: u64) -> Self {
        // Elimination on the masked bits: the remaining rows are zero there.
        let mut rows = self.rows.clone();
        let mut kept = Vec::new();
        while let Some(row) = rows.pop() {
            if row & mask == 0 {
                kept.push(row);
                continue;
            }
            let lead = (row & mask).ilog2();
            for other in &mut rows {
                if *other >> lead & 1 == 1 {
                    *other ^= row;
                }
            }
        }
        Self::of(kept)
    }

    /// Returns the dual code: the words of `length` bits that share an even number of set bits with every code word.
    pub fn dual(&self, length: u32) -> Self {
        // Each generator has one free bit and the leading bits of the rows that contain it.
        Self::of(self.free_bits(length).into_iter().map(|bit| {
            let rows = self.rows.iter().filter(|&row| row >> bit & 1 == 1);
            rows.fold(1 << bit, |word, row| word | 1 << row.ilog2())
        }))
    }

    /// Returns the bits of a word of `length` bits that lead no row, in increasing order; their values identify a
    /// coset.
    pub fn free_bits(&self, length: u32) -> Vec<u32> {
        let leading = self.rows.iter().fold(0u64, |bits, row| bits | 1 << row.ilog2());
        (0..length).filter(|i| leading >> i & 1 == 0).collect()
    }

    /// Returns the map from words of `length` bits to syndromes: the free bits of the coset representative, adjacent,
    /// in the order of [`Span::free_bits`]. Returns `None` if there are more than 32 of them.
    pub fn syndromes(&self, length: u32) -> Option<LinearMap> {
        let free_bits = self.free_bits(length);
        let syndrome = |word: u64| {
            (0..).zip(&free_bits).fold(0, |s, (i, bit)| s | ((word >> bit & 1) as u32) << i)
        };
        let columns: Vec<u32> = (0..length).map(|i| syndrome(self.reduce(1 << i))).collect();
        (free_bits.len() <= 32).then(|| LinearMap::of_columns(&columns))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn spans_are_closed_and_shorten_rightly(words: [u16; 5], mask: u16) {
            let span = Span::of(words.map(u64::from));
            let all: Vec<u64> = span.words().collect();
            prop_assert_eq!(all.len(), 1 << span.dimension());
            prop_assert!(words.iter().all(|&w| span.contains(u64::from(w))));
            prop_assert!(all.iter().all(|&w| all.contains(&(w ^ u64::from(words[0])))));
            let short = span.vanishing_on(u64::from(mask));
            let expected = all.iter().filter(|&&w| w & u64::from(mask) == 0).count();
            prop_assert_eq!(1 << short.dimension(), expected);
            let dual = span.dual(16);
            prop_assert_eq!(dual.dimension(), 16 - span.dimension());
            prop_assert!(dual.words().all(|w| words.iter().all(|&v| (w & u64::from(v)).count_ones() % 2 == 0)));
            prop_assert!(short.words().all(|w| span.contains(w) && w & u64::from(mask) == 0));
        }
    }
}
