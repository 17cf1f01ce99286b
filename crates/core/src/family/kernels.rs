//! The few loops in which searches spend their time, compiled for the instructions at hand.
//!
//! Each loop is one safe portable function. On x86-64 the same function is also compiled with
//! wider vectors and the population count instruction, and the best that the processor has is
//! chosen when called: counting bits without that instruction takes several times as long.

/// Bits under a leaf of the sweep of [`super::lexicode`].
pub(super) const LEAF_BITS: u32 = 9;
/// Words under a leaf, one bit each.
pub(super) type Leaf = [u64; 8];
/// An entry of a list of the sweep: the word, and from this bit on its distance so far.
const DISTANCE_SHIFT: u32 = 52;

/// Defines `$name`, which runs `$portable` compiled for the processor at hand.
macro_rules! for_this_processor {
    ($(#[$doc:meta])* fn $name:ident / $portable:ident ($($arg:ident: $type:ty),*) -> $result:ty) => {
        $(#[$doc])*
        #[inline]
        pub(super) fn $name($($arg: $type),*) -> $result {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512bw,avx512vl,avx512vpopcntdq,popcnt")]
                fn wide($($arg: $type),*) -> $result {
                    $portable($($arg),*)
                }
                #[target_feature(enable = "avx2,popcnt")]
                fn narrow($($arg: $type),*) -> $result {
                    $portable($($arg),*)
                }
                if is_x86_feature_detected!("avx512vpopcntdq")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512vl")
                {
                    // SAFETY: the processor has these features; the function is safe otherwise.
                    return unsafe { wide($($arg),*) };
                }
                if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("popcnt") {
                    // SAFETY: as above.
                    return unsafe { narrow($($arg),*) };
                }
            }
            $portable($($arg),*)
        }
    };
}

for_this_processor! {
    /// Whether some word of `list` is nearer to `word` than `distance`.
    fn any_nearer / any_nearer_portable(word: u64, list: &[u64], distance: u32) -> bool
}

#[inline(always)]
fn any_nearer_portable(word: u64, list: &[u64], distance: u32) -> bool {
    // Blocks without a branch inside become vector code.
    let (blocks, rest) = list.as_chunks::<64>();
    blocks.iter().any(|block| {
        block.iter().fold(0u64, |n, w| n + u64::from((word ^ w).count_ones() < distance)) > 0
    }) || rest.iter().any(|w| (word ^ w).count_ones() < distance)
}

for_this_processor! {
    /// Position of the first word of `list` that is nearer to `word` than `distance`.
    fn first_nearer / first_nearer_portable(word: u32, list: &[u32], distance: u32) -> Option<usize>
}

#[inline(always)]
fn first_nearer_portable(word: u32, list: &[u32], distance: u32) -> Option<usize> {
    let near = |w: &u32| (word ^ w).count_ones() < distance;
    let (blocks, rest) = list.as_chunks::<32>();
    for (i, block) in blocks.iter().enumerate() {
        if block.iter().fold(0u32, |n, w| n + u32::from(near(w))) > 0 {
            return block.iter().position(near).map(|at| 32 * i + at);
        }
    }
    rest.iter().position(near).map(|at| 32 * blocks.len() + at)
}

for_this_processor! {
    /// Positions in `list` of the words nearer to `word` than `distance`.
    fn nearer / nearer_portable(word: u64, list: &[u64], distance: u32) -> Vec<u32>
}

#[inline(always)]
fn nearer_portable(word: u64, list: &[u64], distance: u32) -> Vec<u32> {
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

for_this_processor! {
    /// Adds the number of words of `list` at each distance from `word` to `counts`.
    fn count_distances / count_distances_portable(
        word: u64, list: &[u64], counts: &mut [u64; 65]
    ) -> ()
}

#[inline(always)]
fn count_distances_portable(word: u64, list: &[u64], counts: &mut [u64; 65]) {
    for other in list {
        counts[(word ^ other).count_ones() as usize] += 1;
    }
}

for_this_processor! {
    /// One step down the tree of [`super::lexicode`]'s sweep: the entries whose distance, with the
    /// three bits from `shift` on compared to `symbol`, stays at most `slack`.
    fn thin_out / thin_out_portable(
        from: &[u64], to: &mut Vec<u64>, shift: u32, symbol: u64, slack: u32
    ) -> ()
}

#[inline(always)]
fn thin_out_portable(from: &[u64], to: &mut Vec<u64>, shift: u32, symbol: u64, slack: u32) {
    /// Number of ones of 0 to 7, two bits each.
    const ONES: u64 = 0b11_10_10_01_10_01_01_00;
    to.resize(from.len(), 0);
    let mut kept = 0;
    for &entry in from {
        let differing = (entry >> shift ^ symbol) & 0b111;
        let entry = entry + ((ONES >> (2 * differing) & 0b11) << DISTANCE_SHIFT);
        // Written always and counted sometimes: no branch to mispredict.
        to[kept] = entry;
        kept += usize::from(entry >> DISTANCE_SHIFT <= u64::from(slack));
    }
    to.truncate(kept);
}

for_this_processor! {
    /// Words under a leaf of the sweep that some entry is too near to; `balls` holds for radius 0
    /// to 9 the 512 balls of the leaf.
    fn cover / cover_portable(entries: &[u64], balls: &[Leaf], slack: u32) -> Leaf
}

#[inline(always)]
fn cover_portable(entries: &[u64], balls: &[Leaf], slack: u32) -> Leaf {
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
        fn all_versions_agree(word: u64, list in prop::collection::vec(any::<u64>(), 0..300)) {
            for distance in [0, 20, 26, 40] {
                let near = nearer_portable(word, &list, distance);
                prop_assert_eq!(nearer(word, &list, distance), near.clone());
                let (half, halves) = (word as u32, list.iter().map(|&w| w as u32).collect::<Vec<_>>());
                let first = halves.iter().position(|w| (half ^ w).count_ones() < distance / 2);
                prop_assert_eq!(first_nearer(half, &halves, distance / 2), first);
                prop_assert_eq!(first_nearer_portable(half, &halves, distance / 2), first);
                prop_assert_eq!(any_nearer(word, &list, distance), !near.is_empty());
                prop_assert_eq!(any_nearer_portable(word, &list, distance), !near.is_empty());
            }
            let (mut a, mut b) = ([0; 65], [0; 65]);
            count_distances(word, &list, &mut a);
            count_distances_portable(word, &list, &mut b);
            prop_assert_eq!(a, b);
        }
    }
}
