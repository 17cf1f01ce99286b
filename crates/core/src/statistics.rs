//! Medians and quantiles.

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
