//! Finding the nearest code to a word that was read.

mod blocks;
mod syndromes;

use blocks::Blocks;
use syndromes::Syndromes;

use super::{Family, TagWords};
use crate::lattice::GridKind;

/// A word recognised as a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Decoded {
    /// Id of the tag.
    pub id: u32,
    /// Number of counter-clockwise turns of the tag that give the word read: by 120°, 0 to 2, or of
    /// a square tag by 90°, 0 to 3.
    pub turns: u8,
    /// Number of cells in which the word differs from the code.
    pub errors: u32,
    /// Errors of the next best reading (another tag, or another turn), if that lies within the
    /// errors allowed too. Never so while these are at most ⌊(h−1)/2⌋; then any other reading has
    /// at least h − `errors`.
    pub runner_up: Option<u32>,
}

/// Finds the nearest code, in any turn, to a word that was read.
///
/// The bits are compared in blocks; very large families made from a linear code are searched by the
/// syndrome of the word instead. Both give the same answers. Square families are so small that every
/// code is compared.
#[derive(Clone, Debug)]
pub struct Decoder {
    /// Largest number of errors at which every word has one nearest code at most.
    correctable: u32,
    kind: GridKind,
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
    /// A decoder for `family`, by whatever way is faster. Takes memory in proportion to the number
    /// of codes, and of patterns of errors that are corrected.
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

    /// A decoder that compares blocks, whatever the family of triangular tags.
    pub fn by_blocks(family: &Family) -> Self {
        Self::with(family, Search::Blocks(Blocks::new(family)))
    }

    /// A decoder by syndromes; `None` where the family was made otherwise than by a linear code.
    pub fn by_syndromes(family: &Family) -> Option<Self> {
        Syndromes::new(family).map(|s| Self::with(family, Search::Syndromes(Box::new(s))))
    }

    fn with(family: &Family, search: Search) -> Self {
        Self {
            correctable: family.correctable(),
            kind: family.kind(),
            words: TagWords::of(family.kind(), family.dimension()),
            codes: family.codes().to_vec(),
            search,
        }
    }

    /// The nearest code within `max_errors` cells of `word`, or none.
    ///
    /// Up to ⌊(h−1)/2⌋ errors the answer is unique. Beyond, every code is compared, ties go to the
    /// lower id, then the fewer turns, and show in `runner_up`.
    #[inline]
    pub fn decode(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        if max_errors > self.correctable {
            return self.decode_beyond(word, max_errors);
        }
        match &self.search {
            Search::Blocks(blocks) => blocks.decode(word, max_errors),
            Search::Every => self.decode_beyond(word, max_errors),
            Search::Syndromes(syndromes) => syndromes.decode(&self.codes, word, max_errors),
        }
    }

    /// The word of a code that was recognised, without its errors.
    pub fn word(&self, decoded: Decoded) -> u64 {
        let code = self.codes.get(decoded.id as usize).copied().unwrap_or(0);
        (0..decoded.turns).fold(code, |word, _| self.words.turn(word))
    }

    fn decode_beyond(&self, word: u64, max_errors: u32) -> Option<Decoded> {
        // Turning the word back by k turns is comparing it with every code turned k times.
        let mut turned_back = [word; 4];
        let full = usize::from(self.kind.turns());
        for turns in (1..full).rev() {
            turned_back[turns] = self.words.turn(turned_back[(turns + 1) % full]);
        }
        let (mut best, mut second) = ((u32::MAX, 0, 0), u32::MAX);
        for (id, code) in (0..).zip(&self.codes) {
            for (turns, back) in (0..).zip(&turned_back[..full]) {
                let errors = (back ^ code).count_ones();
                if errors < best.0 {
                    second = best.0;
                    best = (errors, id, turns);
                } else {
                    second = second.min(errors);
                }
            }
        }
        let (errors, id, turns) = best;
        (errors <= max_errors).then_some(Decoded {
            id,
            turns,
            errors,
            runner_up: (second <= max_errors).then_some(second),
        })
    }
}
