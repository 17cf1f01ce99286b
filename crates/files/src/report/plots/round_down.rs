//! Round scales of arrows.

/// The largest value of the form 1, 2 or 5 times a power of ten that does not exceed `value`.
pub(in crate::report) fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let digit = [5.0, 2.0].into_iter().find(|digit| digit * decade <= value * (1.0 + 1e-9));
    let rounded = digit.unwrap_or(1.0) * decade;
    // Removes the rounding error of the power.
    format!("{rounded:.6}").parse().unwrap_or(rounded)
}
