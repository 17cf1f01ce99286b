use std::collections::BTreeMap;

use super::statistics::cross_distances;
use crate::family::{Family, PAIRS_COUNTED};

/// Distances of the tags of a family from those of another, or of itself in a mirror.
///
/// ```
/// use deltille_core::family::{Confusion, Family};
///
/// let [a, b] = ["d16h5", "delTag16h5"].map(|name| Family::shipped(name).unwrap());
/// let confusion = Confusion::between(&a, &b).unwrap();
/// // Each of the 34 tags of one family is compared with all words of the other.
/// assert_eq!(confusion.direct.values().sum::<u64>(), 34 * 3 * 78);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Confusion {
    /// Number of pairs of a word (a code of the first family in any rotation) and a code of the other, at each
    /// distance.
    pub direct: BTreeMap<u32, u64>,
    /// The same for mirrored tags of the other family.
    pub mirrored: BTreeMap<u32, u64>,
}

impl Confusion {
    /// Compares all tags of two families. Returns `None` if their tags have different cells, one family is too large
    /// to be compared pair by pair, or its tags identify a position only together.
    pub fn between(of: &Family, other: &Family) -> Option<Self> {
        let alike = (of.kind(), of.dimension()) == (other.kind(), other.dimension());
        let fits = |family: &Family| family.len() <= PAIRS_COUNTED && !family.is_position_family();
        if !alike || !fits(of) || !fits(other) {
            return None;
        }
        let mirror = of.cells().mirror();
        let mirrored =
            |&code: &u64| mirror.iter().rev().fold(0, |word, &from| word << 1 | (code >> from & 1));
        let in_mirror: Vec<u64> = other.codes().iter().map(mirrored).collect();
        let compared =
            |codes: &[u64]| cross_distances(of.kind(), of.dimension(), codes, of.codes());
        Some(Self { direct: compared(other.codes()), mirrored: compared(&in_mirror) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::{Decoder, certify};

    /// Mirror distances match the decoder's results for mirrored tags.
    #[test]
    fn mirrored_tags_decode_as_often_as_predicted() {
        for name in ["d16h5", "delTag25h9", "aprilTag16h5"] {
            let family = Family::shipped(name).unwrap();
            let confusion = Confusion::between(&family, &family).unwrap();
            let decoder = Decoder::new(&family);
            let mirror = family.cells().mirror();
            let most = family.correctable();
            let taken = family.codes().iter().filter(|&&code| {
                let word = (0..).zip(&mirror).map(|(to, &from)| (code >> from & 1) << to).sum();
                decoder.decode(word, most).is_some()
            });
            let near: u64 = confusion.mirrored.range(..=most).map(|(_, pairs)| pairs).sum();
            assert_eq!(taken.count() as u64, near, "{name}");
            let least = confusion.mirrored.into_keys().next();
            assert_eq!(certify(&family).mirror_distance, least, "{name}");
        }
    }
}
