//! Grey values of colours in memory of any layout.

use multiversion::multiversion;

use super::{Gray, Intensity, fill_bands};

/// Weights of red, green and blue in luma, those of the `image` crate: Rec. 709 from the primaries and white, in `f32`.
const LUMA: [f32; 3] = [0.212_647_84, 0.715_179_2, 0.072_173_04];

/// 1.5·2²³: floats of this size have no fractional bits.
const ROUND: f32 = 12_582_912.0;

/// Width of the blocks that are converted at a time, px. The rows of a block share cache lines if columns are
/// contiguous in memory, as in a transposed image.
const BLOCK_PX: usize = 256;

/// Red, green and blue of each pixel, at any distances in memory.
#[derive(Clone, Copy, Debug)]
pub struct Colours<'a, T> {
    pub(super) width: usize,
    pub(super) height: usize,
    first: usize,
    strides: [isize; 3],
    values: &'a [T],
}

impl<'a, T: Intensity> Colours<'a, T> {
    /// Creates a view of pixels without gaps between them, row by row. The first three of the `channels` values of each
    /// are red, green and blue. Returns `None` if the number of values does not match the width and height.
    pub fn new(width: usize, height: usize, channels: usize, values: &'a [T]) -> Option<Self> {
        let count = width.checked_mul(height)?.checked_mul(channels)?;
        let strides = [width * channels, channels, 1].map(usize::cast_signed);
        (count == values.len()).then(|| Self::with_strides(width, height, 0, strides, values))?
    }

    /// Creates a view of pixels whose rows, columns and channels are `strides` values apart, which may be negative. Red
    /// of the first pixel is at index `first`. Returns `None` if a value is not in `values`.
    pub fn with_strides(
        width: usize,
        height: usize,
        first: usize,
        strides: [isize; 3],
        values: &'a [T],
    ) -> Option<Self> {
        let (mut low, mut high) = (first, first);
        for (count, stride) in [height, width, 3].into_iter().zip(strides) {
            let reach = stride.unsigned_abs().checked_mul(count.saturating_sub(1))?;
            if stride < 0 {
                low = low.checked_sub(reach)?;
            } else {
                high = high.checked_add(reach)?;
            }
        }
        let fits = width == 0 || height == 0 || high < values.len();
        fits.then_some(Self { width, height, first, strides, values })
    }

    /// Returns red, green or blue of the pixel at (x, y), which must lie in the image.
    #[inline]
    pub(super) fn at(&self, x: usize, y: usize, channel: usize) -> T {
        self.values[self.index([y, x, channel])]
    }

    #[inline]
    fn index(&self, place: [usize; 3]) -> usize {
        let by = |axis: usize| place[axis].cast_signed() * self.strides[axis];
        self.first.wrapping_add_signed(by(0) + by(1) + by(2))
    }
}

impl Colours<'_, u8> {
    /// Returns the grey values: the [`measured`](Self::measured) ones of a Bayer sensor, else luma.
    ///
    /// ```
    /// use deltille_core::raster::Colours;
    ///
    /// let rgba = [255, 255, 255, 0, 0, 255, 0, 255];
    /// assert_eq!(Colours::new(2, 1, 4, &rgba).unwrap().grey().pixels(), [255, 182]);
    /// assert!(Colours::new(2, 1, 3, &rgba).is_none());
    /// ```
    pub fn grey(&self) -> Gray<u8> {
        if let Some(grey) = self.measured() {
            return grey;
        }
        let mut grey = Gray::new(self.width, self.height);
        fill_bands(grey.pixels_mut(), self.width, |top, band| {
            let mut planes = [[0; BLOCK_PX]; 3];
            for left in (0..self.width).step_by(BLOCK_PX) {
                for (y, row) in (top..).zip(band.chunks_exact_mut(self.width)) {
                    let out = &mut row[left..(left + BLOCK_PX).min(self.width)];
                    self.split(left, y, out.len(), &mut planes);
                    luma(&planes, out);
                }
            }
        });
        grey
    }

    /// Copies red, green and blue of `count` pixels of a row from (x, y) on.
    fn split(&self, x: usize, y: usize, count: usize, planes: &mut Planes) {
        let [_, across, along] = self.strides;
        // The lowest value in memory.
        let low = [y, if across < 0 { x + count - 1 } else { x }, if along < 0 { 2 } else { 0 }];
        let values = &self.values[self.index(low)..];
        // Vector instructions need a constant stride: of pixels with and without a fourth value, and of every second one.
        let is_split = match (across.unsigned_abs(), along.unsigned_abs()) {
            (3, 1) => split::<3>(values, count, planes),
            (4, 1) => split::<4>(values, count, planes),
            (6, 1) => split::<6>(values, count, planes),
            _ => false,
        };
        if is_split {
            if along < 0 {
                planes.reverse();
            }
            if across < 0 {
                planes.iter_mut().for_each(|plane| plane[..count].reverse());
            }
            return;
        }
        for (channel, plane) in planes.iter_mut().enumerate() {
            let mut at = self.index([y, x, channel]);
            for value in &mut plane[..count] {
                *value = self.values[at];
                at = at.wrapping_add_signed(across);
            }
        }
    }
}

/// Red, green and blue of a part of a row.
type Planes = [[u8; BLOCK_PX]; 3];

/// Copies the first three values of `count` pixels of `N` values; returns whether there are enough pixels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn split<const N: usize>(values: &[u8], count: usize, planes: &mut Planes) -> bool {
    let Some(pixels) = values.as_chunks::<N>().0.get(..count.min(BLOCK_PX)) else { return false };
    let [a, b, c] = planes;
    for i in 0..pixels.len() {
        (a[i], b[i], c[i]) = (pixels[i][0], pixels[i][1], pixels[i][2]);
    }
    true
}

/// Writes the luma of pixels. The operations and their order are those of the `image` crate, which converts images of 16
/// bits.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn luma(planes: &Planes, out: &mut [u8]) {
    for i in 0..out.len().min(BLOCK_PX) {
        let [r, g, b] = [0, 1, 2].map(|channel| f32::from(planes[channel][i]) * (1.0 / 255.0));
        let luma = (r * LUMA[0] + g * LUMA[1] + b * LUMA[2]) * 255.0;
        // The rounded integer is in the low bits of the sum, which rounds halves to even numbers; here they go up.
        let sum = luma + ROUND;
        out[i] = sum.to_bits() as u8 + u8::from(luma - (sum - ROUND) >= 0.5);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows, columns and channels in any order and direction, and with gaps, have the grey values of contiguous pixels.
    #[test]
    fn grey_values_do_not_depend_on_the_layout() {
        let (width, height) = (BLOCK_PX + 7, 5);
        let random = |i: usize| ((i as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
        let pixels: Vec<u8> = (0..width * height * 3).map(random).collect();
        let expected = Colours::new(width, height, 3, &pixels).unwrap().grey();
        let sides = [height, width, 3];
        for order in [[0, 1, 2], [1, 0, 2], [2, 0, 1], [0, 2, 1]] {
            for gap in [1, 2, 4] {
                for signs in 0..8 {
                    // From the innermost axis outwards.
                    let (mut strides, mut first, mut length) = ([0; 3], 0, gap);
                    for axis in order.into_iter().rev() {
                        let is_reversed = signs >> axis & 1 == 1;
                        strides[axis] =
                            if is_reversed { -(length as isize) } else { length as isize };
                        first += if is_reversed { length * (sides[axis] - 1) } else { 0 };
                        length *= sides[axis] + usize::from(gap == 4 && axis == 2);
                    }
                    let mut values = vec![0; length];
                    for (i, &value) in pixels.iter().enumerate() {
                        let place = [i / 3 / width, i / 3 % width, i % 3];
                        let by: isize =
                            (0..3).map(|axis| place[axis] as isize * strides[axis]).sum();
                        values[first.wrapping_add_signed(by)] = value;
                    }
                    let view = Colours::with_strides(width, height, first, strides, &values);
                    assert_eq!(view.unwrap().grey(), expected, "{order:?} {gap} {signs}");
                }
            }
        }
    }

    #[test]
    fn values_outside_the_memory_are_refused() {
        let view = |first, strides| Colours::with_strides(3, 2, first, strides, &[0u8; 18]);
        assert!(view(0, [9, 3, 1]).is_some() && view(17, [-9, -3, -1]).is_some());
        assert!(view(1, [9, 3, 1]).is_none() && view(16, [-9, -3, -1]).is_none());
        assert!(view(0, [isize::MAX, 3, 1]).is_none() && view(0, [isize::MIN, 3, 1]).is_none());
    }
}
