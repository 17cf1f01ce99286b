//! Published bounds on the sizes of binary codes.
//!
//! The source is A. E. Brouwer's *Bounds for general binary codes*
//! (<https://www.win.tue.nl/~aeb/codes/binary-1.html>), which continues Best, Brouwer, MacWilliams, Odlyzko and
//! Sloane, "Bounds for binary codes of length less than 25" (1978). Its upper bounds include those of Schrijver
//! (2005) and of Gijswijt, Mittelmann and Schrijver (2012) by semidefinite programming, which E. Agrell's tables
//! (<https://codes.se/bounds/unr.html>) list one by one. They end at length 28.

use crate::lattice::{GridKind, TagCells};

/// Bounds on the size of the largest binary code of a length and a distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PublishedBounds {
    /// Number of words of the largest known code, regardless of its symmetries.
    pub known_words: u64,
    /// Number of words that no code exceeds.
    pub most_words: u64,
    /// `most_words` divided by the rotations of a tag: no family has more codes.
    pub most_tags: u64,
}

/// Length, even distance, and both bounds; A(n, h) = A(n + 1, h + 1) for odd h.
const TABLE: [(u32, u32, u64, u64); 29] = [
    (9, 4, 20, 20),
    (9, 6, 4, 4),
    (10, 4, 40, 40),
    (10, 6, 6, 6),
    (16, 4, 2048, 2048),
    (16, 6, 256, 256),
    (16, 8, 32, 32),
    (16, 10, 4, 4),
    (17, 4, 2816, 3276),
    (17, 6, 258, 340),
    (17, 8, 36, 36),
    (17, 10, 6, 6),
    (25, 4, 1 << 19, 599_184),
    (25, 6, 17_920, 47_538),
    (25, 8, 4096, 5421),
    (25, 10, 192, 466),
    (25, 12, 52, 55),
    (25, 14, 8, 8),
    (25, 16, 4, 4),
    (26, 4, 1 << 20, 1_198_368),
    (26, 6, 32_768, 84_260),
    (26, 8, 4104, 9275),
    (26, 10, 384, 836),
    (26, 12, 64, 96),
    (26, 14, 14, 14),
    (26, 16, 4, 4),
    (9, 2, 256, 256),
    (16, 2, 1 << 15, 1 << 15),
    (25, 2, 1 << 24, 1 << 24),
];

/// Returns the published bounds for tags with this number of cells at a distance; `None` for more than 28 cells,
/// where the tables end, and for trivial distances.
pub fn published_bounds(cells: &TagCells, distance: u32) -> Option<PublishedBounds> {
    let bits = cells.dimension().bits();
    let odd = distance % 2;
    let key = (bits + odd, distance + odd);
    let known = TABLE.iter().find(|(length, even, ..)| (*length, *even) == key);
    let rotations = u64::from(GridKind::rotations(cells.kind()));
    known.map(|&(.., known_words, most_words)| PublishedBounds {
        known_words,
        most_words,
        most_tags: most_words / rotations,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::check::bounds::bounds;
    use crate::family::shipped_families;
    use crate::lattice::Dimension;

    /// No shipped family exceeds a published bound, and no published bound is above our own proven one.
    #[test]
    fn published_and_proved_bounds_and_shipped_families_agree() {
        for &(length, even, known, most) in &TABLE {
            assert!(known <= most);
            for (bits, distance) in [(length, even), (length - 1, even - 1)] {
                let Ok(dimension) = Dimension::from_bits(bits) else { continue };
                let cells = TagCells::new(dimension);
                let published = published_bounds(&cells, distance).unwrap();
                let proved = bounds(cells.kind(), dimension, distance).linear_programming;
                assert!(published.most_tags <= proved, "d{bits}h{distance}: {proved}");
            }
        }
        for family in shipped_families() {
            let dimension = Dimension::from_bits(family.bits).unwrap();
            let cells = TagCells::of(family.kind, dimension);
            if let Some(published) = published_bounds(&cells, family.distance) {
                assert!(family.codes as u64 <= published.most_tags, "{}", family.name);
            }
        }
        let cells = TagCells::new(Dimension::from_bits(25).unwrap());
        let most = [7, 9].map(|h| published_bounds(&cells, h).unwrap().most_tags);
        assert_eq!(most, [3091, 278]);
    }
}
