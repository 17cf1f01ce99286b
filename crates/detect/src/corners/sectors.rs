//! The edges that meet at a corner, six or four, as directions with a sign.
//!
//! The paper takes the polarities from the roots of the cubic or quadratic form. A circle around
//! the corner contains more information. It shows each of the N half-edges separately, so
//! perspective and distortion may bend them. It also verifies that dark and bright alternate. The
//! roots of the form are used if the circle is too noisy.
//!
//! ```text
//!          ray 2   ray 1            rays run counter-clockwise on the print (image angles fall,
//!             ╲  ░  ╱               y is down); the sector after an even ray is dark, so an
//!           ███╲   ╱███             even ray is a step along a row of the lattice turned by a
//!    ray 3 ─────·───── ray 0        multiple of 120°, with the black tile on its left
//!           ░  ╱███╲  ░
//!             ╱█████╲
//!          ray 4   ray 5
//! ```
//!
//! With four rays, opposite sectors have the same colour, and those of one colour may be narrow.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::DVec2;
use multiversion::multiversion;

use super::polynomial::Form;
use crate::tiling::kind;
use deltille_core::lattice::GridKind;
use deltille_core::raster::Gray;

/// Number of samples on a circle. A sector seen at 75° is 17° wide; steps of 7.5° put two samples into it.
const SAMPLES: usize = 48;

/// Radii of the circles, px, in the order in which they are tried. Larger circles give better
/// directions. Smaller ones stay clear of the neighbours on small boards.
const RADII_PX: [f64; 4] = [6.0, 4.5, 8.0, 3.5];

/// Width of the dead band, as a fraction of the largest deviation from the mean. Samples within it count for neither
/// side.
const DEAD_BAND: f64 = 0.12;

/// Minimum mean deviation of every sector from the level, relative to the amplitude of the circle,
/// if the rays are the roots of the form. It is half that of an evenly divided, noisy circle.
const MIN_SECTOR: f64 = 0.3;

/// Largest deviation of opposite rays from a straight line. Perspective keeps lines straight. Within a circle of 8 px,
/// no lens bends them by more than a few degrees; noise and blur add some.
const MAX_BEND_RAD: f64 = 20.0 * PI / 180.0;

/// Maximum deviation of the centre of a checkerboard corner from the mean around it, relative to the amplitude. Blur
/// makes the centre that mean. If ink spreads or the squares do not quite meet, the centre may be
/// dark or bright. It is then off by the amplitude. On the circle, a bar looks like a corner, but
/// its centre is off by up to twice the amplitude.
const MAX_CENTRE: f64 = 1.2;

/// Iterations of the search for the level between two classes of unequal size; it converges in two.
const LEVEL_STEPS: usize = 4;

/// Directions and brightness around a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sectors<const N: usize> {
    /// Image angles of the N half-edges, radians, counter-clockwise on the print. The first has a dark sector on its
    /// counter-clockwise side.
    pub rays: [f64; N],
    /// Brightness half-way between dark and bright.
    pub level: f64,
    /// Mean deviation from it: half the contrast.
    pub amplitude: f64,
}

impl<const N: usize> Sectors<N> {
    /// Reads the sectors around `position`, from circles or else from the roots of the form.
    pub(crate) fn read(image: &Gray<i16>, position: DVec2, form: &Form) -> Option<Self> {
        let circles = RADII_PX.iter().filter_map(|&radius| {
            Circle::<N>::sample(image, position, radius).filter(Circle::has_its_mean_in_the_middle)
        });
        let mut first = None;
        for circle in circles {
            if let Some(rays) = circle.crossings().and_then(|c| ordered_rays(&c)) {
                return Some(circle.sectors(rays));
            }
            first.get_or_insert(circle);
        }
        let rays = ordered_rays(&roots(form)?)?;
        first.filter(|circle| circle.alternates(&rays)).map(|circle| circle.sectors(rays))
    }
}

/// Returns the level half-way between dark and bright, and the mean deviation from it, on the smallest circle around a
/// position; `None` at the border.
pub(crate) fn contrast_around<const N: usize>(
    image: &Gray<i16>,
    position: DVec2,
) -> Option<(f64, f64)> {
    let smallest = RADII_PX.into_iter().fold(f64::INFINITY, f64::min);
    let circle = Circle::<N>::sample(image, position, smallest)?;
    Some((circle.level, circle.amplitude()))
}

/// A sign change at an image angle; `rising` if brightness grows with the angle.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    angle: f64,
    rising: bool,
}

/// Brightness on a circle around a corner with N rays, by increasing image angle.
struct Circle<const N: usize> {
    level: f64,
    deviations: [f64; SAMPLES],
    /// Brightness of the centre minus the mean of the circle.
    centre: f64,
}

impl<const N: usize> Circle<N> {
    /// Samples a circle; `None` if it leaves the image.
    fn sample(image: &Gray<i16>, DVec2 { x, y }: DVec2, radius: f64) -> Option<Self> {
        let inside = x - radius >= 0.0
            && y - radius >= 0.0
            && x + radius + 1.0 < image.width() as f64
            && y + radius + 1.0 < image.height() as f64;
        if !inside {
            return None;
        }
        let values = on_circle(image, DVec2::new(x, y), radius, &DIRECTIONS);
        let mean = sum(&values, |value| value) / SAMPLES as f64;
        let level = match kind::<N>() {
            // Opposite sectors have opposite colours, so the mean is the level of the edges.
            GridKind::Deltille => mean,
            GridKind::Checker => between_classes(&values, mean),
        };
        let centre = image.bilinear_inside(x, y) - mean;
        Some(Self { level, deviations: values.map(|v| v - level), centre })
    }

    /// Returns whether the centre may belong to a corner. Deltille corners need no such test,
    /// because their odd symmetry has already been tested.
    fn has_its_mean_in_the_middle(&self) -> bool {
        match kind::<N>() {
            GridKind::Deltille => true,
            GridKind::Checker => self.centre.abs() < MAX_CENTRE * self.amplitude(),
        }
    }

    /// Returns the mean deviation from the level.
    fn amplitude(&self) -> f64 {
        sum(&self.deviations, f64::abs) / SAMPLES as f64
    }

    fn sectors(&self, rays: [f64; N]) -> Sectors<N> {
        Sectors { rays, level: self.level, amplitude: self.amplitude() }
    }

    /// Returns whether the sectors between given rays are alternately dark and bright, on average.
    fn alternates(&self, rays: &[f64; N]) -> bool {
        // Angles by which the rays lie behind the first. Rays and samples run in opposite
        // directions.
        let behind = rays.map(|ray| in_one_turn(rays[0] - ray));
        let (mut sums, mut counts) = ([0.0; N], [0.0; N]);
        for (k, deviation) in self.deviations.iter().enumerate() {
            let here = in_one_turn(rays[0] - angle_of(k as f64));
            let sector = (0..N).rfind(|&i| behind[i] <= here).unwrap_or(0);
            // A sample on a ray belongs to neither side.
            if behind[sector] < here {
                sums[sector] += deviation;
                counts[sector] += 1.0;
            }
        }
        let limit = MIN_SECTOR * self.amplitude();
        (0..N).all(|i| {
            let darkness = if i % 2 == 0 { -sums[i] } else { sums[i] };
            counts[i] > 0.0 && darkness / counts[i] > limit
        })
    }

    /// Returns the N sign changes; `None` unless there are exactly N.
    fn crossings(&self) -> Option<[Crossing; N]> {
        let dead = DEAD_BAND * largest(&self.deviations);
        let clear = bits(&self.deviations, |d| d.abs() > dead);
        // Nearly all false corners are rejected here.
        if changes(clear, bits(&self.deviations, |d| d > 0.0)) != N as u32 {
            return None;
        }
        let is_clear = |k: &usize| self.deviations[*k].abs() > dead;
        let mut a = (0..SAMPLES).rfind(is_clear)?;
        let mut crossings = [Crossing { angle: 0.0, rising: false }; N];
        let mut count = 0;
        for b in (0..SAMPLES).filter(is_clear) {
            if (self.deviations[a] > 0.0) != (self.deviations[b] > 0.0) {
                *crossings.get_mut(count)? = self.crossing_between(a, b);
                count += 1;
            }
            a = b;
        }
        // The crossing from before the first sample to after it is the last one of the circle.
        if crossings[0].angle > crossings[N - 1].angle {
            crossings.rotate_left(1);
        }
        (count == N).then_some(crossings)
    }

    /// Returns the zero of the straight line through the clear samples a and b (b after a on the circle).
    fn crossing_between(&self, a: usize, b: usize) -> Crossing {
        let (from, to) = (self.deviations[a], self.deviations[b]);
        let steps = (b + SAMPLES - a) % SAMPLES;
        // If samples between them lie in the dead band, the zero is where the sign changes.
        let mut start = 0;
        while start + 1 < steps {
            let next = self.deviations[(a + start + 1) % SAMPLES];
            if (next > 0.0) != (from > 0.0) {
                break;
            }
            start += 1;
        }
        let low = self.deviations[(a + start) % SAMPLES];
        let high = self.deviations[(a + start + 1) % SAMPLES];
        let fraction = if low == high { 0.5 } else { low / (low - high) };
        Crossing { angle: angle_of(((a + start) % SAMPLES) as f64 + fraction), rising: to > from }
    }
}

/// Unit vectors towards the samples.
static DIRECTIONS: LazyLock<Directions> = LazyLock::new(|| {
    let angles: [f64; SAMPLES] = std::array::from_fn(|k| angle_of(k as f64));
    Directions { cos: angles.map(f64::cos), sin: angles.map(f64::sin) }
});

/// Cosines and sines of the sample angles.
struct Directions {
    cos: [f64; SAMPLES],
    sin: [f64; SAMPLES],
}

/// Returns bilinear samples on a circle in an image, in steps that vectorise.
#[multiversion(targets("x86_64+avx2"))]
fn on_circle(
    image: &Gray<i16>,
    DVec2 { x, y }: DVec2,
    radius: f64,
    directions: &Directions,
) -> [f64; SAMPLES] {
    let width = image.width();
    let pixels = image.pixels();
    let (mut first, mut fx, mut fy) = ([0u32; SAMPLES], [0.0f32; SAMPLES], [0.0f32; SAMPLES]);
    for k in 0..SAMPLES {
        let u = x + radius * directions.cos[k];
        let v = y + radius * directions.sin[k];
        // Via signed numbers, which processors convert directly.
        let (left, top) = (u as i32, v as i32);
        fx[k] = (u - f64::from(left)) as f32;
        fy[k] = (v - f64::from(top)) as f32;
        first[k] = top as u32 * width as u32 + left as u32;
    }
    let mut corners = [[0i16; SAMPLES]; 4];
    for k in 0..SAMPLES {
        let first = first[k] as usize;
        let (upper, lower) = (&pixels[first..first + 2], &pixels[first + width..first + width + 2]);
        corners[0][k] = upper[0];
        corners[1][k] = upper[1];
        corners[2][k] = lower[0];
        corners[3][k] = lower[1];
    }
    let mut values = [0.0; SAMPLES];
    for k in 0..SAMPLES {
        let (a, b) = (f32::from(corners[0][k]), f32::from(corners[1][k]));
        let (c, d) = (f32::from(corners[2][k]), f32::from(corners[3][k]));
        let (upper, lower) = (a + fx[k] * (b - a), c + fx[k] * (d - c));
        values[k] = f64::from(upper + fy[k] * (lower - upper));
    }
    values
}

/// A bit for each sample.
const EVERY: u64 = (1 << SAMPLES) - 1;

/// Returns the bits of the samples that satisfy `is`.
fn bits(values: &[f64; SAMPLES], is: impl Fn(f64) -> bool) -> u64 {
    values.iter().enumerate().fold(0, |bits, (k, &value)| bits | u64::from(is(value)) << k)
}

/// Counts the clear samples around the circle that are on the other side of the level than the
/// previous clear one.
fn changes(clear: u64, above: u64) -> u32 {
    let next = |bits: u64, by: usize| (bits << by | bits >> (SAMPLES - by)) & EVERY;
    let (mut known, mut sides) = (clear, clear & above);
    // An unclear sample takes the side of the nearest clear sample before it: one, two, four … before.
    for by in [1, 2, 4, 8, 16, 32] {
        sides |= next(sides, by) & !known;
        known |= next(known, by);
    }
    (sides ^ next(sides, 1)).count_ones()
}

/// Returns the sum over the samples, in four independent parts.
fn sum(values: &[f64; SAMPLES], of: impl Fn(f64) -> f64) -> f64 {
    let mut parts = [0.0; 4];
    for group in values.as_chunks::<4>().0 {
        for i in 0..4 {
            parts[i] += of(group[i]);
        }
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}

/// Returns the largest absolute value of the samples.
fn largest(values: &[f64; SAMPLES]) -> f64 {
    let mut parts = [0.0f64; 4];
    for group in values.as_chunks::<4>().0 {
        for i in 0..4 {
            parts[i] = parts[i].max(group[i].abs());
        }
    }
    parts[0].max(parts[1]).max(parts[2].max(parts[3]))
}

/// Reduces an angle to the range 0 to 2π; most angles need no division.
fn in_one_turn(angle: f64) -> f64 {
    if (0.0..TAU).contains(&angle) {
        angle
    } else if (-TAU..0.0).contains(&angle) {
        angle + TAU
    } else {
        angle.rem_euclid(TAU)
    }
}

fn angle_of(sample: f64) -> f64 {
    sample * TAU / SAMPLES as f64
}

/// Returns the level half-way between the means of the values above and below it.
fn between_classes(values: &[f64; SAMPLES], mean: f64) -> f64 {
    let mut level = mean;
    let total = SAMPLES as f64 * mean;
    for _ in 0..LEVEL_STEPS {
        let [above, count] = above_level(values, level);
        if count == 0.0 || count == SAMPLES as f64 {
            return mean;
        }
        let next = ((total - above) / (SAMPLES as f64 - count) + above / count) / 2.0;
        if next == level {
            break;
        }
        level = next;
    }
    level
}

/// Returns sum and number of the values above a level.
#[multiversion(targets("x86_64+avx2"))]
fn above_level(values: &[f64; SAMPLES], level: f64) -> [f64; 2] {
    /// Two independent vectors of four.
    const LANES: usize = 8;
    let (mut sums, mut counts) = ([0.0; LANES], [0.0; LANES]);
    for group in values.as_chunks::<LANES>().0 {
        for i in 0..LANES {
            let one = if group[i] > level { 1.0 } else { 0.0 };
            sums[i] += one * group[i];
            counts[i] += one;
        }
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..LANES {
        sum += sums[i];
        count += counts[i];
    }
    [sum, count]
}

/// Returns the zeros of the form around the circle; `None` unless all roots are real.
fn roots<const N: usize>(form: &Form) -> Option<[Crossing; N]> {
    let Directions { cos, sin } = &*DIRECTIONS;
    let values: [f64; SAMPLES] = std::array::from_fn(|k| form.towards(DVec2::new(cos[k], sin[k])));
    if changes(EVERY, bits(&values, |value| value > 0.0)) != N as u32 {
        return None;
    }
    let mut crossings = [Crossing { angle: 0.0, rising: false }; N];
    let mut count = 0;
    for k in 0..SAMPLES {
        let (from, to) = (values[k], values[(k + 1) % SAMPLES]);
        if (from > 0.0) != (to > 0.0) && from != to {
            let angle = angle_of(k as f64 + from / (from - to));
            *crossings.get_mut(count)? = Crossing { angle, rising: to > from };
            count += 1;
        }
    }
    (count == N).then_some(crossings)
}

/// Returns the rays in the order of [`Sectors::rays`]; `None` if opposite ones are not collinear.
fn ordered_rays<const N: usize>(crossings: &[Crossing; N]) -> Option<[f64; N]> {
    let bend = |k: usize| turn(crossings[k].angle, crossings[k + N / 2].angle + PI).abs();
    let straight = (0..N / 2).all(|k| bend(k) <= MAX_BEND_RAD);
    if !straight {
        return None;
    }
    // Decreasing image angles are counter-clockwise on the print. In that direction, a crossing
    // that rises with the angle leads from bright to dark: its counter-clockwise sector is dark.
    let start = crossings.iter().position(|c| c.rising)?;
    Some(std::array::from_fn(|k| crossings[(start + N - k) % N].angle))
}

/// Returns the angle from `from` to `to`, −π to π.
pub(crate) fn turn(from: f64, to: f64) -> f64 {
    let turn = to - from;
    // Most angles need no division: for an angle below 3π, one full turn suffices.
    let turn = if turn.abs() < 3.0 * PI { turn } else { turn.rem_euclid(TAU) };
    if turn > PI {
        turn - TAU
    } else if turn <= -PI {
        turn + TAU
    } else {
        turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLAT: Form = Form::Cubic([0.0; 4]);

    /// Renders a corner of N rays whose black tile lies between image angles −360°/N + tilt and tilt: upright on the
    /// print, to the right of the corner.
    fn corner<const N: usize>(tilt: f64) -> Gray<i16> {
        Gray::from_fn(41, 41, |x, y| {
            let theta = (y as f64 - 20.0).atan2(x as f64 - 20.0) - tilt;
            match (0.5 * N as f64 * theta).sin() {
                _ if (x, y) == (20, 20) => 400,
                s if s < 0.0 => 100,
                _ => 700,
            }
        })
    }

    #[test]
    fn rays_follow_the_print_and_even_ones_have_black_on_their_left() {
        rays_are_in_order::<6>();
        rays_are_in_order::<4>();
    }

    fn rays_are_in_order<const N: usize>() {
        let sector = TAU / N as f64;
        for k in 0..20 {
            let tilt = 0.3 * f64::from(k);
            let image = corner::<N>(tilt);
            let sectors = Sectors::<N>::read(&image, DVec2::splat(20.0), &FLAT).unwrap();
            assert!((sectors.level - 400.0).abs() < 20.0 && sectors.amplitude > 250.0);
            for (i, &ray) in sectors.rays.iter().enumerate() {
                let next = sectors.rays[(i + 1) % N];
                assert!(
                    (turn(ray, next) + sector).abs() < 0.25,
                    "equal sectors; image angles fall"
                );
                let nearest = (0..N)
                    .map(|n| turn(ray, tilt - n as f64 * sector))
                    .min_by(|a, b| a.abs().total_cmp(&b.abs()));
                assert!(nearest.unwrap().abs() < 0.12);
            }
            // Half a sector counter-clockwise of ray 0, the image is dark.
            let middle = sectors.rays[0] - sector / 2.0;
            let value = image.bilinear(20.0 + 6.0 * middle.cos(), 20.0 + 6.0 * middle.sin());
            assert!(value < 400.0);
        }
    }

    #[test]
    fn corners_of_the_other_kind_and_flat_images_have_no_rays() {
        let place = DVec2::splat(20.0);
        assert!(Sectors::<6>::read(&corner::<4>(0.2), place, &FLAT).is_none());
        assert!(Sectors::<4>::read(&corner::<6>(0.2), place, &FLAT).is_none());
        assert!(Sectors::<6>::read(&Gray::new(41, 41), place, &FLAT).is_none());
        assert!(Sectors::<4>::read(&Gray::new(41, 41), place, &FLAT).is_none());
        assert!(Sectors::<6>::read(&Gray::new(3, 3), DVec2::ONE, &FLAT).is_none());
    }

    #[test]
    fn circles_are_sampled_like_single_points() {
        let image = Gray::from_fn(33, 29, |x, y| ((x * x * 31 + y * y * 17 + x * y) % 1024) as i16);
        for (centre, radius) in [([9.3, 12.9], 8.0), ([16.0, 14.5], 4.5), ([25.99, 3.5], 3.5)] {
            let values = on_circle(&image, centre.into(), radius, &DIRECTIONS);
            for (k, value) in values.into_iter().enumerate() {
                let (sin, cos) = angle_of(k as f64).sin_cos();
                let [x, y] = [centre[0] + radius * cos, centre[1] + radius * sin];
                assert_eq!(value, image.bilinear_inside(x, y));
            }
        }
    }

    #[test]
    fn changes_are_counted_round_the_circle() {
        assert_eq!(changes(EVERY, 0), 0);
        assert_eq!(changes(0, EVERY), 0);
        assert_eq!(changes(EVERY, 0b1111), 2);
        assert_eq!(changes(EVERY, 1 << 47 | 1), 2);
        // A gap takes the side of the sample before it, regardless of the value in the gap.
        assert_eq!(changes(EVERY & !0b1110, 0b0101), 2);
        assert_eq!(changes(1 | 1 << 20 | 1 << 40, 1 << 20), 2);
        assert_eq!(changes(1 | 1 << 20 | 1 << 30 | 1 << 40, 1 << 20 | 1 << 40), 4);
    }

    #[test]
    fn a_bar_across_the_circle_is_not_a_corner() {
        for half_width in [1.0, 2.0] {
            let bar = |value: i16| {
                Gray::from_fn(41, 41, |_, y| {
                    if (y as f64 - 20.0).abs() < half_width { value } else { 400 }
                })
            };
            assert!(Sectors::<4>::read(&bar(100), DVec2::splat(20.0), &FLAT).is_none());
            assert!(Sectors::<4>::read(&bar(700), DVec2::splat(20.0), &FLAT).is_none());
        }
    }

    #[test]
    fn roots_of_the_form_serve_as_rays() {
        let monkey = Form::Cubic([1.0, 0.0, -3.0, 0.0]);
        let rays: [f64; 6] = ordered_rays(&roots(&monkey).unwrap()).unwrap();
        assert!(turn(rays[0], rays[3] + PI).abs() < 1e-9);
        assert!(monkey.towards(DVec2::from_angle(rays[0] - 0.3)) < 0.0, "dark after an even ray");
        let saddle = Form::Quadratic([1.0, 0.0, -1.0]);
        let rays: [f64; 4] = ordered_rays(&roots(&saddle).unwrap()).unwrap();
        assert!(turn(rays[0], rays[2] + PI).abs() < 1e-9);
        assert!(saddle.towards(DVec2::from_angle(rays[0] - 0.3)) < 0.0, "dark after an even ray");
    }
}
