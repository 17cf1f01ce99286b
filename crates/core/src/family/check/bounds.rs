//! Upper bounds on the size of a family.
//!
//! The codes of a family and their rotations are a binary code of length b and distance h, with three words per tag,
//! or four per square tag. So bounds of binary codes, divided by that number, bound families.
//!
//! *Sphere packing*: balls of radius ⌊(h−1)/2⌋ do not overlap.
//!
//! *Linear programming* (Delsarte, "An algebraic approach to the association schemes of coding theory", 1973): the
//! distance distribution A_h, …, A_b of a code of M words satisfies A_i ≥ 0 and Σ_i A_i K_k(i) ≥ −C(b,k) with the
//! Krawtchouk polynomials K_k, and M = 1 + Σ A_i. The program is solved in floating point. Its dual solution is then
//! rounded to integers and checked exactly, so the bound does not depend on rounding. For odd h, a parity bit gives a
//! code of length b+1, distance h+1 and even distances only, whose bound is often lower. For even h, replacing a cell
//! by a parity bit makes all distances even. If rounding leaves no solution that can be checked, as with 64 cells and
//! small distances, there is no such bound.

use super::statistics::ball;
use crate::family::Family;
use crate::family::krawtchouk::{binomial, krawtchouk};
use crate::lattice::{Dimension, GridKind};

/// Upper bounds on the number of tags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Bounds {
    /// A third of Delsarte's linear programming bound, as every tag has three words; a quarter for square tags. If no
    /// bound was found, it is that fraction of all words: see [`Self::found_none`].
    pub linear_programming: u64,
    /// The same fraction of the sphere-packing bound.
    pub sphere_packing: u64,
    found_none: bool,
}

impl Bounds {
    /// Returns whether linear programming found no bound for this distance, so that [`Self::linear_programming`] is
    /// meaningless.
    pub fn found_none(&self) -> bool {
        self.found_none
    }
}

/// Computes the bounds for tags of a kind and a dimension at distance `distance` ≥ 1.
pub fn bounds(kind: GridKind, dimension: Dimension, distance: u32) -> Bounds {
    bounds_of_cells(kind, dimension.bits(), distance)
}

impl Family {
    /// Computes the bounds for families of this kind and distance with the same number of used cells; free cells do
    /// not count.
    pub fn bounds(&self) -> Bounds {
        bounds_of_cells(self.kind(), self.used_cells(), self.distance())
    }
}

/// Computes the bounds for tags of `b` cells.
pub fn bounds_of_cells(kind: GridKind, b: u32, distance: u32) -> Bounds {
    let rotations = u64::from(kind.rotations());
    let packed = 2f64.powi(b as i32) / ball(b, distance.saturating_sub(1) / 2);
    let plain = delsarte(b, (distance..=b).collect());
    let even = |length: u32| delsarte(length, (distance..=length).filter(|i| i % 2 == 0).collect());
    // If rounding spoils the program, one for a smaller distance also bounds these codes.
    let best = match plain.min(even(b + distance % 2)) {
        u64::MAX if distance > 1 => delsarte(b, (distance - 1..=b).collect()),
        best => best,
    };
    // The number of all words, or one less if it exceeds a machine word. At distance 1, all words
    // form a code.
    let all = 1u64.checked_shl(b).unwrap_or(u64::MAX);
    Bounds {
        linear_programming: best.min(all) / rotations,
        sphere_packing: packed as u64 / rotations,
        found_none: distance > 1 && best >= all,
    }
}

/// Limit above which a bound is useless: it exceeds the number of all words of 65 bits.
const MOST: f64 = 4e19;

/// Returns an upper bound on the number of words of length n with all distances among `distances`.
fn delsarte(n: u32, distances: Vec<u32>) -> u64 {
    let constraints: Vec<u32> = (1..=n).collect();
    // max Σ a_i with Σ_i −K_k(i)/C(n,k) · a_i ≤ 1: feasible at a = 0, so the simplex can start.
    let matrix: Vec<Vec<f64>> = constraints
        .iter()
        .map(|&k| {
            let scale = binomial(n, k) as f64;
            distances.iter().map(|&i| -krawtchouk(n, k, i) as f64 / scale).collect()
        })
        .collect();
    let multipliers = maximise_sum(matrix);

    // Denominator of the rounded dual solution: the largest one for which the sums below, which do not exceed the
    // bound, fit.
    let bound = 2.0 + multipliers.iter().map(|y| y.max(0.0)).sum::<f64>();
    if !bound.is_finite() || bound > MOST {
        return u64::MAX;
    }
    let scale = 1i128 << (124 - bound.log2().ceil() as u32);
    // f(x) = 1 + Σ f_k K_k(x), f_k ≥ 0; if f(i) ≤ 0 for all distances i then M ≤ f(0).
    let f: Vec<i128> = constraints
        .iter()
        .zip(&multipliers)
        .map(|(&k, &y)| (y.max(0.0) / binomial(n, k) as f64 * scale as f64).round() as i128)
        .collect();
    let value = |i: u32| -> i128 {
        constraints.iter().zip(&f).map(|(&k, f)| f * krawtchouk(n, k, i)).sum::<i128>() + scale
    };
    // Rounding may leave f(i) slightly above zero: the constant term is lowered by that amount.
    let excess = distances.iter().map(|&i| value(i)).max().unwrap_or(0).max(0);
    if excess >= scale {
        return u64::MAX;
    }
    u64::try_from((value(0) - excess) / (scale - excess)).unwrap_or(u64::MAX)
}

/// Solves max Σ x_j, A x ≤ 1, x ≥ 0 by the simplex method; returns the dual solution, one value per row.
fn maximise_sum(mut a: Vec<Vec<f64>>) -> Vec<f64> {
    /// Threshold of rounding noise; entries are initially at most 1 in size.
    const ZERO: f64 = 1e-9;
    /// Number of steps after which Bland's rule, which cannot cycle, is used.
    const CAREFUL_AFTER: usize = 2_000;
    let (rows, columns) = (a.len(), a.first().map_or(0, Vec::len));
    // Slack variables columns.., right-hand side last.
    for (i, row) in a.iter_mut().enumerate() {
        row.extend((0..rows).map(|j| f64::from(u8::from(i == j))));
        row.push(1.0);
    }
    let width = columns + rows;
    let mut cost: Vec<f64> = (0..=width).map(|j| if j < columns { -1.0 } else { 0.0 }).collect();
    for pivot in 0..10 * CAREFUL_AFTER {
        let improving = (0..width).filter(|&j| cost[j] < -ZERO);
        let entering = if pivot < CAREFUL_AFTER {
            improving.min_by(|&i, &j| cost[i].total_cmp(&cost[j]))
        } else {
            improving.min()
        };
        let Some(column) = entering else { break };
        let leaving = (0..rows)
            .filter(|&i| a[i][column] > ZERO)
            .min_by(|&i, &j| (a[i][width] / a[i][column]).total_cmp(&(a[j][width] / a[j][column])));
        let Some(row) = leaving else { break };
        let scale = 1.0 / a[row][column];
        a[row].iter_mut().for_each(|x| *x *= scale);
        let pivot_row = a[row].clone();
        let eliminate = |other: &mut Vec<f64>| {
            let factor = other[column];
            if factor != 0.0 {
                other.iter_mut().zip(&pivot_row).for_each(|(x, p)| *x -= factor * p);
            }
        };
        a.iter_mut().enumerate().filter(|(i, _)| *i != row).for_each(|(_, r)| eliminate(r));
        eliminate(&mut cost);
    }
    cost[columns..width].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_match_the_published_ones() {
        // The last column of the table in `docs/families.md`, “Sizes”, and, for 25 bits, h = 8.
        for (bits, distance, expected) in [
            (16, 5, 141),
            (25, 7, 3478),
            (25, 8, 2158),
            (25, 9, 346),
            (36, 9, 251_756),
            (36, 11, 22_313),
            (49, 12, 37_871_778),
            (64, 12, 331_681_116_691),
            // Bounds of the first-order Reed-Muller code, in which two words are fixed.
            (64, 32, 42),
        ] {
            let dimension = Dimension::from_bits(bits).unwrap();
            let found = bounds(GridKind::Deltille, dimension, distance).linear_programming;
            assert_eq!(found, expected, "d{bits}h{distance}");
            let square = bounds(GridKind::Checker, dimension, distance).linear_programming;
            let quarter = 3 * expected / 4..=(3 * expected + 2) / 4;
            assert!(quarter.contains(&square), "a square tag takes four words, not three");
        }
    }

    #[test]
    fn perfect_codes_meet_the_bounds() {
        // The binary Golay code of length 23 has 4096 words, the repetition code of length 9 has two.
        assert_eq!(delsarte(23, (7..=23).collect()), 4096);
        assert_eq!(delsarte(9, vec![9]), 2);
        assert_eq!(delsarte(15, (3..=15).collect()), 2048);
    }
}
