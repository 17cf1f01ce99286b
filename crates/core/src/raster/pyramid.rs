use std::borrow::Cow;

use glam::DVec2;
use multiversion::multiversion;

use super::{Gray, ImageView, Intensity, PYRAMID_FULL_SCALE, View, fill_bands, of_any};

/// Smoothed copies of an image, each half the size of the previous one.
///
/// Level 0 is the image filtered with a 3×3 binomial; level n+1 is the 2×2 mean of level n. All have 10 bits. Pixel x
/// of level n+1 covers pixels 2x and 2x+1, so `x_n = 2·x_{n+1} + 0.5`.
#[derive(Clone, Debug)]
pub struct Pyramid<'a> {
    levels: Cow<'a, [Gray<i16>]>,
}

impl Pyramid<'_> {
    /// Computes at most `count` levels; stops before a side falls below `min_side` pixels.
    pub fn new<'a>(
        image: impl Into<ImageView<'a>>,
        count: usize,
        min_side: usize,
    ) -> Pyramid<'static> {
        let first = of_any!(image.into(), view => binomial(view));
        let mut levels = vec![first];
        while levels.len() < count {
            let last = &levels[levels.len() - 1];
            if last.width().min(last.height()) / 2 < min_side {
                break;
            }
            levels.push(half(last));
        }
        Pyramid { levels: Cow::Owned(levels) }
    }

    /// Returns a pyramid that starts at `level`, which becomes its level 0. It contains at least the coarsest level.
    pub fn from_level(&self, level: usize) -> Pyramid<'_> {
        Pyramid { levels: Cow::Borrowed(&self.levels[level.min(self.levels.len() - 1)..]) }
    }

    /// Returns the levels, finest first; never empty.
    pub fn levels(&self) -> &[Gray<i16>] {
        &self.levels
    }

    /// Converts a position in `level` to level 0, px.
    pub fn to_level_0(level: usize, place: DVec2) -> DVec2 {
        let scale = f64::from(1u32 << level);
        (place + 0.5) * scale - 0.5
    }

    /// Converts a position in level 0 to `level`, px.
    pub fn from_level_0(level: usize, place: DVec2) -> DVec2 {
        let scale = f64::from(1u32 << level);
        (place + 0.5) / scale - 0.5
    }
}

/// Filters with the 3×3 binomial (1 2 1)ᵀ(1 2 1)/16 with repeated borders; the result has 10 bits.
fn binomial<T: Intensity>(image: View<T>) -> Gray<i16> {
    let (width, height) = (image.width(), image.height());
    let mut out = Gray::new(width, height);
    if width == 0 || height == 0 {
        return out;
    }
    fill_bands(out.pixels_mut(), width, |first, band| {
        let (mut sums, mut sums_of_bytes) = (vec![0.0; width + 2], vec![0; width + 2]);
        for (i, out) in band.chunks_exact_mut(width).enumerate() {
            let y = first + i;
            let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)].map(|y| image.row(y));
            match rows.map(T::as_bytes) {
                [Some(above), Some(here), Some(below)] => {
                    binomial_row_of_bytes([above, here, below], &mut sums_of_bytes, out);
                }
                _ => binomial_row(rows, &mut sums, out),
            }
        }
    });
    out
}

/// Filters a row of bytes with the binomial, by additions alone. For a sum S of at most 16 · 255,
///
/// ```text
///     1023/4080 S = (S + S/340) / 4        S/340 = 771 (S + 1)/2¹⁸ for whole numbers
/// ```
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn binomial_row_of_bytes(rows: [&[u8]; 3], columns: &mut [u16], out: &mut [i16]) {
    let width = out.len();
    let [above, here, below] = rows.map(|row| &row[..width]);
    let sums = &mut columns[1..=width];
    for x in 0..width {
        sums[x] = u16::from(above[x]) + 2 * u16::from(here[x]) + u16::from(below[x]);
    }
    columns[0] = columns[1];
    columns[width + 1] = columns[width];
    let [left, centre, right] = [0, 1, 2].map(|shift| &columns[shift..shift + width]);
    for x in 0..width {
        out[x] = bytes_to_10_bits(left[x] + 2 * centre[x] + right[x]);
    }
}

/// Converts this sum to 10 bits, with rounding.
#[inline(always)]
fn bytes_to_10_bits(sum: u16) -> i16 {
    let part = ((u32::from(sum + 1) * 771) >> 16) as u16 >> 2;
    ((sum + part + 2) >> 2) as i16
}

/// 1.5·2²³: floats of this size have no fractional bits.
const ROUND: f32 = 12_582_912.0;

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn binomial_row<T: Intensity>(rows: [&[T]; 3], columns: &mut [f32], out: &mut [i16]) {
    let width = out.len();
    let [above, here, below] = rows.map(|row| &row[..width]);
    let sums = &mut columns[1..=width];
    for x in 0..width {
        sums[x] = above[x].to_f32() + 2.0 * here[x].to_f32() + below[x].to_f32();
    }
    columns[0] = columns[1];
    columns[width + 1] = columns[width];
    let to_10_bits = PYRAMID_FULL_SCALE / T::FULL_SCALE / 16.0;
    let [left, centre, right] = [0, 1, 2].map(|shift| &columns[shift..shift + width]);
    for x in 0..width {
        let sum = left[x] + 2.0 * centre[x] + right[x];
        // Takes the rounded integer from the low bits of the sum, which is cheaper than a conversion that checks for
        // NaN.
        out[x] = (sum * to_10_bits + ROUND).to_bits() as i16;
    }
}

/// Computes the mean of each 2×2 block; drops an odd last row or column.
fn half(image: &Gray<i16>) -> Gray<i16> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mut out = Gray::new(width, height);
    fill_bands(out.pixels_mut(), width, |first, band| {
        for (i, out) in band.chunks_exact_mut(width).enumerate() {
            let y = 2 * (first + i);
            half_row([image.row(y), image.row(y + 1)], out);
        }
    });
    out
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn half_row([upper, lower]: [&[i16]; 2], out: &mut [i16]) {
    let blocks = upper.chunks_exact(2).zip(lower.chunks_exact(2));
    for (pixel, (u, l)) in out.iter_mut().zip(blocks) {
        *pixel = (u[0] + u[1] + l[0] + l[1] + 2) >> 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_scale_stays_full_scale_at_every_depth_and_level() {
        let eight = Pyramid::new(&Gray::from_fn(40, 33, |_, _| 255u8), 3, 8);
        let sixteen = Pyramid::new(&Gray::from_fn(40, 33, |_, _| 65535u16), 3, 8);
        assert_eq!(eight.levels().len(), 3);
        for level in eight.levels().iter().chain(sixteen.levels()) {
            assert!(level.pixels().iter().all(|&v| v == 1023));
        }
    }

    #[test]
    fn bytes_are_blurred_as_any_depth_is() {
        for sum in 0..=4080u16 {
            let exact = (2 * u32::from(sum) * 1023 + 4080) / (2 * 4080);
            assert_eq!(bytes_to_10_bits(sum) as u32, exact);
        }
        // The same image in 16 bits, with ties rounded to even.
        let bytes = Gray::from_fn(67, 41, |x, y| ((x * x * 31 + y * y * 17 + x * y) % 256) as u8);
        let words = bytes.map(|v| 257 * u16::from(v));
        let (fast, general) = (binomial(bytes.view()), binomial(words.view()));
        let differ = fast.pixels().iter().zip(general.pixels()).filter(|(a, b)| a != b);
        assert!(differ.clone().all(|(a, b)| [(171, 170), (853, 852)].contains(&(*a, *b))));
        assert!(differ.count() < 5);
    }

    #[test]
    fn a_ramp_keeps_its_position() {
        let ramp = Gray::from_fn(64, 64, |x, _| (4 * x) as u8);
        let pyramid = Pyramid::new(&ramp, 3, 8);
        for (n, level) in pyramid.levels().iter().enumerate() {
            let x = Pyramid::to_level_0(n, DVec2::splat(5.0)).x;
            let expected = 4.0 * x / 255.0 * 1023.0;
            assert!((f64::from(level.at(5, 5)) - expected).abs() < 1.0);
        }
    }

    #[test]
    fn tiny_images_have_one_level() {
        assert_eq!(Pyramid::new(&Gray::<u8>::new(1, 1), 3, 8).levels().len(), 1);
        assert_eq!(Pyramid::new(&Gray::<u8>::new(0, 0), 3, 8).levels().len(), 1);
    }
}
