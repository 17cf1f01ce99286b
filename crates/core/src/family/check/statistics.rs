use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::family::TagWords;
use crate::family::kernels::count_distances;
use crate::lattice::{Dimension, GridKind};

/// Returns the number of unordered pairs of different words, among the codes and their rotations, at each distance.
///
/// Rotating both words of a pair preserves the distance, so with n rotations pairs come in groups of n. The count is
/// n·(pairs of two codes in any rotation) + n·(a code and its own rotation), but a code has only n/2 pairs with its
/// 180° rotation.
pub fn distance_histogram(
    kind: GridKind,
    dimension: Dimension,
    codes: &[u64],
) -> BTreeMap<u32, u64> {
    let words = TagWords::of(kind, dimension);
    let n = usize::from(kind.rotations());
    let rotations =
        |&code: &u64| std::iter::successors(Some(code), |&word| Some(words.rotate(word)));
    let turned: Vec<u64> = codes.iter().flat_map(|code| rotations(code).take(n)).collect();
    let counts = codes
        .par_iter()
        .enumerate()
        .map(|(i, &code)| {
            let mut counts = [0u64; 65];
            count_distances(code, &turned[..n * i], &mut counts);
            counts.iter_mut().for_each(|count| *count *= n as u64);
            for turn in 1..=n / 2 {
                let pairs = if 2 * turn == n { n / 2 } else { n };
                counts[(code ^ turned[n * i + turn]).count_ones() as usize] += pairs as u64;
            }
            counts
        })
        .reduce(|| [0; 65], sum_of);
    (0..).zip(counts).filter(|&(_, n)| n > 0).collect()
}

/// Returns the number of pairs of a code of `codes` and a word (a code of `others` in any rotation), at each
/// distance.
pub(in crate::family) fn cross_distances(
    kind: GridKind,
    dimension: Dimension,
    codes: &[u64],
    others: &[u64],
) -> BTreeMap<u32, u64> {
    let words = TagWords::of(kind, dimension);
    let rotations =
        |&code: &u64| std::iter::successors(Some(code), |&word| Some(words.rotate(word)));
    let turned: Vec<u64> = others
        .iter()
        .flat_map(|code| rotations(code).take(usize::from(kind.rotations())))
        .collect();
    let counts = codes
        .par_iter()
        .fold(
            || [0; 65],
            |mut counts, &code| {
                count_distances(code, &turned, &mut counts);
                counts
            },
        )
        .reduce(|| [0; 65], sum_of);
    (0..).zip(counts).filter(|&(_, n)| n > 0).collect()
}

fn sum_of(mut sum: [u64; 65], counts: [u64; 65]) -> [u64; 65] {
    sum.iter_mut().zip(counts).for_each(|(s, c)| *s += c);
    sum
}

/// Returns the probability that a random word of b `cells` is within t cells of a code or one of its rotations, for t
/// = 0 … ⌊(h−1)/2⌋: 3·N·Σ_{i≤t} C(b,i) / 2^b, or 4·N·… for square tags. This is exact because these balls do not
/// overlap.
pub fn false_positive_rates(kind: GridKind, cells: u32, distance: u32, codes: usize) -> Vec<f64> {
    let b = cells;
    let correctable = distance.saturating_sub(1) / 2;
    let words = f64::from(kind.rotations()) * codes as f64 / 2f64.powi(b as i32);
    (0..=correctable).map(|t| words * ball(b, t)).collect()
}

/// Returns the number of words within `radius` of a word, Σ_{i≤radius} C(b,i).
pub fn ball(bits: u32, radius: u32) -> f64 {
    let mut binomial = 1.0;
    let mut sum = 1.0;
    for i in 0..radius {
        binomial = binomial * f64::from(bits - i) / f64::from(i + 1);
        sum += binomial;
    }
    sum
}
