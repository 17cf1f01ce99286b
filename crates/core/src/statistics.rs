//! Medians, quantiles, and how often chance makes a sum of squares.

/// The middle value, of an even number the upper of two; `None` of none. What is no number counts as large.
///
/// ```
/// assert_eq!(deltille_core::statistics::median(vec![3.0, f64::NAN, 1.0]), Some(3.0));
/// ```
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The quantile of some values at `part`, from 0 to 1: the least value below which at least that part of them lies, or the
/// greatest of all; `None` of no values. The values are sorted by it.
pub fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[((part * values.len() as f64) as usize).min(last)])
}

/// How often the sum of so many squared normal numbers of variance 1 is larger than this.
///
/// ```
/// let chance = deltille_core::statistics::chi_squared_chance(11.07, 5);
/// assert!((chance - 0.05).abs() < 1e-4);
/// ```
pub fn chi_squared_chance(sum: f64, freedom: usize) -> f64 {
    let half = sum.max(0.0) / 2.0;
    if !half.is_finite() {
        return 0.0;
    }
    // Q(a + 1, h) = Q(a, h) + hᵃ e⁻ʰ / Γ(a + 1), from Q(1, h) = e⁻ʰ or Q(1/2, h) = erfc √h.
    let (mut chance, mut term, mut a) = match freedom % 2 {
        0 => (0.0, (-half).exp(), 0.0),
        _ => (
            libm::erfc(half.sqrt()),
            (-half).exp() * (half / std::f64::consts::PI).sqrt() * 2.0,
            0.5,
        ),
    };
    while 2.0 * a + 0.5 < freedom as f64 {
        chance += term;
        a += 1.0;
        term *= half / a;
    }
    chance.min(1.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_median_is_the_middle_quantile(values in prop::collection::vec(-1e3f64..1e3, 0..30), part in 0.0f64..=1.0) {
            let mut sorted = values.clone();
            prop_assert_eq!(median(values.clone()), quantile(&mut sorted, 0.5));
            let below = |limit: f64| values.iter().filter(|&&v| v < limit).count() as f64;
            if let Some(found) = quantile(&mut sorted, part) {
                prop_assert!(values.contains(&found) && below(found) <= part * values.len() as f64);
            } else {
                prop_assert!(values.is_empty());
            }
        }
    }
}
