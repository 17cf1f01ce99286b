//! Numbers that a processor works on at once.

/// As many as the widest processors have, of single precision.
pub(crate) const LANES: usize = 16;

/// Their sum: by halves, as sixteen additions one after the other wait for each other.
///
/// Not within the loop that makes them, which would keep sixteen numbers then instead of one vector.
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
