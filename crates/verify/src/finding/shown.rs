//! Rounding of numbers in findings.

/// Rounds a length in mm or an angle for display; a tiny negative number becomes 0, not −0.
pub(crate) fn shown(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}
