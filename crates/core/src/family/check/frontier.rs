//! Trade-off of the complexity of codes: requiring fewer differing pairs gives more codes, but more natural image
//! content is mistaken for one.

use super::natural::cumulated;
use crate::family::{NaturalWords, TagWords};
use crate::lattice::Dimension;

/// Result of requiring a number of differing pairs from some codes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct RuleChoice {
    /// Minimum number of pairs of neighbouring cells that differ in every code.
    pub min_pairs: u32,
    /// The same as a fraction of all pairs, see [`crate::family::Rules::min_complexity`].
    pub min_complexity: f64,
    /// Number of codes that satisfy the rule.
    pub codes: usize,
    /// Natural false positive rates for 0, 1, … ⌊(h−1)/2⌋ corrected cells, as
    /// [`crate::family::Family::natural_false_positive_rates`].
    pub natural: Vec<f64>,
}

/// Returns the result of each threshold for `codes` of distance `distance`, the lowest first, each with fewer codes
/// than the previous one.
pub fn rule_choices(dimension: Dimension, distance: u32, codes: &[u64]) -> Vec<RuleChoice> {
    let words = TagWords::new(dimension);
    let most = distance.saturating_sub(1) / 2;
    let by_pairs = NaturalWords::new(dimension).by_pairs(codes, most);
    let choice = |&min_pairs: &u32| {
        let left = by_pairs.range(min_pairs..).map(|(_, chances)| chances);
        RuleChoice {
            min_pairs,
            min_complexity: f64::from(min_pairs) / f64::from(words.pairs()),
            codes: codes.iter().filter(|&&code| words.differing_pairs(code) >= min_pairs).count(),
            natural: cumulated(left, most),
        }
    };
    by_pairs.keys().map(choice).collect()
}

/// Returns the choice with the most codes among those whose natural false positive rate with
/// `corrected` corrected cells is at most `accepted`.
pub fn best_rule(choices: &[RuleChoice], corrected: u32, accepted: f64) -> Option<&RuleChoice> {
    let fits = |choice: &&RuleChoice| {
        choice.natural.get(corrected as usize).is_some_and(|&rate| rate <= accepted)
    };
    choices.iter().filter(fits).max_by_key(|choice| choice.codes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;

    /// The choice for a family's own rule has its codes and rates; stricter rules have fewer codes and lower rates.
    #[test]
    fn the_own_rule_of_a_family_is_one_of_the_choices() {
        let family = Family::shipped("d36h11").unwrap();
        let choices = rule_choices(family.dimension(), family.distance(), family.codes());
        let rates = family.natural_false_positive_rates().unwrap();
        assert_eq!((choices[0].codes, choices[0].min_pairs), (family.len(), 23));
        assert!(choices[0].natural.iter().zip(&rates).all(|(a, b)| (a / b - 1.0).abs() < 1e-9));
        assert!(choices.is_sorted_by(|a, b| a.codes > b.codes && a.natural[5] > b.natural[5]));
        let best = best_rule(&choices, 4, 1e-4).unwrap();
        assert!(best.natural[4] <= 1e-4 && best.min_pairs > 23, "{best:?}");
        assert_eq!(best_rule(&choices, 6, 1.0), None);
    }
}
