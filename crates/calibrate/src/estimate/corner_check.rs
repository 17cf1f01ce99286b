//! Corners of a measured target that their observations contradict.
//!
//! The observations are those of the views that measured the target, and of held-out views, whose residuals are
//! independent of the map.

use std::collections::BTreeMap;

use glam::DVec2;

use super::target_map::{FALSE_ALARM, TargetMap};
use super::values::Estimate;
use crate::adjust::finding::{Count, Finding, OutlierPattern};
use crate::input::panel::PanelRef;
use deltille_core::statistics::chi_squared_p_value;

/// The observations of a corner.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    count: Count,
    /// Sum of the squared lengths of the residuals, px².
    squares: f64,
}

impl Seen {
    /// RMS residual per axis, px.
    fn rms_px(&self) -> f64 {
        (self.squares / (2 * self.count.corners.max(1)) as f64).sqrt()
    }
}

impl Estimate {
    /// RMS residual per axis of each corner of the target over all views, px, by panel, row and column.
    pub fn rms_of_corners(&self) -> BTreeMap<(PanelRef, i32, i32), f64> {
        self.seen().into_iter().map(|(corner, seen)| (corner, seen.rms_px())).collect()
    }

    fn seen(&self) -> BTreeMap<(PanelRef, i32, i32), Seen> {
        let mut seen: BTreeMap<_, Seen> = BTreeMap::new();
        let views = self.cameras.iter().flat_map(|camera| &camera.views);
        for corner in views.flat_map(|view| &view.corners) {
            let of_corner = seen.entry((corner.panel, corner.row, corner.col)).or_default();
            of_corner.count.add(corner.outlier);
            of_corner.squares += DVec2::length_squared(corner.residual);
        }
        seen
    }

    /// The findings about the corners of the measured target: those with more outliers than others, in held-out or
    /// other views, those that were not measured, and offsets that are larger than those of the others explain.
    pub(crate) fn of_measured_corners(&self) -> Vec<Finding> {
        let Some(map) = &self.map else { return Vec::new() };
        let held_out = self.held_out.as_ref().map_or(Vec::new(), |test| test.contradicted(true));
        let is_named = |finding: &Finding| held_out.iter().any(|of| of.is_of_corner_of(finding));
        let own = self.contradicted(false).into_iter().filter(|finding| !is_named(finding));
        let mut found: Vec<Finding> = held_out.iter().cloned().chain(own).collect();
        let seen = self.seen();
        for &label in &map.not_measured {
            let of_corner = seen.get(&label).copied().unwrap_or_default();
            let refused = of_corner.finding(label, false, true);
            found.retain(|finding| !finding.is_of_corner_of(&refused));
            found.push(refused);
        }
        found.extend(map.beyond_prior());
        found
    }

    /// The corners with significantly more outliers than all others.
    fn contradicted(&self, is_held_out: bool) -> Vec<Finding> {
        let seen = self.seen();
        let all = seen.values().fold(Count::default(), |sum, of| sum.with(of.count));
        let level = FALSE_ALARM / seen.len().max(1) as f64;
        let of_corner = |(&label, of): (_, &Seen)| {
            let Count { outliers, corners } = of.count;
            // Laplace's rule: the rate that the other corners imply, even without a single outlier.
            let rate = (all.outliers - outliers + 1) as f64 / (all.corners - corners + 2) as f64;
            (at_least(outliers, corners, rate) < level)
                .then(|| of.finding(label, is_held_out, false))
        };
        seen.iter().filter_map(of_corner).collect()
    }
}

impl Seen {
    fn finding(
        &self,
        (panel, row, col): (PanelRef, i32, i32),
        is_held_out: bool,
        is_excluded: bool,
    ) -> Finding {
        let Count { outliers, corners } = self.count;
        let rms_px = self.rms_px();
        let pattern = OutlierPattern::Corner { panel, row, col, rms_px, is_held_out };
        Finding { pattern, outliers, corners, is_excluded }
    }
}

impl Finding {
    /// Whether both are about the same corner.
    fn is_of_corner_of(&self, other: &Self) -> bool {
        let label = |finding: &Self| match finding.pattern {
            OutlierPattern::Corner { panel, row, col, .. } => Some((panel, row, col)),
            _ => None,
        };
        label(self).is_some() && label(self) == label(other)
    }
}

impl TargetMap {
    /// The offsets that are too large for the distribution of all offsets.
    fn beyond_prior(&self) -> impl Iterator<Item = Finding> {
        let [plane, out] = self.expected_mm;
        let corners = self.corners().len();
        let is_beyond = move |offset: glam::DVec3| {
            let squares = offset.truncate().length_squared() / (plane * plane)
                + offset.z * offset.z / (out * out);
            chi_squared_p_value(squares, 3) < FALSE_ALARM / corners.max(1) as f64
        };
        let beyond = self.corners().iter().filter(move |corner| is_beyond(corner.offset_mm));
        beyond.map(move |corner| {
            let (panel, row, col) = (corner.panel, corner.row, corner.col);
            let offset_mm = corner.offset_mm.length();
            let pattern = OutlierPattern::Offset { panel, row, col, offset_mm };
            Finding { pattern, outliers: 1, corners, is_excluded: false }
        })
    }
}

/// The probability of at least `least` of `all` independent events, each of probability `rate`.
fn at_least(least: usize, all: usize, rate: f64) -> f64 {
    let odds = (rate / (1.0 - rate)).ln();
    let first = all as f64 * (1.0 - rate).ln();
    let ratio = |i: usize| ((all - i) as f64 / (i + 1) as f64).ln() + odds;
    let mut ln_term = first + (0..least).map(ratio).sum::<f64>();
    let mut sum = 0.0;
    for i in least..=all {
        sum += ln_term.exp();
        ln_term += ratio(i);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_of_counts_match_a_table() {
        assert!((at_least(0, 5, 0.25) - 1.0).abs() < 1e-12);
        // 1 − 0.9¹⁰, and 10 · 0.1⁹ · 0.9 + 0.1¹⁰.
        assert!((at_least(1, 10, 0.1) - 0.651_321_559_9).abs() < 1e-9);
        assert!((at_least(9, 10, 0.1) / 9.1e-9 - 1.0).abs() < 1e-9);
        assert!((at_least(3000, 6000, 0.5) - 0.505_15).abs() < 1e-4);
    }
}
