//! Bounds for codes that are invariant under the rotation of a tag, by semidefinite programming.
//!
//! Tags are the vertices of a graph whose edges are conflicts. Schrijver's θ′ of that graph bounds the number of tags
//! without conflict. `docs/families/invariant_bound.py` computes it for 9 and 16 bits, and checks the dual solution
//! with integers and fractions. The table contains the results that are below every other bound (`docs/families.md`,
//! “Sizes”).

use crate::lattice::Dimension;

/// Bits, distance, maximum number of tags.
const TABLE: [(u32, u32, u64); 4] = [(9, 2, 84), (16, 2, 10_912), (16, 4, 672), (16, 6, 82)];

/// Returns the bound for triangular tags, if it is known and below those for all codes.
pub fn invariant_bound(dimension: Dimension, distance: u32) -> Option<u64> {
    let known = TABLE.iter().find(|&&(bits, h, _)| (bits, h) == (dimension.bits(), distance));
    known.map(|&(.., tags)| tags)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::check::bounds::bounds;
    use crate::family::{TagWords, published_bounds};
    use crate::lattice::{GridKind, TagCells};

    #[test]
    fn bounds_of_invariant_codes_are_less_than_the_others() {
        for (bits, distance, tags) in TABLE {
            let dimension = Dimension::from_bits(bits).unwrap();
            let others = bounds(GridKind::Deltille, dimension, distance).linear_programming;
            let published = published_bounds(&TagCells::new(dimension), distance).unwrap();
            assert!(tags < others.min(published.most_tags));
            assert_eq!(invariant_bound(dimension, distance), Some(tags));
        }
    }

    /// All words of even weight, except those that the rotation fixes, reach the bound for distance 2.
    #[test]
    fn even_words_meet_the_bounds() {
        for bits in [9, 16] {
            let dimension = Dimension::from_bits(bits).unwrap();
            let words = TagWords::new(dimension);
            let even = (0..=dimension.mask()).filter(|word| word.count_ones() % 2 == 0);
            let moved = even.filter(|&word| words.rotate(word) != word).count() as u64;
            assert_eq!(invariant_bound(dimension, 2), Some(moved / 3));
        }
    }
}
