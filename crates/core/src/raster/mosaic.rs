//! The grey values that a colour sensor measured.
//!
//! Most colour sensors measure one of red, green and blue at each pixel, in a Bayer mosaic, and the other two are
//! interpolated. Interpolation blurs an edge differently from pixel to pixel, and after a tone curve or beyond white no
//! symmetry cancels this. The measured values alone, brought to a common level, are the image of a monochrome sensor.
//! They are used if
//!
//! - for one of the four positions of the mosaic, the noise of the measured values is white, so nothing has mixed them
//!   since: neither denoising, sharpening, a colour matrix nor compression, and
//! - green has less noise where it was not measured, so it is interpolated.

use super::{Colours, Gray, Intensity};

/// Side of the squares in which noise is observed, px: even, as the mosaic repeats after two pixels, and small, so that
/// many show no edge.
const SQUARE_PX: usize = 8;

/// Maximum number of squares that are looked at; their flattest quarter shows correlations to within 0.01.
const MOST_SQUARES: usize = 1024;

/// Minimum number of squares whose noise counts: correlations to within 0.03.
const LEAST_SQUARES: usize = 32;

/// Minimum variance of a square, in squared levels: three times that of rounding, which is white.
const LEAST_VARIANCE: f32 = 0.25;

/// Lags of the correlations: neighbours, and next neighbours of the same colour.
const LAGS: [[isize; 2]; 6] = [[1, 0], [0, 1], [1, 1], [-1, 1], [2, 0], [0, 2]];

/// Ratio of the variances of green where it was measured and elsewhere, above which it is interpolated: the mean of two
/// to four neighbours has a half to a quarter of their variance, and green that is measured everywhere has a ratio of 1.
const INTERPOLATED: f32 = 1.2;

/// Correlation above which noise is not white: the scatter of six lags in [`LEAST_SQUARES`]. Red and blue at each
/// other's positions have 0.12 or more, and a denoised, sharpened or compressed image exceeds 0.2.
const WHITE: f32 = 0.06;

/// Side of the squares whose mean colours bring the planes to a common level, px: the noise of the mean of nine of them
/// is a fiftieth of that of a pixel.
const LEVEL_PX: usize = 16;

/// Difference of a ratio from 1 below which a camera has balanced the planes, so that all are clipped at the same light.
const BALANCED: f32 = 0.03;

/// Returns which colour is measured at a pixel of a mosaic whose first red pixel is `red`.
fn channel(red: [usize; 2], x: usize, y: usize) -> usize {
    match [x % 2 == red[0], y % 2 == red[1]] {
        [true, true] => 0,
        [false, false] => 2,
        _ => 1,
    }
}

/// Returns the distance of a row or column from the middle of its square, px.
fn arm(i: usize) -> f32 {
    i as f32 - (SQUARE_PX - 1) as f32 / 2.0
}

/// Sum of the squares of [`arm`] over a square: side² (side² − 1)/12.
const ARMS: f32 = (SQUARE_PX * SQUARE_PX * (SQUARE_PX * SQUARE_PX - 1)) as f32 / 12.0;

impl<T: Intensity + TryFrom<u32> + Ord> Colours<'_, T> {
    /// Returns the values that a Bayer sensor measured, at the level of green; `None` if the colours are not those of
    /// such a sensor, or do not contain its measured values any more.
    ///
    /// ```
    /// use deltille_core::raster::Colours;
    ///
    /// assert_eq!(Colours::new(2, 1, 3, &[0u8; 6]).unwrap().measured(), None);
    /// ```
    pub fn measured(&self) -> Option<Gray<T>> {
        let squares = self.flat_squares();
        let most = |red: [usize; 2]| {
            let found = self.correlations(&squares, |x, y| channel(red, x, y))?;
            Some((found.into_iter().fold(0.0, |most: f32, of| most.max(of.abs())), red))
        };
        let positions = [[0, 0], [1, 0], [0, 1], [1, 1]].into_iter().filter_map(most);
        let (rest, red) = positions.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (rest < WHITE && self.contrast(&squares, red) > INTERPOLATED).then(|| self.levelled(red))
    }

    /// Returns the first pixels, even in both coordinates, of squares that show little but noise.
    fn flat_squares(&self) -> Vec<[usize; 2]> {
        let [across, down] = [self.width, self.height].map(|side| side / SQUARE_PX);
        let every = (across * down).div_ceil(MOST_SQUARES).max(1);
        // First a coarse raster, then those between them until there are enough: where white is clipped, few show noise.
        let squares = (0..every).flat_map(|first| (first..across * down).step_by(every));
        let firsts = squares.map(|at| [at % across, at / across].map(|i| i * SQUARE_PX));
        let noisy = firsts.filter_map(|first| Some((self.noise(first, &|_, _| 1)?.0, first)));
        let mut found: Vec<_> = noisy.take(MOST_SQUARES).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(found.len().div_ceil(4));
        found.into_iter().map(|(_, first)| first).collect()
    }

    /// Returns the variance and the noise of a square: its values of one channel at each pixel, at a common level and
    /// without their plane; `None` if it is clipped or there is nothing but rounding.
    fn noise(
        &self,
        first: [usize; 2],
        channel: &impl Fn(usize, usize) -> usize,
    ) -> Option<(f32, [[f32; SQUARE_PX]; SQUARE_PX])> {
        const COUNT: f32 = (SQUARE_PX * SQUARE_PX) as f32;
        let mut values = [[0.0; SQUARE_PX]; SQUARE_PX];
        let (mut sums, mut counts) = ([0.0f32; 3], [0.0f32; 3]);
        for (v, row) in values.iter_mut().enumerate() {
            for (u, value) in row.iter_mut().enumerate() {
                let (x, y) = (first[0] + u, first[1] + v);
                let of = channel(x, y);
                *value = self.at(x, y, of).to_f32();
                if *value <= 0.0 || *value >= T::FULL_SCALE {
                    return None;
                }
                sums[of] += *value;
                counts[of] += 1.0;
            }
        }
        let levels: [f32; 3] = std::array::from_fn(|of| sums[of] / counts[of].max(1.0));
        let (mut by_u, mut by_v) = (0.0, 0.0);
        for (v, row) in values.iter_mut().enumerate() {
            for (u, value) in row.iter_mut().enumerate() {
                let of = channel(first[0] + u, first[1] + v);
                *value = (*value / levels[of] - 1.0) * levels[1];
                by_u += arm(u) * *value;
                by_v += arm(v) * *value;
            }
        }
        let mut variance = 0.0;
        for (v, row) in values.iter_mut().enumerate() {
            for (u, value) in row.iter_mut().enumerate() {
                *value -= (arm(u) * by_u + arm(v) * by_v) / ARMS;
                variance += *value * *value / COUNT;
            }
        }
        (variance >= LEAST_VARIANCE).then_some((variance, values))
    }

    /// Returns the correlations of the noise at [`LAGS`], of one channel at each pixel; `None` if too few squares show
    /// noise.
    fn correlations(
        &self,
        squares: &[[usize; 2]],
        channel: impl Fn(usize, usize) -> usize,
    ) -> Option<[f32; LAGS.len()]> {
        let found: Vec<_> =
            squares.iter().filter_map(|&first| self.noise(first, &channel)).collect();
        let across = 0..SQUARE_PX as isize;
        let count_of = |of: usize| {
            let all = across.clone().flat_map(|v| across.clone().map(move |u| (u, v)));
            all.filter(|&(u, v)| channel(u as usize, v as usize) == of).count() as f32
        };
        let counts = [0, 1, 2].map(count_of);
        let correlation = |lag: [isize; 2]| {
            let (mut sum, mut pairs) = (0.0, 0.0);
            for (v, u) in across.clone().flat_map(|v| across.clone().map(move |u| (v, u))) {
                let there = [u + lag[0], v + lag[1]];
                if !there.iter().all(|at| across.contains(at)) {
                    continue;
                }
                let [[u, v], [x, y]] = [[u, v], there].map(|at| at.map(|at| at as usize));
                let products = found.iter().map(|(variance, r)| r[v][u] * r[y][x] / variance);
                sum += products.sum::<f32>() / found.len() as f32;
                // The part that the levels and the plane have removed.
                let of = channel(u, v);
                let level = if channel(x, y) == of { 1.0 / counts[of] } else { 0.0 };
                sum += level + (arm(u) * arm(x) + arm(v) * arm(y)) / ARMS;
                pairs += 1.0;
            }
            sum / pairs
        };
        (found.len() >= LEAST_SQUARES).then(|| LAGS.map(correlation))
    }

    /// Returns the ratio of the variances of green where it was measured and elsewhere.
    fn contrast(&self, squares: &[[usize; 2]], red: [usize; 2]) -> f32 {
        let mut sums = [0.0; 2];
        for &first in squares {
            let Some((variance, values)) = self.noise(first, &|_, _| 1) else { continue };
            for (v, row) in values.iter().enumerate() {
                for (u, value) in row.iter().enumerate() {
                    let is_measured = channel(red, first[0] + u, first[1] + v) == 1;
                    sums[usize::from(is_measured)] += value * value / variance;
                }
            }
        }
        sums[1] / sums[0]
    }

    /// Returns the values that a Bayer sensor measured, with red and blue multiplied by the ratio of green to them in the
    /// vicinity. `red` is the column and row of red in the mosaic, 0 or 1.
    pub fn levelled(&self, red: [usize; 2]) -> Gray<T> {
        let levels = self.levels();
        let white = T::try_from(T::FULL_SCALE as u32).unwrap_or_default();
        let [across, down] = self.in_levels();
        // The ratios of a pixel, between those of the nearest four squares.
        let between = |at: usize, count: usize| {
            let at = (at as f32 + 0.5) / LEVEL_PX as f32 - 0.5;
            let at = at.clamp(0.0, (count - 1) as f32);
            let first = (at as usize).min(count.saturating_sub(2));
            (first, (first + 1).min(count - 1), at - first as f32)
        };
        Gray::from_fn(self.width, self.height, |x, y| {
            let of = channel(red, x, y);
            let (measured, green) = (self.at(x, y, of), self.at(x, y, 1));
            if of == 1 {
                return green;
            }
            let ((left, right, by), (top, bottom, down_by)) =
                (between(x, across), between(y, down));
            let row = |row: usize| {
                let ends = [left, right].map(|column| levels[row * across + column][of]);
                ends[0] + by * (ends[1] - ends[0])
            };
            let ratio = row(top) + down_by * (row(bottom) - row(top));
            let ratio = if (ratio - 1.0).abs() < BALANCED { 1.0 } else { ratio };
            let mut value = ratio * measured.to_f32();
            if measured.to_f32() >= T::FULL_SCALE {
                // Darker light than green can show, and no more is known.
                value = value.max(green.to_f32());
            }
            T::try_from((value + 0.5) as u32).map_or(white, |value| value.min(white))
        })
    }

    /// Returns the numbers of squares for levels across and down.
    fn in_levels(&self) -> [usize; 2] {
        [self.width, self.height].map(|side| side.div_ceil(LEVEL_PX).max(1))
    }

    /// Returns the ratios of green to each channel about each square, from the squares without a clipped pixel.
    fn levels(&self) -> Vec<[f32; 3]> {
        let [across, down] = self.in_levels();
        let mut sums = vec![[0.0f32; 3]; across * down];
        for (y, x) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (y, x))) {
            let sums = &mut sums[y / LEVEL_PX * across + x / LEVEL_PX];
            for (of, sum) in sums.iter_mut().enumerate() {
                let value = self.at(x, y, of).to_f32();
                *sum += if value < T::FULL_SCALE { value } else { f32::NAN };
            }
        }
        let total = |of: &mut dyn Iterator<Item = usize>| {
            let whole = of.map(|i| sums[i]).filter(|sums| !sums.iter().any(|of| of.is_nan()));
            let sum = whole.fold([0.0f32; 3], |a, b| std::array::from_fn(|of| a[of] + b[of]));
            sum.iter().all(|of| *of > 0.0).then(|| sum.map(|of| sum[1] / of))
        };
        let usual = total(&mut (0..sums.len())).unwrap_or([1.0; 3]);
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let about = |i: usize| {
            let rows = near(i / across, down);
            total(&mut rows.flat_map(|y| near(i % across, across).map(move |x| y * across + x)))
        };
        (0..sums.len()).map(|i| about(i).unwrap_or(usual)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 128;

    fn measured(colours: &[u8]) -> Option<Gray<u8>> {
        Colours::new(SIDE, SIDE, 3, colours)?.measured()
    }

    /// Noise of a standard deviation of about 4 levels, without a repeating pattern.
    fn noise(i: usize) -> f32 {
        let mixed = |k: usize| {
            let mut bits = (4 * i + k) as u64;
            for _ in 0..3 {
                bits = (bits ^ (bits >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            }
            (bits >> 40) as f32 / (1 << 24) as f32 - 0.5
        };
        7.0 * (0..4).map(mixed).sum::<f32>()
    }

    /// Returns the raw values of a sensor with these gains behind an edge, and the colours interpolated between them.
    fn sensor(red: [usize; 2], gains: [f32; 3]) -> (Vec<u8>, Vec<u8>) {
        let raw = |x: usize, y: usize| {
            let light = if 2 * x + y > 190 { 170.0 } else { 60.0 };
            (gains[channel(red, x, y)] * (light + noise(y * SIDE + x))).round()
        };
        let colours = (0..SIDE * SIDE).flat_map(|i| {
            let (x, y) = (i % SIDE, i / SIDE);
            [0, 1, 2].map(|of| {
                if channel(red, x, y) == of {
                    return raw(x, y) as u8;
                }
                let (mut sum, mut count) = (0.0, 0.0);
                for y in y.saturating_sub(1)..(y + 2).min(SIDE) {
                    for x in x.saturating_sub(1)..(x + 2).min(SIDE) {
                        if channel(red, x, y) == of {
                            (sum, count) = (sum + raw(x, y), count + 1.0);
                        }
                    }
                }
                (sum / count).round() as u8
            })
        });
        let values = (0..SIDE * SIDE).map(|i| raw(i % SIDE, i / SIDE) as u8).collect();
        (values, colours.collect())
    }

    #[test]
    fn measured_values_are_found_at_any_position_of_the_mosaic() {
        for red in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let (raw, colours) = sensor(red, [1.0; 3]);
            let found = measured(&colours).unwrap();
            let far = raw.iter().zip(found.pixels()).filter(|(a, b)| a.abs_diff(**b) > 2).count();
            assert_eq!(far, 0, "{red:?}");
        }
    }

    #[test]
    fn planes_of_other_levels_are_brought_to_that_of_green() {
        let (plain, _) = sensor([1, 0], [1.0; 3]);
        let (_, colours) = sensor([1, 0], [0.5, 1.0, 0.7]);
        let found = measured(&colours).unwrap();
        let far = plain.iter().zip(found.pixels()).filter(|(a, b)| a.abs_diff(**b) > 4).count();
        assert!(far < SIDE, "{far}");
    }

    #[test]
    fn other_colours_are_left_alone() {
        let (_, colours) = sensor([0, 0], [1.0; 3]);
        let is_left = |colours: Vec<u8>| measured(&colours).is_none();
        // Three planes measured at every pixel, and a grey image.
        let independent = (0..3 * SIDE * SIDE).map(|i| (128.0 + noise(i)) as u8).collect();
        assert!(is_left(independent));
        let grey = (0..3 * SIDE * SIDE).map(|i| (128.0 + noise(i / 3)) as u8).collect();
        assert!(is_left(grey));
        // Pixels that were mixed after interpolation.
        let row = 3 * SIDE;
        let mixed = (0..colours.len()).map(|i| {
            let there = |by: usize| u32::from(colours[(i + by) % colours.len()]);
            ((there(0) + there(3) + there(row) + there(row + 3)) / 4) as u8
        });
        assert!(is_left(mixed.collect()));
        // Nothing but edges.
        let ideal = colours.iter().map(|value| if *value > 115 { 170 } else { 60 });
        assert!(is_left(ideal.collect()));
    }
}
