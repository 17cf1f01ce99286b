//! A mipmap: an image at successively halved sizes, for viewing from any distance.

use glam::DVec2;

use deltille::raster::Gray;

/// Continuation of an image beyond its borders.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beyond {
    /// The outermost pixels are repeated.
    Border,
    /// The image is repeated periodically.
    Again,
}

/// An image and its halvings, by exact means of 2 × 2 pixels.
pub(crate) struct Mips {
    levels: Vec<Gray<u8>>,
    beyond: Beyond,
}

impl Mips {
    pub(crate) fn new(image: Gray<u8>, beyond: Beyond) -> Self {
        const MIN_SIDE: usize = 8;
        let mut levels = vec![image];
        while let Some(last) = levels.last()
            && last.width().min(last.height()) >= 2 * MIN_SIDE
        {
            let next = half(last);
            levels.push(next);
        }
        Self { levels, beyond }
    }

    /// Returns the image at half its size.
    pub(super) fn half(&self) -> &Gray<u8> {
        &self.levels[1.min(self.levels.len() - 1)]
    }

    /// Returns the mean over a parallelogram around a position, in pixels of the first level.
    ///
    /// The level is the first whose pixels are at least as large as the narrow side of the parallelogram. Samples
    /// farther apart than the pixels would displace edges along the rows by a sixteenth of that side. The number of
    /// samples along the long side is proportional to its length.
    pub(crate) fn area(&self, middle: DVec2, footprint: &Footprint) -> f32 {
        let scale = footprint.scale;
        let level = &self.levels[footprint.level.min(self.levels.len() - 1)];
        let mut sum = 0.0;
        for k in 0..footprint.samples {
            let t = (f64::from(k) + 0.5) / f64::from(footprint.samples) - 0.5;
            // Pixel centres lie at integers on every level.
            let at = (middle + t * footprint.long + 0.5) * scale - 0.5;
            sum += match self.beyond {
                Beyond::Border => clamped(level, at),
                Beyond::Again => wrapped(level, at),
            };
        }
        sum / footprint.samples as f32
    }

    /// Determines the sampling of an area of the first level with the sides `across` and `down`, px.
    pub(crate) fn footprint(&self, across: DVec2, down: DVec2) -> Footprint {
        Footprint::new(across, down, self.levels.len())
    }
}

/// Sampling of a small parallelogram of an image.
pub(crate) struct Footprint {
    level: usize,
    scale: f64,
    samples: u32,
    /// Its long axis, px of the first level.
    long: DVec2,
}

/// Maximum number of samples along the long axis: sufficient for a tilt of more than 85°.
const MAX_SAMPLES: u32 = 12;

impl Footprint {
    fn new(across: DVec2, down: DVec2, levels: usize) -> Self {
        // Singular values and the long axis of the 2 × 2 matrix with these columns.
        let (DVec2 { x: a, y: c }, DVec2 { x: b, y: d }) = (across, down);
        let (xx, xy, yy) = (a * a + b * b, a * c + b * d, c * c + d * d);
        let mean = 0.5 * (xx + yy);
        let spread = (0.5 * (xx - yy)).hypot(xy);
        let (long, short) = ((mean + spread).max(0.0).sqrt(), (mean - spread).max(0.0).sqrt());
        let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
        let level = (short.max(1.0).log2().ceil() as usize).min(levels - 1);
        let texel = (1u32 << level) as f64;
        let samples = ((long / texel).ceil() as u32).clamp(1, MAX_SAMPLES);
        Self { level, scale: 1.0 / texel, samples, long: long * DVec2::from_angle(angle) }
    }
}

fn half(image: &Gray<u8>) -> Gray<u8> {
    Gray::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        let at = |dx, dy| u32::from(image.at(2 * x + dx, 2 * y + dy));
        ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
    })
}

fn clamped(image: &Gray<u8>, at: DVec2) -> f32 {
    let (width, height) = (image.width(), image.height());
    let at = at.clamp(DVec2::ZERO, DVec2::new((width - 1) as f64, (height - 1) as f64));
    let (left, top) = ((at.x as usize).min(width - 2), (at.y as usize).min(height - 2));
    let part = at - DVec2::new(left as f64, top as f64);
    blend(image, [left, left + 1], [top, top + 1], part)
}

fn wrapped(image: &Gray<u8>, at: DVec2) -> f32 {
    let (width, height) = (image.width(), image.height());
    let floor = at.floor();
    let left = (floor.x as i64).rem_euclid(width as i64) as usize;
    let top = (floor.y as i64).rem_euclid(height as i64) as usize;
    let columns = [left, if left + 1 == width { 0 } else { left + 1 }];
    let rows = [top, if top + 1 == height { 0 } else { top + 1 }];
    blend(image, columns, rows, at - floor)
}

fn blend(image: &Gray<u8>, [x0, x1]: [usize; 2], [y0, y1]: [usize; 2], part: DVec2) -> f32 {
    let (fx, fy) = (part.x as f32, part.y as f32);
    let (upper, lower) = (image.row(y0), image.row(y1));
    let mix = |row: &[u8]| f32::from(row[x0]) * (1.0 - fx) + f32::from(row[x1]) * fx;
    mix(upper) * (1.0 - fy) + mix(lower) * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a ramp is exact for every level and footprint.
    #[test]
    fn the_mean_of_a_ramp_is_its_middle() {
        let ramp = Mips::new(Gray::from_fn(256, 256, |x, _| x as u8), Beyond::Border);
        for (across, down) in
            [((0.3, 0.0), (0.0, 0.3)), ((4.0, 1.0), (-1.0, 4.0)), ((9.0, 2.0), (0.5, 2.0))]
        {
            let footprint = ramp.footprint(across.into(), down.into());
            let mean = ramp.area(DVec2::new(100.25, 90.0), &footprint);
            // Each level is rounded to whole grey values.
            assert!((mean - 100.25).abs() < 0.6, "{mean}");
        }
    }
}
