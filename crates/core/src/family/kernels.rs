//! The few loops that dominate searches, compiled for the available instructions.
//!
//! On x86-64, each loop is also compiled with wider vectors and the population count instruction; a call selects the
//! best version for the processor. Without that instruction, counting bits takes several times as long.

use multiversion::multiversion;

/// Bits under a leaf of the sweep of [`super::lexicode`].
pub(super) const LEAF_BITS: u32 = 9;
/// Words under a leaf, one bit each.
pub(super) type Leaf = [u64; 8];
/// Lowest bit of the distance so far in an entry of the sweep's list; the word is below it.
const DISTANCE_SHIFT: u32 = 52;

/// Returns whether some word of `list` is closer to `word` than `distance`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub(super) fn any_nearer(word: u64, list: &[u64], distance: u32) -> bool {
    // Blocks without an inner branch compile to vector code.
    let (blocks, rest) = list.as_chunks::<64>();
    blocks.iter().any(|block| {
        block.iter().fold(0u64, |n, w| n + u64::from((word ^ w).count_ones() < distance)) > 0
    }) || rest.iter().any(|w| (word ^ w).count_ones() < distance)
}

/// Returns the position of the first word of `list` that is closer to `word` than `distance`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub(super) fn first_nearer(word: u32, list: &[u32], distance: u32) -> Option<usize> {
    let near = |w: &u32| (word ^ w).count_ones() < distance;
    let (blocks, rest) = list.as_chunks::<32>();
    for (i, block) in blocks.iter().enumerate() {
        if block.iter().fold(0u32, |n, w| n + u32::from(near(w))) > 0 {
            return block.iter().position(near).map(|at| 32 * i + at);
        }
    }
    rest.iter().position(near).map(|at| 32 * blocks.len() + at)
}

/// Returns the positions in `list` of the words closer to `word` than `distance`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub fn nearer(word: u64, list: &[u64], distance: u32) -> Vec<u32> {
    let mut found = Vec::new();
    for (b, block) in list.chunks(64).enumerate() {
        let near =
            block.iter().fold(0u64, |n, w| n + u64::from((word ^ w).count_ones() < distance));
        if near > 0 {
            let position = |i: usize| (64 * b + i) as u32;
            let hits =
                block.iter().enumerate().filter(|(_, w)| (word ^ **w).count_ones() < distance);
            found.extend(hits.map(|(i, _)| position(i)));
        }
    }
    found
}

/// Adds the number of words of `list` at each distance from `word` to `counts`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub(super) fn count_distances(word: u64, list: &[u64], counts: &mut [u64; 65]) {
    for other in list {
        counts[(word ^ other).count_ones() as usize] += 1;
    }
}

/// Descends one level in the tree of the sweep of [`super::lexicode`]. Keeps the entries whose distance stays at most
/// `slack` after the three bits that start at `shift` are compared with `symbol`.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub(super) fn thin_out(from: &[u64], to: &mut Vec<u64>, shift: u32, symbol: u64, slack: u32) {
    /// Number of ones of 0 to 7, two bits each.
    const ONES: u64 = 0b11_10_10_01_10_01_01_00;
    to.resize(from.len(), 0);
    let mut kept = 0;
    for &entry in from {
        let differing = (entry >> shift ^ symbol) & 0b111;
        let entry = entry + ((ONES >> (2 * differing) & 0b11) << DISTANCE_SHIFT);
        // Always written but counted only if kept: there is no branch to mispredict.
        to[kept] = entry;
        kept += usize::from(entry >> DISTANCE_SHIFT <= u64::from(slack));
    }
    to.truncate(kept);
}

/// Returns the words under a leaf of the sweep that are too close to some entry. `balls` contains the 512 balls of
/// the leaf for each radius from 0 to 9.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512vl+avx512vpopcntdq+popcnt",
    "x86_64+avx2+popcnt"
))]
pub(super) fn cover(entries: &[u64], balls: &[Leaf], slack: u32) -> Leaf {
    let mut covered = [0; 8];
    for some in entries.chunks(16) {
        for &entry in some {
            let radius = (u64::from(slack) - (entry >> DISTANCE_SHIFT)).min(LEAF_BITS.into());
            let centre = entry & ((1 << LEAF_BITS) - 1);
            let ball = &balls[(radius << LEAF_BITS | centre) as usize];
            covered = std::array::from_fn(|i| covered[i] | ball[i]);
        }
        if covered == [u64::MAX; 8] {
            break;
        }
    }
    covered
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn loops_match_their_definitions(word: u64, list in prop::collection::vec(any::<u64>(), 0..300)) {
            let distances = list.iter().map(|other| (word ^ other).count_ones());
            let distances: Vec<u32> = distances.collect();
            for distance in [0, 20, 26, 40] {
                let near = (0..).zip(&distances).filter(|(_, d)| **d < distance).map(|(i, _)| i);
                let near: Vec<u32> = near.collect();
                prop_assert_eq!(any_nearer(word, &list, distance), !near.is_empty());
                prop_assert_eq!(nearer(word, &list, distance), near);
                let (half, halves) = (word as u32, list.iter().map(|&w| w as u32).collect::<Vec<_>>());
                let first = halves.iter().position(|w| (half ^ w).count_ones() < distance / 2);
                prop_assert_eq!(first_nearer(half, &halves, distance / 2), first);
            }
            let (mut counts, mut expected) = ([0; 65], [0; 65]);
            count_distances(word, &list, &mut counts);
            distances.iter().for_each(|&d| expected[d as usize] += 1);
            prop_assert_eq!(counts, expected);
        }
    }
}
