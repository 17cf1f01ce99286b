//! SIMD lanes.

/// Number of single-precision lanes of the widest vector registers.
pub(crate) const LANES: usize = 16;

/// Returns the sum of the lanes. Adds pairwise, because each of sixteen sequential additions would
/// wait for the previous one.
///
/// Not inlined: within the loop that computes the lanes, the compiler would keep sixteen scalars
/// instead of one vector.
#[inline(never)]
pub(crate) fn sum(lanes: &[f32; LANES]) -> f32 {
    let (mut eight, mut four) = ([0.0; LANES / 2], [0.0; LANES / 4]);
    for k in 0..LANES / 2 {
        eight[k] = lanes[k] + lanes[k + LANES / 2];
    }
    for k in 0..LANES / 4 {
        four[k] = eight[k] + eight[k + LANES / 4];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Returns the scalar product of two slices of equal length. Its eight sums do not wait for each other.
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    let ((a, rest_of_a), (b, rest_of_b)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0f32; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest = rest_of_a.iter().zip(rest_of_b).map(|(a, b)| a * b);
    sums.iter().sum::<f32>() + rest.sum::<f32>()
}
