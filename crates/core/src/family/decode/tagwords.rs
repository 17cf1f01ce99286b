use crate::lattice::{Dimension, GridKind, TagCells};

/// Tabulated arithmetic on the words of one dimension: rotations and complexity.
///
/// [`TagCells`] defines bit order and rotation; this type only evaluates them fast.
#[derive(Clone, Debug)]
pub struct TagWords {
    kind: GridKind,
    dimension: Dimension,
    /// turned[i][x]: the word with byte i = x and all else 0, rotated once.
    turned: Vec<[u64; 256]>,
    /// For each difference of bit positions between neighbours: the lower bits of these pairs.
    neighbours: Vec<(u32, u64)>,
    pairs: u32,
}

impl TagWords {
    /// Creates the arithmetic for triangular tags of dimension `d`.
    pub fn new(dimension: Dimension) -> Self {
        Self::of(GridKind::Deltille, dimension)
    }

    /// Creates the arithmetic for tags that fill a tile of `kind`.
    pub fn of(kind: GridKind, dimension: Dimension) -> Self {
        let cells = TagCells::of(kind, dimension);
        let bytes = dimension.bits().div_ceil(8) as usize;
        let turned = (0..bytes)
            .map(|i| {
                std::array::from_fn(|x| cells.rotate((x as u64) << (8 * i) & dimension.mask()))
            })
            .collect();
        let mut neighbours: Vec<(u32, u64)> = Vec::new();
        for &[a, b] in cells.neighbours() {
            let (low, gap) = (a.min(b), u32::from(a.abs_diff(b)));
            match neighbours.iter_mut().find(|(g, _)| *g == gap) {
                Some((_, lows)) => *lows |= 1 << low,
                None => neighbours.push((gap, 1 << low)),
            }
        }
        Self { kind, dimension, turned, neighbours, pairs: cells.neighbours().len() as u32 }
    }

    /// Excludes pairs that contain one of the given cells.
    #[must_use]
    pub fn without(mut self, free: u64) -> Self {
        for (gap, lows) in &mut self.neighbours {
            *lows &= !(free | free >> *gap);
        }
        self.pairs = self.neighbours.iter().map(|(_, lows)| lows.count_ones()).sum();
        self
    }

    /// Returns the dimension of the tags.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// Returns the word read after the tag was rotated counterclockwise by 120° or 90°.
    #[inline]
    pub fn rotate(&self, word: u64) -> u64 {
        self.turned
            .iter()
            .enumerate()
            .fold(0, |turned, (i, table)| turned | table[(word >> (8 * i) & 0xff) as usize])
    }

    /// Returns the words of a triangular tag after zero, one and two counterclockwise rotations by 120°.
    #[inline]
    pub fn rotations(&self, word: u64) -> [u64; 3] {
        let once = self.rotate(word);
        [word, once, self.rotate(once)]
    }

    /// Returns the smallest of the words of all rotations, which is independent of the tag's rotation.
    #[inline]
    pub fn canonical(&self, word: u64) -> u64 {
        let (mut least, mut turned) = (word, word);
        for _ in 1..self.kind.rotations() {
            turned = self.rotate(turned);
            least = least.min(turned);
        }
        least
    }

    /// Returns the distance from a word to its own rotations (both are equal).
    #[inline]
    pub fn rotation_distance(&self, word: u64) -> u32 {
        (word ^ self.rotate(word)).count_ones()
    }

    /// Returns the number of pairs of edge-adjacent cells that differ.
    #[inline]
    pub fn differing_pairs(&self, word: u64) -> u32 {
        self.neighbours.iter().map(|&(gap, lows)| ((word ^ word >> gap) & lows).count_ones()).sum()
    }

    /// Returns the number of pairs of edge-adjacent cells: 9, 18, 30, 45, 63 or 84 if all cells count.
    pub fn pairs(&self) -> u32 {
        self.pairs
    }

    /// Returns the smallest distance between any rotation of `a` and any rotation of `b`.
    pub fn distance(&self, a: u64, b: u64) -> u32 {
        let turned = self.rotations(b).map(|b| (a ^ b).count_ones());
        turned[0].min(turned[1]).min(turned[2])
    }

    /// Formats a word as in family files: 0x and ⌈b/4⌉ digits.
    pub fn hex(&self, word: u64) -> String {
        format!("0x{word:0width$x}", width = self.dimension.bits().div_ceil(4) as usize)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn tables_agree_with_the_lattice(rows in 3..=8u32, word: u64) {
            let dimension = Dimension::from_bits(rows * rows).unwrap();
            let (cells, words) = (TagCells::new(dimension), TagWords::new(dimension));
            let word = word & dimension.mask();
            prop_assert_eq!(words.rotate(word), cells.rotate(word));
            let differing = cells.neighbours().iter()
                .filter(|&&[a, b]| word >> a & 1 != word >> b & 1).count();
            prop_assert_eq!(words.differing_pairs(word), differing as u32);
        }

        #[test]
        fn distance_ignores_rotations(rows in 3..=8u32, a: u64, b: u64) {
            let words = TagWords::new(Dimension::from_bits(rows * rows).unwrap());
            let (a, b) = (a & words.dimension().mask(), b & words.dimension().mask());
            prop_assert_eq!(words.distance(a, b), words.distance(b, words.rotate(a)));
            prop_assert_eq!(words.canonical(a), words.canonical(words.rotate(a)));
        }
    }
}
