//! Medians, quantiles, and tail probabilities of sums of squares.

/// Returns the median, the upper of the two middle values for an even count; `None` if there are no values. NaN sorts
/// as the largest value.
///
/// ```
/// assert_eq!(deltille_core::statistics::median(vec![3.0, f64::NAN, 1.0]), Some(3.0));
/// ```
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the quantile of `values` at `part`, from 0 to 1: the smallest value with at least that fraction of the
/// values below it, or the largest value. Returns `None` if there are no values. Sorts the values.
pub fn quantile(values: &mut [f64], part: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[((part * values.len() as f64) as usize).min(last)])
}

/// Returns the upper tail probability of the χ² distribution with `freedom` degrees of freedom.
///
/// ```
/// let probability = deltille_core::statistics::chi_squared_p_value(11.07, 5);
/// assert!((probability - 0.05).abs() < 1e-4);
/// ```
pub fn chi_squared_p_value(sum: f64, freedom: usize) -> f64 {
    let half = sum.max(0.0) / 2.0;
    if !half.is_finite() {
        return 0.0;
    }
    // Q(a + 1, h) = Q(a, h) + hᵃ e⁻ʰ / Γ(a + 1), from Q(1, h) = e⁻ʰ or Q(1/2, h) = erfc √h.
    let (mut probability, mut term, mut a) = match freedom % 2 {
        0 => (0.0, (-half).exp(), 0.0),
        _ => (
            libm::erfc(half.sqrt()),
            (-half).exp() * (half / std::f64::consts::PI).sqrt() * 2.0,
            0.5,
        ),
    };
    while 2.0 * a + 0.5 < freedom as f64 {
        probability += term;
        a += 1.0;
        term *= half / a;
    }
    probability.min(1.0)
}

/// Returns the upper tail probability of the F distribution with `above` and `below` degrees of freedom.
///
/// ```
/// let probability = deltille_core::statistics::f_p_value(3.326, 5.0, 10.0);
/// assert!((probability - 0.05).abs() < 1e-4);
/// ```
pub fn f_p_value(ratio: f64, above: f64, below: f64) -> f64 {
    let (a, b) = (below / 2.0, above / 2.0);
    let x = below / (below + above * ratio.max(0.0));
    // The continued fraction converges fast on one side of the mean.
    if x < (a + 1.0) / (a + b + 2.0) { beta_part(x, a, b) } else { 1.0 - beta_part(1.0 - x, b, a) }
}

/// The regularised incomplete beta function I_x(a, b) by its continued fraction (DLMF 8.17.22).
fn beta_part(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    let front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b);
    let front = (front + a * x.ln() + b * (-x).ln_1p()).exp() / a;
    let term = |m: u32| {
        let (half, m) = (f64::from(m / 2), f64::from(m));
        match m as u32 % 2 {
            0 => half * (b - half) * x / ((a + m - 1.0) * (a + m)),
            _ => -(a + half) * (a + b + half) * x / ((a + m - 1.0) * (a + m)),
        }
    };
    // Evaluates the fraction from its last term.
    let fraction = (1..=FRACTION_TERMS).rev().fold(1.0, |rest, m| 1.0 + term(m) / rest);
    (front / fraction).clamp(0.0, 1.0)
}

/// Terms of the continued fraction; thousands of degrees of freedom need fewer.
const FRACTION_TERMS: u32 = 400;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Reference values from SciPy 1.17.1, `scipy.stats.f.sf` and `chi2.sf`.
    #[test]
    fn tail_probabilities_match_scipy() {
        let of_ratios = [
            (1.0, 9.0, 19.0, 4.725595768e-01),
            (6.0, 9.0, 19.0, 5.181127378e-04),
            (2.0, 3.0, 400.0, 1.134306057e-01),
            (20.0, 12.0, 9.0, 5.040182827e-05),
            (0.2, 7.0, 30.0, 9.830186062e-01),
            (50.0, 2.0, 5.0, 4.948251479e-04),
        ];
        for (ratio, above, below, probability) in of_ratios {
            let found = f_p_value(ratio, above, below);
            assert!(
                (found / probability - 1.0_f64).abs() < 1e-7,
                "{ratio} {above} {below}: {found}"
            );
        }
        let of_sums = [
            (0.5, 1, 4.795001222e-01),
            (3.0, 2, 2.231301601e-01),
            (40.0, 12, 7.190884053e-05),
            (100.0, 31, 3.464370245e-09),
        ];
        for (sum, freedom, probability) in of_sums {
            let found = chi_squared_p_value(sum, freedom);
            assert!((found / probability - 1.0_f64).abs() < 1e-7, "{sum} {freedom}: {found}");
        }
    }

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
