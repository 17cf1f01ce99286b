//! Spacing of the rows and columns of a grid: equal, or wide and narrow in turn, as on an AprilGrid.
//!
//! ```text
//!     ██████████   ██████████        columns    0       1  2       3
//!     ██████████   ██████████        positions  0      1+a 2      3+a    in mean spacings
//!               ███
//!     ██████████   ██████████
//! ```
//!
//! Corners and their neighbours are predicted by smooth maps of these positions. A map of the numbers of the columns
//! would have to bend back and forth.

use glam::DVec2;

use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::statistics::median;

/// Minimum logarithm of the ratio of wide to narrow spacings: half of that of the widest gap of an AprilGrid, 0.9 tags.
/// Distortion, at the border of a fisheye with 220°, imitates 0.022.
const MIN_LN_RATIO: f64 = 0.05;

/// Spacing of the rows and columns of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spacing {
    /// Additional width after even columns, and after even rows, in mean spacings; after odd ones, it is missing.
    additional: DVec2,
}

impl Spacing {
    /// Equal spacings.
    pub(crate) const EQUAL: Self = Self { additional: DVec2::ZERO };

    /// Returns the spacing of a grid, whose positions `at` returns. Four corners in a row give the ratio of the middle
    /// spacing to the mean of its neighbours, in which perspective and distortion nearly cancel.
    pub(crate) fn of(
        kind: GridKind,
        vertices: impl Iterator<Item = Vertex>,
        at: impl Fn(Vertex) -> Option<DVec2>,
    ) -> Self {
        if kind != GridKind::Checker {
            return Self::EQUAL;
        }
        let steps = [Vertex::new(0, 1), Vertex::new(1, 0)];
        let mut ratios = [const { Vec::new() }; 2];
        for first in vertices {
            for (step, ratios) in steps.into_iter().zip(&mut ratios) {
                let second = first + step;
                let row = [first, second, second + step, second + step + step].map(&at);
                let [Some(a), Some(b), Some(c), Some(d)] = row else { continue };
                let [before, middle, after] = [(a, b), (b, c), (c, d)].map(|(a, b)| a.distance(b));
                let ratio = (before * after).sqrt().ln() - middle.ln();
                let is_even = (first.col * step.col + first.row * step.row).rem_euclid(2) == 0;
                ratios.push(if is_even { ratio } else { -ratio });
            }
        }
        let additional = ratios.map(|ratios| {
            let ratio = median(ratios).filter(|ratio| ratio.abs() > MIN_LN_RATIO);
            ratio.map_or(0.0, |ratio| (ratio / 2.0).tanh())
        });
        Self { additional: additional.into() }
    }

    /// Returns the displacement of a lattice step from a vertex along columns and rows, in mean spacings.
    pub(crate) fn way(self, from: Vertex, step: Vertex) -> DVec2 {
        let to = from + step;
        let steps = DVec2::new(step.col.into(), step.row.into());
        let is_odd = |v: Vertex| DVec2::new(f64::from(v.col & 1), f64::from(v.row & 1));
        steps + self.additional * (is_odd(to) - is_odd(from))
    }

    /// Returns the width of a step of the lattice from a vertex, relative to the same step with equal spacing.
    pub(crate) fn width(self, from: Vertex, step: Vertex) -> f64 {
        self.way(from, step).length() / Self::EQUAL.way(from, step).length()
    }

    /// Returns the lattice steps, along columns and rows, after which a displacement from a vertex ends.
    pub(crate) fn steps(self, from: Vertex, way: DVec2) -> DVec2 {
        let even = Vertex::new(from.row & !1, from.col & !1);
        let place = way + self.way(even, from - even);
        let pairs = (place / 2.0).floor();
        let rest = place - 2.0 * pairs;
        let (first, second) = (1.0 + self.additional, 1.0 - self.additional);
        let in_pair = (rest / first).min(DVec2::ONE) + ((rest - first) / second).max(DVec2::ZERO);
        let at_even = DVec2::new((from.col & 1).into(), (from.row & 1).into());
        2.0 * pairs + in_pair - at_even
    }

    /// Returns the widest spacing, in mean spacings.
    pub(crate) fn widest(self) -> f64 {
        1.0 + self.additional.abs().max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steep view of the corners of an AprilGrid with gaps of 0.3 tags, whose first column is the end of a tag.
    fn seen(v: Vertex) -> Option<DVec2> {
        let is_in = (0..5).contains(&v.row) && (0..6).contains(&v.col);
        let place = |i: i32| f64::from(i.div_euclid(2)) * 1.3 + f64::from(i.rem_euclid(2));
        let (x, y) = (place(v.col + 1), place(v.row));
        let depth = 1.0 + 0.1 * x - 0.06 * y;
        is_in.then(|| DVec2::new(500.0 + 40.0 * x / depth, 400.0 - 40.0 * y / depth))
    }

    fn spacing() -> Spacing {
        let square = (0..6).flat_map(|row| (0..6).map(move |col| Vertex::new(row, col)));
        Spacing::of(GridKind::Checker, square, seen)
    }

    #[test]
    fn gaps_are_measured_under_perspective() {
        let Spacing { additional } = spacing();
        let gap = 0.7 / 1.3;
        assert!(additional.abs_diff_eq(DVec2::new(-gap, gap), 0.02), "{additional}");
    }

    #[test]
    fn displacements_and_steps_are_inverse() {
        let spacing = spacing();
        for (row, col) in (-3..4).flat_map(|row| (-3..4).map(move |col| (row, col))) {
            for from in [Vertex::new(0, 0), Vertex::new(3, -2), Vertex::new(-1, 5)] {
                let way = spacing.way(from, Vertex::new(row, col));
                let steps = spacing.steps(from, way);
                assert!(steps.abs_diff_eq(DVec2::new(col.into(), row.into()), 1e-9), "{steps}");
            }
        }
    }
}
