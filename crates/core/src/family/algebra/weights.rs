//! The weight distribution of a linear code: a proof of its distance.
//!
//! If a code has few dimensions, all its words are weighed. If it has many, all words of its dual
//! are weighed. They share an even number of set bits with each code word. The number B_j of dual
//! words of weight j determines the number A_i of
//! code words of weight i (MacWilliams & Sloane, chapter 5):
//!
//! ```text
//!     A_i = Σ B_j K_i(j) / Σ B_j        with the Krawtchouk polynomials K_i of the length
//! ```

use rayon::prelude::*;

use super::Span;
use crate::family::kernels::count_distances;
use crate::family::krawtchouk::krawtchouk;

/// Largest number of dimensions of a weighed code or dual: weighing takes a second or two.
const MAX_DIMENSIONS: u32 = 30;

/// Returns the number of words of each weight, 0 to `length`; `None` if neither the code nor its dual is small
/// enough.
pub fn weights(code: &Span, length: u32) -> Option<Vec<u128>> {
    let other = length - code.dimension();
    if code.dimension().min(other) > MAX_DIMENSIONS {
        return None;
    }
    if code.dimension() <= other {
        return Some(counted(code).into_iter().take(length as usize + 1).map(u128::from).collect());
    }
    let of_dual = counted(&code.dual(length));
    let weight = |i: u32| {
        let sum: i128 =
            (0..=length).map(|j| i128::from(of_dual[j as usize]) * krawtchouk(length, i, j)).sum();
        (sum >> other) as u128
    };
    Some((0..=length).map(weight).collect())
}

/// Weighs all words.
fn counted(code: &Span) -> [u64; 65] {
    /// Number of rows whose sums are listed; the sums of the other rows are each compared with the list.
    const LISTED: usize = 12;
    let (listed, others) = code.rows().split_at(code.rows().len().min(LISTED));
    let (listed, others) = (Span::of(listed.iter().copied()), others.to_vec());
    let list: Vec<u64> = listed.words().collect();
    let sum = |which: u64| {
        let chosen = (0..).zip(&others).filter(|&(i, _)| which >> i & 1 == 1);
        chosen.fold(0, |sum, (_, row)| sum ^ row)
    };
    (0..1u64 << others.len())
        .into_par_iter()
        .fold(
            || [0; 65],
            |mut counts, which| {
                count_distances(sum(which), &list, &mut counts);
                counts
            },
        )
        .reduce(|| [0; 65], |a, b| std::array::from_fn(|i| a[i] + b[i]))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Tests counting with the words of the code or of its dual, with and without a list.
        #[test]
        fn weights_are_those_of_all_words(words: [u64; 17], length in 9u32..=20, few in 1usize..17) {
            let mask = (1 << length) - 1;
            let code = Span::of(words[..few].iter().map(|word| word & mask));
            let mut expected = vec![0; length as usize + 1];
            code.words().for_each(|word| expected[word.count_ones() as usize] += 1);
            prop_assert_eq!(weights(&code, length).unwrap(), expected);
        }
    }
}
