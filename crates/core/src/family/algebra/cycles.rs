//! Cycle coordinates of words, and the arrangements that place the cycles of a code on a tag.

use serde::{Deserialize, Serialize};

use crate::lattice::{Dimension, TagCells};

/// The space of words in cycle coordinates: m three-cycles, and possibly a central bit that every rotation fixes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleSpace {
    /// Number of three-cycles, m; at most 21, so that words fit 64 bits.
    pub cycles: u32,
    /// Whether there is a central bit, number 3m.
    pub centre: bool,
}

impl CycleSpace {
    /// Returns the space of the tags of one dimension.
    pub fn of(dimension: Dimension) -> Self {
        Self { cycles: dimension.bits() / 3, centre: dimension.bits() % 3 == 1 }
    }

    /// Returns the number of bits, 3m or 3m + 1.
    pub fn bits(self) -> u32 {
        3 * self.cycles + u32::from(self.centre)
    }

    /// Returns a word with all bits set.
    pub fn mask(self) -> u64 {
        // There is at least one bit.
        u64::MAX >> (u64::BITS - self.bits())
    }

    /// Returns every third bit: the first of each cycle.
    fn firsts(self) -> u64 {
        0x9249_2492_4924_9249 & ((1 << (3 * self.cycles)) - 1)
    }

    /// Returns the word after one rotation of the tag by 120°.
    #[inline]
    pub fn rotate(self, word: u64) -> u64 {
        let (first, cycles) = (self.firsts(), (1 << (3 * self.cycles)) - 1);
        let moved = word & (first | first << 1);
        (moved << 1) | ((word >> 2) & first) | (word & !cycles)
    }

    /// Returns the representative of the orbit: the smallest of the three rotated words.
    #[inline]
    pub fn canonical(self, word: u64) -> u64 {
        let once = self.rotate(word);
        word.min(once).min(self.rotate(once))
    }

    /// Returns a basis of the words that the rotation fixes: each whole cycle, and the central bit.
    pub fn fixed_basis(self) -> Vec<u64> {
        let cycles = (0..self.cycles).map(|c| 0b111 << (3 * c));
        cycles.chain(self.centre.then_some(1 << (3 * self.cycles))).collect()
    }
}

/// Placement of the cycles of a code on the tag: all choices that preserve distances and invariance under the
/// rotation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrangement {
    /// For each cycle of the code, the index of the tag cycle that carries it.
    pub places: Vec<u8>,
    /// For each cycle of the code, the number of steps, 0 to 2, by which it is rotated.
    pub starts: Vec<u8>,
    /// Inverted cycles of the code, as a bit set; the central bit follows the last cycle. Inversion adds a word that
    /// the rotation fixes.
    pub inverted: u32,
}

impl Arrangement {
    /// Returns the identity: every cycle of the code is on the tag's cycle with the same number,
    /// and none is inverted.
    pub fn plain(space: CycleSpace) -> Self {
        let n = space.cycles as usize;
        Self { places: (0..n as u8).collect(), starts: vec![0; n], inverted: 0 }
    }

    /// Returns whether this is a valid arrangement of the cycles of `space`.
    pub fn fits(&self, space: CycleSpace) -> bool {
        let n = space.cycles as usize;
        let mut seen = self.places.clone();
        seen.sort_unstable();
        seen.iter().map(|&p| usize::from(p)).eq(0..n)
            && self.starts.len() == n
            && self.starts.iter().all(|&s| s < 3)
            && self.inverted >> (space.cycles + u32::from(space.centre)) == 0
    }

    /// Returns the permutation of bits: for each bit in cycle coordinates, the bit of the tag.
    pub fn bit_map(&self, dimension: Dimension) -> Vec<u8> {
        let (cycles, centre) = tag_cycles(dimension);
        let mut map = Vec::with_capacity(dimension.bits() as usize);
        for (&place, &start) in self.places.iter().zip(&self.starts) {
            let cycle = cycles[usize::from(place)];
            map.extend((0..3).map(|j| cycle[(j + usize::from(start)) % 3]));
        }
        map.extend(centre);
        map
    }

    /// Returns the word that is added to every code word for the inverted cycles, in cycle coordinates; the rotation
    /// fixes it.
    pub fn translation(&self, space: CycleSpace) -> u64 {
        let basis = space.fixed_basis();
        (0..).zip(basis).filter(|&(i, _)| self.inverted >> i & 1 == 1).fold(0, |t, (_, w)| t ^ w)
    }

    /// Maps words from cycle coordinates to words of the tag.
    pub fn apply(&self, dimension: Dimension, words: &[u64]) -> Vec<u64> {
        /// Number of words above which tables are faster than moving bit by bit.
        const MANY: usize = 256;
        if words.len() >= MANY {
            let placing = Placing::new(self, dimension);
            return words.iter().map(|&word| placing.on_tag(word)).collect();
        }
        let map = self.bit_map(dimension);
        let translation = self.translation(CycleSpace::of(dimension));
        words
            .iter()
            .map(|word| {
                let word = word ^ translation;
                (0..).zip(&map).fold(0, |tag, (i, &to)| tag | ((word >> i & 1) << to))
            })
            .collect()
    }
}

/// An arrangement prepared for many words.
#[derive(Clone, Debug)]
pub struct Placing {
    translation: u64,
    /// tables[i][x]: the word of the tag for the word with byte i = x and all else 0.
    tables: Vec<[u64; 256]>,
}

impl Placing {
    /// Prepares an arrangement for tags of a dimension.
    pub fn new(arrangement: &Arrangement, dimension: Dimension) -> Self {
        let map = arrangement.bit_map(dimension);
        let table = |places: &[u8]| {
            std::array::from_fn(|x| {
                let places = (0..).zip(places);
                places.fold(0, |tag, (i, &to)| tag | ((x as u64 >> i & 1) << to))
            })
        };
        let tables = map.chunks(8).map(table).collect();
        Self { translation: arrangement.translation(CycleSpace::of(dimension)), tables }
    }

    /// Maps a word from cycle coordinates to the tag.
    #[inline]
    pub fn on_tag(&self, word: u64) -> u64 {
        let bytes = (word ^ self.translation).to_le_bytes();
        self.tables.iter().zip(bytes).fold(0, |tag, (table, byte)| tag | table[usize::from(byte)])
    }
}

/// Returns the indices of the tag's cycles whose bits are all in a mask.
pub fn cycles_in(dimension: Dimension, mask: u64) -> Vec<u8> {
    let (cycles, _) = tag_cycles(dimension);
    let is_in = |cycle: &[u8; 3]| cycle.iter().all(|bit| mask >> bit & 1 == 1);
    (0..).zip(&cycles).filter(|(_, cycle)| is_in(cycle)).map(|(i, _)| i).collect()
}

/// Returns the three-cycles of the bits of a tag, each in the order in which a rotation moves the content, and the
/// fixed central bit.
fn tag_cycles(dimension: Dimension) -> (Vec<[u8; 3]>, Option<u8>) {
    let cells = TagCells::new(dimension);
    let source = cells.rotation();
    let (mut cycles, mut centre) = (Vec::new(), None);
    for bit in 0..dimension.bits() as u8 {
        // A rotation moves the content of `source[i]` to i, so content moves in the opposite direction.
        let before = source[usize::from(bit)];
        let two_before = source[usize::from(before)];
        if before == bit {
            centre = Some(bit);
        } else if bit < before && bit < two_before {
            cycles.push([bit, two_before, before]);
        }
    }
    (cycles, centre)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Rotation in cycle coordinates is equivalent to rotation on the tag, under every arrangement.
        #[test]
        fn arrangements_commute_with_rotations(
            rows in 3..=8u32, word: u64, seed: u64, inverted: u32,
        ) {
            let dimension = Dimension::from_bits(rows * rows).unwrap();
            let space = CycleSpace::of(dimension);
            let word = word & dimension.mask();
            let mut arrangement = Arrangement::plain(space);
            let n = space.cycles as usize;
            arrangement.places.rotate_left(seed as usize % n);
            arrangement.starts.iter_mut().enumerate()
                .for_each(|(i, s)| *s = ((seed >> i) % 3) as u8);
            arrangement.inverted = inverted & ((1 << (space.cycles + u32::from(space.centre))) - 1);
            prop_assert!(arrangement.fits(space));
            let [direct, turned] =
                arrangement.apply(dimension, &[word, space.rotate(word)])[..] else { unreachable!() };
            prop_assert_eq!(TagCells::new(dimension).rotate(direct), turned);
            prop_assert_eq!(Placing::new(&arrangement, dimension).on_tag(word), direct);
        }
    }
}
