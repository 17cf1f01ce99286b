//! Numbers as they are shown in a finding.

/// A length in mm or an angle as it is shown: a tiny negative number is not shown as −0.
pub(crate) fn shown(value: f64) -> f64 {
    (value * 1e3).round() / 1e3 + 0.0
}
