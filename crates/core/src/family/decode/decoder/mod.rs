//! Search for the code closest to a word that was read.

mod blocks;
mod syndromes;

use blocks::Blocks;
use syndromes::Syndromes;

use crate::family::{Family, TagWords};
use crate::lattice::GridKind;

/// A word decoded as a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Decoded {
    /// Id of the tag.
    pub id: u32,
    /// Number of counterclockwise rotations of the tag that give the word: by 120°, 0 to 2, or by 90° for a square
    /// tag, 0 to 3.
    pub rotations: u8,
    /// Number of cells in which the word differs from the code.
    pub errors: u32,
    /// Errors of the second-best reading (another tag or another rotation), if it is also within the allowed errors.
    /// This is impossible up to ⌊(h−1)/2⌋ allowed errors; any other reading then has at least h − `errors`.
    pub runner_up: Option<u32>,
}

/// Finds the code closest to a word, in any rotation.
///
/// The decoder compares the bits in blocks. For very large families made from a linear code, it uses the syndrome of
/// the word instead. Both give the same answers. Square families are small, so every code is compared.
#[derive(Clone, Debug)]
pub struct Decoder {
    /// Largest number of errors at which the closest code is always unique.
    correctable: u32,
    kind: GridKind,
    /// Cells that no code uses; their content is ignored.
    free: u64,
    words: TagWords,
    codes: Vec<u64>,
    search: Search,
}

#[derive(Clone, Debug)]
enum Search {
    Blocks(Blocks),
    Syndromes(Box<Syndromes>),
    Every,
}

impl Decoder {
    /// Creates a decoder for `family` with the faster method. Memory is proportional to the number of codes and of
    /// correctable error patterns.
    pub fn new(family: &Family) -> Self {
        if family.kind() == GridKind::Checker {
            return Self::with(family, Search::Every);
        }
        let syndromes = (Blocks::cost(family) > Syndromes::cost(family))
            .then(|| Syndromes::new(family))
            .flatten();
        Self::with(
            family,
            match syndromes {
                Some(syndromes) => Search::Syndromes(Box::new(syndromes)),
                None => Search::Blocks(Blocks::new(family)),
            },
        )
    }

    /// Creates a decoder that compares blocks, for any family of triangular tags.
    pub fn by_blocks(family: &Family) -> Self {
        Self::with(family, Search::Blocks(Blocks::new(family)))
    }

    /// Creates a decoder by syndromes; `None` if the family was not made from a linear code.
    pub fn by_syndromes(family: &Family) -> Option<Self> {
        Syndromes::new(family).map(|s| Self::with(family, Search::Syndromes(Box::new(s))))
    }

    fn with(family: &Family, search: Search) -> Self {
        Self {
            correctable: family.correctable(),
            kind: family.kind(),
            free: family.free_cells(),
            words: TagWords::of(family.kind(), family.dimension()),
            codes: family.codes().to_vec(),
            search,
        }
    }

    /// Returns the closest code within `max_errors` cells of `word`, if any.
    ///
    /// Up to ⌊(h−1)/2⌋ errors the answer is unique. Beyond that, every code is compared; ties go to
    /// the lower id, then to
    /// fewer rotations, and appear in `runner_up`.
    #[inline]
    pub fn decode(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        let word = word & !self.free;
        if max_errors > self.correctable {
            return self.decode_beyond(word, max_errors);
        }
        match &self.search {
            Search::Blocks(blocks) => blocks.decode(word, max_errors),
            Search::Every => self.decode_beyond(word, max_errors),
            Search::Syndromes(syndromes) => syndromes.decode(&self.codes, word, max_errors),
        }
    }

    /// Returns the closest code in the visible cells; those of `hidden` are ignored. Returns `None` if no code is
    /// within `max_errors` of the visible cells, or a second reading is equally close.
    ///
    /// Every code is compared. If the visible cells keep a distance of h ([`Family::distance_without`]), up to
    /// ⌊(h−1)/2⌋ misread cells among them can always be corrected.
    ///
    /// ```
    /// use deltille_core::family::{Decoder, Family, HiddenCells};
    ///
    /// let family = Family::shipped("d25h9")?;
    /// let decoder = Decoder::new(&family);
    /// // A finger covers an edge, which reads as white, and one more cell is misread.
    /// let edge = HiddenCells::Edge.masks(family.dimension())[0];
    /// let read = (family.code(12).unwrap() | edge) ^ 1 << 24;
    /// let decoded = decoder.decode_erased(read, edge, 1).unwrap();
    /// assert_eq!((decoded.id, decoded.errors), (12, 1));
    /// # Ok::<(), deltille_core::family::FamilyError>(())
    /// ```
    pub fn decode_erased(&self, word: u64, hidden: u64, max_errors: u32) -> Option<Decoded> {
        let found = self.nearest(word, hidden | self.free, max_errors)?;
        (found.runner_up != Some(found.errors)).then_some(found)
    }

    /// Returns the word of a decoded code, without its errors.
    pub fn word(&self, decoded: Decoded) -> u64 {
        let code = self.codes.get(decoded.id as usize).copied().unwrap_or(0);
        (0..decoded.rotations).fold(code, |word, _| self.words.rotate(word))
    }

    fn decode_beyond(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        self.nearest(word, 0, max_errors)
    }

    /// Returns the closest code in the cells that are not hidden; compares all codes.
    fn nearest(&self, word: u64, hidden: u64, max_errors: u32) -> Option<Decoded> {
        // Rotating the word back by k steps is equivalent to comparing it with every code rotated k times.
        let full = usize::from(self.kind.rotations());
        let turned_back = |word: u64| {
            let mut turned_back = [word; 4];
            for rotations in (1..full).rev() {
                turned_back[rotations] = self.words.rotate(turned_back[(rotations + 1) % full]);
            }
            turned_back
        };
        let seen = turned_back(hidden).map(|hidden| !hidden);
        let turned_back = turned_back(word);
        let (mut best, mut second) = ((u32::MAX, 0, 0), u32::MAX);
        for (id, code) in (0..).zip(&self.codes) {
            for (rotations, (back, seen)) in (0..).zip(turned_back[..full].iter().zip(&seen)) {
                let errors = ((back ^ code) & seen).count_ones();
                if errors < best.0 {
                    second = best.0;
                    best = (errors, id, rotations);
                } else {
                    second = second.min(errors);
                }
            }
        }
        let (errors, id, rotations) = best;
        (errors <= max_errors).then_some(Decoded {
            id,
            rotations,
            errors,
            runner_up: (second <= max_errors).then_some(second),
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;
    use crate::family::HiddenCells;

    /// Tests any content of hidden cells, with as many misread cells among the others as the remaining distance
    /// allows.
    #[test]
    fn tags_are_decoded_with_hidden_cells() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for name in ["d16h5", "d25h7", "d25h9", "d36h11"] {
            let family = Family::shipped(name).unwrap();
            let (decoder, words) = (Decoder::new(&family), TagWords::new(family.dimension()));
            for hidden in HiddenCells::ALL {
                let Some(left) = family.distance_without(hidden).filter(|left| *left > 0) else {
                    continue;
                };
                for mask in hidden.masks(family.dimension()) {
                    let (id, rotations) =
                        (rng.random_range(0..family.len()), rng.random_range(0..3u8));
                    let code = words.rotations(family.codes()[id])[usize::from(rotations)];
                    let mut read = code ^ (rng.random::<u64>() & mask);
                    let errors = (left - 1) / 2;
                    while ((read ^ code) & !mask).count_ones() < errors {
                        read ^= 1 << rng.random_range(0..family.dimension().bits());
                    }
                    let found = decoder.decode_erased(read, mask, errors).unwrap();
                    let decoded = (found.id as usize, found.rotations, found.errors);
                    assert_eq!(decoded, (id, rotations, errors), "{name}, {hidden:?}");
                    // With all cells hidden, nothing can be decoded.
                    assert!(decoder.decode_erased(read, family.dimension().mask(), 0).is_none());
                }
            }
        }
    }
}
