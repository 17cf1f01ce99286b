//! Vectorised sums over the pixels of a window.

use multiversion::multiversion;

use super::columns::Columns;
use super::window::MAX_PIXELS;
use crate::lanes::LANES;

/// Returns the products of all pairs of the first N columns, over `count` pixels. Only the upper
/// half is filled.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn products<const N: usize>(columns: &mut Columns, count: usize) -> [[f64; N]; N] {
    let padded = count.next_multiple_of(LANES).min(MAX_PIXELS);
    // All of the last vector, as bits: a choice for each pixel would be a branch.
    let kept: [u32; LANES] =
        std::array::from_fn(|k| if padded - LANES + k < count { u32::MAX } else { 0 });
    for column in columns.iter_mut().take(N) {
        if let Some(last) = column[..padded].last_chunk_mut::<LANES>() {
            for (value, kept) in last.iter_mut().zip(kept) {
                *value = f32::from_bits(value.to_bits() & kept);
            }
        }
    }
    let mut products = [[0.0; N]; N];
    for i in (0..N).step_by(2) {
        for j in (i / 4 * 4..N).step_by(4) {
            let mut sums = [[0.0; HALF]; 8];
            products_of_blocks(&columns[i..i + 2], &columns[j..j + 4], padded, &mut sums);
            for (k, eight) in sums.iter().enumerate() {
                products[i + k / 4][j + k % 4] = f64::from(sum_of_eight(eight));
            }
        }
    }
    products
}

/// Lanes of a sum of products: with this many, eight sums fit into registers.
const HALF: usize = LANES / 2;

/// Returns the products of two columns with four others: eight independent sums. They are named one by one so that each
/// is a vector.
#[inline(always)]
fn products_of_blocks(
    two: &[[f32; MAX_PIXELS]],
    four: &[[f32; MAX_PIXELS]],
    count: usize,
    sums: &mut [[f32; HALF]; 8],
) {
    let (a, _) = two[0][..count].as_chunks::<HALF>();
    let (b, _) = two[1][..count].as_chunks::<HALF>();
    let (c, _) = four[0][..count].as_chunks::<HALF>();
    let (d, _) = four[1][..count].as_chunks::<HALF>();
    let (e, _) = four[2][..count].as_chunks::<HALF>();
    let (f, _) = four[3][..count].as_chunks::<HALF>();
    let [mut ac, mut ad, mut ae, mut af] = [[0.0; HALF]; 4];
    let [mut bc, mut bd, mut be, mut bf] = [[0.0; HALF]; 4];
    for (((((a, b), c), d), e), f) in a.iter().zip(b).zip(c).zip(d).zip(e).zip(f) {
        for k in 0..HALF {
            ac[k] += a[k] * c[k];
            ad[k] += a[k] * d[k];
            ae[k] += a[k] * e[k];
            af[k] += a[k] * f[k];
            bc[k] += b[k] * c[k];
            bd[k] += b[k] * d[k];
            be[k] += b[k] * e[k];
            bf[k] += b[k] * f[k];
        }
    }
    *sums = [ac, ad, ae, af, bc, bd, be, bf];
}

/// Returns the sum of the lanes, added pairwise.
#[inline(always)]
fn sum_of_eight(lanes: &[f32; HALF]) -> f32 {
    let mut four = [0.0; HALF / 2];
    for k in 0..HALF / 2 {
        four[k] = lanes[k] + lanes[k + HALF / 2];
    }
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Returns the sums of the squares of the values, and of the differences between successive ones.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn squares(values: &[f32]) -> [f32; 2] {
    /// Lanes of each of the two sums: one vector of the processors that this is compiled for.
    const WIDTH: usize = LANES / 2;
    let (mut sums, mut sums_of_steps) = ([0.0f32; WIDTH], [0.0f32; WIDTH]);
    let count = values.len().saturating_sub(1) / WIDTH;
    for i in 0..count {
        let nine = &values[i * WIDTH..(i + 1) * WIDTH + 1];
        for k in 0..WIDTH {
            sums[k] += nine[k] * nine[k];
            sums_of_steps[k] += (nine[k + 1] - nine[k]) * (nine[k + 1] - nine[k]);
        }
    }
    let rest = &values[count * WIDTH..];
    for k in 0..rest.len() {
        let step = if k + 1 < rest.len() { rest[k + 1] - rest[k] } else { 0.0 };
        sums[k % WIDTH] += rest[k] * rest[k];
        sums_of_steps[k % WIDTH] += step * step;
    }
    let (mut sum, mut sum_of_steps) = (0.0, 0.0);
    for k in 0..WIDTH {
        sum += sums[k];
        sum_of_steps += sums_of_steps[k];
    }
    [sum, sum_of_steps]
}

/// Returns the minimum and the maximum.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn ends(values: &[f32]) -> (f32, f32) {
    let (chunks, rest) = values.as_chunks::<LANES>();
    let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
    // Comparisons, because `f32::min` also handles NaN, which costs more.
    for chunk in chunks {
        for k in 0..LANES {
            low[k] = if chunk[k] < low[k] { chunk[k] } else { low[k] };
            high[k] = if chunk[k] > high[k] { chunk[k] } else { high[k] };
        }
    }
    for k in 0..rest.len() {
        low[k] = low[k].min(rest[k]);
        high[k] = high[k].max(rest[k]);
    }
    let mut width = LANES / 2;
    while width > 0 {
        for k in 0..width {
            low[k] = low[k].min(low[k + width]);
            high[k] = high[k].max(high[k + width]);
        }
        width /= 2;
    }
    (low[0], high[0])
}
