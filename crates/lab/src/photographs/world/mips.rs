//! A picture at all its sizes, each half of the one before, to be looked at from any distance.

use glam::DVec2;

use deltille::raster::Gray;

/// What lies beyond the borders of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Beyond {
    /// Its outermost pixels.
    Border,
    /// The same picture again.
    Again,
}

/// A picture and its halvings, by exact means of 2 × 2 pixels.
pub(crate) struct Mips {
    levels: Vec<Gray<u8>>,
    beyond: Beyond,
}

impl Mips {
    pub(crate) fn new(picture: Gray<u8>, beyond: Beyond) -> Self {
        const LEAST_SIDE: usize = 8;
        let mut levels = vec![picture];
        while let Some(last) = levels.last()
            && last.width().min(last.height()) >= 2 * LEAST_SIDE
        {
            let next = half(last);
            levels.push(next);
        }
        Self { levels, beyond }
    }

    /// The mean over a parallelogram around a place, in pixels of the first level.
    ///
    /// The level is the first whose pixels are no smaller than the parallelogram's narrow side: samples that lie
    /// farther apart than pixels would displace edges along the rows by a sixteenth of that side. Along
    /// the other as many are taken as it is longer.
    pub(crate) fn area(&self, middle: DVec2, footprint: &Footprint) -> f32 {
        let scale = footprint.scale;
        let level = &self.levels[footprint.level.min(self.levels.len() - 1)];
        let mut sum = 0.0;
        for k in 0..footprint.samples {
            let t = (f64::from(k) + 0.5) / f64::from(footprint.samples) - 0.5;
            // Pixel centres at integers on every level.
            let at = (middle + t * footprint.long + 0.5) * scale - 0.5;
            sum += match self.beyond {
                Beyond::Border => clamped(level, at),
                Beyond::Again => wrapped(level, at),
            };
        }
        sum / footprint.samples as f32
    }

    /// How an area of the first level is to be sampled, whose sides are `across` and `down`, px.
    pub(crate) fn footprint(&self, across: DVec2, down: DVec2) -> Footprint {
        Footprint::new(across, down, self.levels.len())
    }
}

/// How a small parallelogram of a picture is sampled.
pub(crate) struct Footprint {
    level: usize,
    scale: f64,
    samples: u32,
    /// Its long axis, px of the first level.
    long: DVec2,
}

/// Most samples along the long axis: a tilt of more than 85°.
const MOST_SAMPLES: u32 = 12;

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
        let samples = ((long / texel).ceil() as u32).clamp(1, MOST_SAMPLES);
        Self { level, scale: 1.0 / texel, samples, long: long * DVec2::from_angle(angle) }
    }
}

fn half(picture: &Gray<u8>) -> Gray<u8> {
    Gray::from_fn(picture.width() / 2, picture.height() / 2, |x, y| {
        let at = |dx, dy| u32::from(picture.at(2 * x + dx, 2 * y + dy));
        ((at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1) + 2) / 4) as u8
    })
}

fn clamped(picture: &Gray<u8>, at: DVec2) -> f32 {
    let (width, height) = (picture.width(), picture.height());
    let at = at.clamp(DVec2::ZERO, DVec2::new((width - 1) as f64, (height - 1) as f64));
    let (left, top) = ((at.x as usize).min(width - 2), (at.y as usize).min(height - 2));
    let part = at - DVec2::new(left as f64, top as f64);
    blend(picture, [left, left + 1], [top, top + 1], part)
}

fn wrapped(picture: &Gray<u8>, at: DVec2) -> f32 {
    let (width, height) = (picture.width(), picture.height());
    let floor = at.floor();
    let left = (floor.x as i64).rem_euclid(width as i64) as usize;
    let top = (floor.y as i64).rem_euclid(height as i64) as usize;
    let columns = [left, if left + 1 == width { 0 } else { left + 1 }];
    let rows = [top, if top + 1 == height { 0 } else { top + 1 }];
    blend(picture, columns, rows, at - floor)
}

fn blend(picture: &Gray<u8>, [x0, x1]: [usize; 2], [y0, y1]: [usize; 2], part: DVec2) -> f32 {
    let (fx, fy) = (part.x as f32, part.y as f32);
    let (upper, lower) = (picture.row(y0), picture.row(y1));
    let mix = |row: &[u8]| f32::from(row[x0]) * (1.0 - fx) + f32::from(row[x1]) * fx;
    mix(upper) * (1.0 - fy) + mix(lower) * fy
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp is the same from everywhere, whatever the level and the footprint.
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
