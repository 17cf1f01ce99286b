//! Extended quadratic-residue codes and their symmetry of order three.
//!
//! For a prime q ≡ ±1 mod 8, the binary code spanned by the shifts of the indicator word of the quadratic residues
//! mod q has dimension (q+1)/2. A parity bit at ∞ extends it to length q+1. The extended code is invariant under
//! PSL(2,q) acting on the projective line (Gleason–Prange theorem; MacWilliams & Sloane, chapter 16). For q ≡ 2 mod
//! 3, its element x → 1/(1−x), of order three, fixes no point, so it divides the q+1 positions into three-cycles.

use deltille_core::family::algebra::{CycleSpace, Span};

/// Primes q whose extended codes fit a word: lengths q+1 of 18, 24, 42 and 48.
pub const PRIMES: [u32; 4] = [17, 23, 41, 47];

/// Returns the minimum distance of the extended code; `q` must be one of [`PRIMES`].
pub fn min_distance(q: u32) -> u32 {
    match q {
        17 => 6,
        23 => 8,
        41 => 10,
        _ => 12,
    }
}

/// Returns the extended quadratic-residue code of length q+1 and dimension (q+1)/2, in cycle coordinates.
///
/// # Panics
/// Panics if `q` is not one of [`PRIMES`].
pub fn extended(q: u32) -> Span {
    let residues: Vec<u32> = (1..q).map(|x| x * x % q).collect();
    let indicator = |member: &dyn Fn(u32) -> bool| {
        (0..q).filter(|&i| member(i)).fold(0u64, |word, i| word | 1 << i)
    };
    let is_residue = |i: u32| residues.contains(&i);
    // One of these words generates a code of dimension (q+1)/2; which one depends on q mod 8.
    let generators = [indicator(&is_residue), indicator(&|i| i == 0 || is_residue(i))];
    let shifts = |word: u64| (0..q).map(move |s| (word << s | word >> (q - s)) & ((1 << q) - 1));
    let cyclic = generators
        .into_iter()
        .map(|word| Span::of(shifts(word)))
        .find(|span| span.dimension() == q.div_ceil(2))
        .expect("q is one of PRIMES");
    let order = line_in_cycles(q);
    Span::of(cyclic.rows().iter().map(|&row| {
        let parity = u64::from(row.count_ones() % 2);
        let value = |x: Option<u32>| x.map_or(parity, |x| row >> x & 1);
        (0..).zip(&order).fold(0, |word, (i, &x)| word | value(x) << i)
    }))
}

/// Returns the space of the words of [`extended`]: (q+1)/3 cycles and no central bit.
pub fn space(q: u32) -> CycleSpace {
    CycleSpace { cycles: (q + 1) / 3, centre: false }
}

/// Returns the points of the projective line (∞ = None), cycle by cycle of x → 1/(1−x).
fn line_in_cycles(q: u32) -> Vec<Option<u32>> {
    let inverse = |x: u32| (1..q).find(|y| x * y % q == 1);
    let image = |point: Option<u32>| match point {
        None => Some(0),
        Some(1) => None,
        Some(x) => inverse((q + 1 - x) % q),
    };
    let mut order: Vec<Option<u32>> = Vec::new();
    for point in std::iter::once(None).chain((0..q).map(Some)) {
        if !order.contains(&point) {
            order.extend([point, image(point), image(image(point))]);
        }
    }
    order
}

/// Returns the code shortened to the cycles in `keep`, in that order: the words that vanish on all other cycles,
/// without these cycles. Distance and invariance are preserved.
pub fn shortened(code: &Span, space: CycleSpace, keep: &[u32]) -> Span {
    let cut = (0..space.cycles).filter(|c| !keep.contains(c)).fold(0, |m, c| m | 0b111 << (3 * c));
    Span::of(code.vanishing_on(cut).rows().iter().map(|&row| {
        (0..).zip(keep).fold(0, |word, (i, &c)| word | (row >> (3 * c) & 0b111) << (3 * i))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extended_codes_have_their_dimension_distance_and_symmetry() {
        for q in [17, 23, 41] {
            let (code, space) = (extended(q), space(q));
            assert_eq!(code.dimension(), q.div_ceil(2));
            assert!(code.rows().iter().all(|&row| code.contains(space.rotate(row))));
            let lightest = code.words().skip(1).map(u64::count_ones).min().unwrap();
            assert_eq!(lightest, min_distance(q), "q = {q}");
        }
    }

    #[test]
    fn shortening_keeps_the_distance_and_the_symmetry() {
        let keep: Vec<u32> = (2..14).collect();
        let code = shortened(&extended(41), space(41), &keep);
        let short = CycleSpace { cycles: 12, centre: false };
        assert_eq!(code.dimension(), 15);
        assert!(code.rows().iter().all(|&row| code.contains(short.rotate(row))));
        assert!(code.words().skip(1).all(|word| word.count_ones() >= 10));
    }
}
