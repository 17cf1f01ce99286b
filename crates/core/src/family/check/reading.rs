//! Decoding statistics of degraded tags: the fractions read correctly and misread.
//!
//! ```text
//!     W(n, k) = C(n,k) p^k (1−p)^(n−k)                  k of n cells are wrong, each with probability p
//!     read    = Σ W(b, k)                               over k ≤ t = ⌊(h−1)/2⌋
//!     misread = Σ A_d Σ W(d, a) W(b−d, c)               over d, and over a, c with (d−a) + c ≤ t
//! ```
//!
//! A_d is the mean number of words at distance d from a word, over the family and its rotations. Of the d cells in
//! which the two words differ, a are wrong; of the others, c are. The distance to the other word is then d − a + c.
//! Balls of radius t do not overlap, so both values are exact; the remaining readings are rejected.

use crate::family::Family;

/// Decoding statistics of tags with independent cell errors.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Reading {
    /// Fraction that is read correctly.
    pub read: f64,
    /// Fraction that is mistaken for another tag, or for another rotation of itself.
    pub misread: f64,
}

impl Family {
    /// Returns the decoding statistics for a cell error probability, with [`Self::correctable`] corrected cells.
    /// Returns `None` for families whose pairs are not counted, see [`Self::histogram`].
    pub fn reading(&self, rate: f64) -> Option<Reading> {
        let (bits, most) = (self.used_cells(), self.correctable());
        let wrong = |cells: u32, count: u32| {
            let chosen = (0..count)
                .fold(1.0, |binomial, i| binomial * f64::from(cells - i) / f64::from(i + 1));
            chosen * rate.powi(count as i32) * (1.0 - rate).powi((cells - count) as i32)
        };
        let misread = |distance: u32| -> f64 {
            let rest = bits - distance;
            let apart = (0..=most.min(rest)).map(|elsewhere| {
                let least = (distance + elsewhere).saturating_sub(most);
                let towards: f64 = (least..=distance).map(|count| wrong(distance, count)).sum();
                towards * wrong(rest, elsewhere)
            });
            apart.sum()
        };
        let words = f64::from(self.kind.rotations()) * self.len() as f64;
        let of_pairs = self.histogram.iter().map(|(&distance, &pairs)| {
            // Either of the two may be mistaken for the other.
            2.0 * pairs as f64 / words * misread(distance)
        });
        (!self.histogram.is_empty()).then(|| Reading {
            read: (0..=most).map(|count| wrong(bits, count)).sum(),
            misread: of_pairs.sum(),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::family::{Decoder, Family};

    #[test]
    fn fractions_match_enumeration() {
        for name in ["delTag16h5", "aprilTag16h5"] {
            let family = Family::shipped(name).unwrap();
            let decoder = Decoder::new(&family);
            let mut counts = [[0u32; 2]; 17];
            for (id, code) in (0..).zip(family.codes()) {
                for errors in 0..1u64 << 16 {
                    let Some(found) = decoder.decode(code ^ errors, family.correctable()) else {
                        continue;
                    };
                    let is_misread = (found.id, found.rotations) != (id, 0);
                    counts[errors.count_ones() as usize][usize::from(is_misread)] += 1;
                }
            }
            for rate in [0.0, 0.02, 0.15, 0.5] {
                let share = |is_misread: usize| -> f64 {
                    let seen = (0..).zip(counts).map(|(wrong, count)| {
                        f64::from(count[is_misread])
                            * f64::powi(rate, wrong)
                            * f64::powi(1.0 - rate, 16 - wrong)
                    });
                    seen.sum::<f64>() / family.len() as f64
                };
                let found = family.reading(rate).unwrap();
                assert!((found.read - share(0)).abs() < 1e-12, "{name} at {rate}: {found:?}");
                assert!((found.misread - share(1)).abs() < 1e-12, "{name} at {rate}: {found:?}");
            }
        }
    }
}
