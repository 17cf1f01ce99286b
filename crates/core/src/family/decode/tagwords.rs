use crate::lattice::{Dimension, GridKind, TagCells};

/// Arithmetic on the words of one dimension, tabulated for speed: turns and complexity.
///
/// Bit order and rotation come from [`TagCells`]; this only evaluates them fast.
#[derive(Clone, Debug)]
pub struct TagWords {
    kind: GridKind,
    dimension: Dimension,
    /// turned[i][x]: the word with byte i = x and all else 0, turned once.
    turned: Vec<[u64; 256]>,
    /// For each distance in bit positions at which neighbours lie: the lower bits of these pairs.
    neighbours: Vec<(u32, u64)>,
    pairs: u32,
}

impl TagWords {
    /// The words of triangular tags of dimension `d`.
    pub fn new(dimension: Dimension) -> Self {
        Self::of(GridKind::Deltille, dimension)
    }

    /// The words of tags that fill a tile of `kind`.
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

    /// The same where pairs with one of some cells do not count.
    #[must_use]
    pub fn without(mut self, free: u64) -> Self {
        for (gap, lows) in &mut self.neighbours {
            *lows &= !(free | free >> *gap);
        }
        self.pairs = self.neighbours.iter().map(|(_, lows)| lows.count_ones()).sum();
        self
    }

    /// The dimension of the tags.
    pub fn dimension(&self) -> Dimension {
        self.dimension
    }

    /// The word read after the tag was turned counter-clockwise, by 120° or 90°.
    #[inline]
    pub fn turn(&self, word: u64) -> u64 {
        self.turned
            .iter()
            .enumerate()
            .fold(0, |turned, (i, table)| turned | table[(word >> (8 * i) & 0xff) as usize])
    }

    /// The words read off a triangular tag after no turn, one and two turns by 120°
    /// counter-clockwise.
    #[inline]
    pub fn turns(&self, word: u64) -> [u64; 3] {
        let once = self.turn(word);
        [word, once, self.turn(once)]
    }

    /// The smallest of the words of all turns: one name for a tag however it is turned.
    #[inline]
    pub fn canonical(&self, word: u64) -> u64 {
        let (mut least, mut turned) = (word, word);
        for _ in 1..self.kind.turns() {
            turned = self.turn(turned);
            least = least.min(turned);
        }
        least
    }

    /// Distance from a word to its own turns (both are equally far).
    #[inline]
    pub fn turn_distance(&self, word: u64) -> u32 {
        (word ^ self.turn(word)).count_ones()
    }

    /// Number of pairs of edge-adjacent cells that differ.
    #[inline]
    pub fn differing_pairs(&self, word: u64) -> u32 {
        self.neighbours.iter().map(|&(gap, lows)| ((word ^ word >> gap) & lows).count_ones()).sum()
    }

    /// Number of pairs of edge-adjacent cells: 9, 18, 30, 45, 63 or 84, where all cells count.
    pub fn pairs(&self) -> u32 {
        self.pairs
    }

    /// Smallest distance between any turn of `a` and any turn of `b`.
    pub fn distance(&self, a: u64, b: u64) -> u32 {
        let turned = self.turns(b).map(|b| (a ^ b).count_ones());
        turned[0].min(turned[1]).min(turned[2])
    }

    /// A word in the notation of family files: 0x and ⌈b/4⌉ digits.
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
            prop_assert_eq!(words.turn(word), cells.rotate(word));
            let differing = cells.neighbours().iter()
                .filter(|&&[a, b]| word >> a & 1 != word >> b & 1).count();
            prop_assert_eq!(words.differing_pairs(word), differing as u32);
        }

        #[test]
        fn distance_does_not_see_turns(rows in 3..=8u32, a: u64, b: u64) {
            let words = TagWords::new(Dimension::from_bits(rows * rows).unwrap());
            let (a, b) = (a & words.dimension().mask(), b & words.dimension().mask());
            prop_assert_eq!(words.distance(a, b), words.distance(b, words.turn(a)));
            prop_assert_eq!(words.canonical(a), words.canonical(words.turn(a)));
        }
    }
}
