//! Edges, contrast and blur around a position: the start values of the model fit.
//!
//! In a grid, the edges point to the neighbours. For a single corner, they are measured on circles.
//! A corner of three edges is odd under a rotation by 180°, and one of two edges is even. So
//! opposite samples are combined, and half a circle remains. All ways to divide it into K + 1 runs
//! of equal sign are tried, and the one that separates dark from bright best is used. Unlike the
//! roots of a fitted polynomial it always exists, and noise cannot hide an edge.

use std::f64::consts::PI;

use glam::DVec2;
use multiversion::multiversion;

use super::model::corner::Corner;
use crate::lanes;
use crate::lanes::LANES;
use deltille_core::raster::ImageView;

/// Directions on the half-circle: 7.5° apart, so that the 17° between edges at 75° of tilt contain
/// two.
const DIRECTIONS: usize = 24;

/// Shortest run between edges: two directions.
const MIN_RUN: usize = 2;

/// Minimum angle between edges at the start. Blur makes narrow sectors fade, and edges that have
/// merged cannot be separated again.
const MIN_START_RAD: f64 = 15.0 * PI / 180.0;

/// Radii of the circles, as fractions of the radius of the window.
const CIRCLES: [f64; 3] = [0.5, 0.7, 0.9];

/// Their mean.
const MEAN_CIRCLE: f64 = CIRCLES[1];

/// Minimum start value of the blur, px. The fit refines the blur: from 0.15 to 2.4, errors differ by 3 % at most. On
/// sharp squares in windows of 9 px they are 15 % larger at 0.3, and 60 % at 1.2. Corners of a grid start from the
/// grid's blur.
const MIN_START_BLUR_PX: f64 = 0.6;

/// Maximum start value of the blur, as a fraction of the window's radius. With a larger one, the window shows only the
/// centre.
const MAX_START_BLUR: f64 = 0.5;

/// Returns the start values of a corner from the pixels at these columns and rows of a window. The edges have these
/// directions, increasing within 180°, under a blur of `blur_px`. Returns `None` if the window
/// shows only one side of the edges.
pub(crate) fn start_along<const K: usize>(
    places: [&[f32]; 2],
    pixels: &[f32],
    position: DVec2,
    angles: [f64; K],
    blur_px: f64,
) -> Option<Corner<K>> {
    let offset = (position - position.round()).as_vec2().to_array();
    let directions = angles.map(|angle| [angle.cos() as f32, angle.sin() as f32]);
    let sums = match K {
        2 => sums_of_two(places, pixels, offset, &directions),
        _ => sums_of_three(places, pixels, offset, &directions),
    };
    let [plus, minus] = sums.map(|[sum, count]| f64::from(sum / count));
    let (level, amplitude) = ((plus + minus) / 2.0, (plus - minus) / 2.0);
    (amplitude.abs() > f64::EPSILON).then_some(Corner {
        position,
        blur_px,
        amplitude,
        level,
        slope: DVec2::ZERO,
        angles,
        bends: [0.0; K],
        across_px: [0.0; K],
    })
}

#[multiversion(targets("x86_64+avx2"))]
fn sums_of_two(
    places: [&[f32]; 2],
    pixels: &[f32],
    offset: [f32; 2],
    directions: &[[f32; 2]],
) -> [[f32; 2]; 2] {
    sums::<2>(places, pixels, offset, directions)
}

#[multiversion(targets("x86_64+avx2"))]
fn sums_of_three(
    places: [&[f32]; 2],
    pixels: &[f32],
    offset: [f32; 2],
    directions: &[[f32; 2]],
) -> [[f32; 2]; 2] {
    sums::<3>(places, pixels, offset, directions)
}

/// Returns sum and number of the pixels where the pattern is positive, and where it is not. The pattern is the product
/// of the signs of the distances from the edges.
#[inline(always)]
fn sums<const K: usize>(
    [us, vs]: [&[f32]; 2],
    pixels: &[f32],
    [x, y]: [f32; 2],
    directions: &[[f32; 2]],
) -> [[f32; 2]; 2] {
    let (mut sums, mut counts, mut all) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
    let n = us.len().min(vs.len()).min(pixels.len());
    for first in (0..n).step_by(LANES) {
        for k in 0..LANES.min(n - first) {
            let (du, dv) = (us[first + k] - x, vs[first + k] - y);
            let mut sign = 1.0f32;
            for [cos, sin] in &directions[..K] {
                sign *= if cos * dv - sin * du > 0.0 { 1.0 } else { -1.0 };
            }
            let here = 0.5 + 0.5 * sign;
            sums[k] += here * pixels[first + k];
            counts[k] += here;
            all[k] += pixels[first + k];
        }
    }
    let (sum, count) = (lanes::sum(&sums), lanes::sum(&counts));
    [[sum, count], [lanes::sum(&all) - sum, n as f32 - count]]
}

/// Returns the start around `position`, from circles; `None` if the circles leave the image or show no contrast.
pub(crate) fn start<const K: usize>(
    image: ImageView,
    position: DVec2,
    radius: usize,
) -> Option<Corner<K>> {
    let radius_px = radius as f64;
    let inside = position.min_element() >= radius_px
        && position.x + radius_px < image.width() as f64
        && position.y + radius_px < image.height() as f64;
    if !inside {
        return None;
    }
    let odd = K % 2 == 1;
    let mut profile = [0.0; DIRECTIONS];
    let mut total = 0.0;
    for (i, value) in profile.iter_mut().enumerate() {
        let (sin, cos) = direction(i as f64).sin_cos();
        for circle in CIRCLES {
            let (du, dv) = (circle * radius_px * cos, circle * radius_px * sin);
            let here = f64::from(image.bilinear(position.x + du, position.y + dv));
            let opposite = f64::from(image.bilinear(position.x - du, position.y - dv));
            *value += if odd { here - opposite } else { here + opposite };
            total += here + opposite;
        }
    }
    let samples = (2 * CIRCLES.len()) as f64;
    let scale = 1.0 / (samples * f64::from(image.full_scale()));
    let profile = profile.map(|v| v * scale);
    let mean = total * scale / DIRECTIONS as f64;
    let runs = best_runs::<K>(&profile, odd)?;
    // Half-way between bright and dark in the profile.
    let middle = if odd { 0.0 } else { (runs.inner + runs.outer) / 2.0 };
    let signed = (runs.inner - runs.outer) / 2.0;
    let mut slope = 0.0;
    let mut angles = runs.edges.map(|edge| {
        let (before, after) = (neighbour(&profile, edge - 1, odd), profile[edge as usize]);
        slope += (after - before).abs();
        let fraction = ((middle - before) / (after - before)).clamp(0.0, 1.0);
        direction(edge as f64 - 1.0 + if fraction.is_finite() { fraction } else { 0.5 })
    });
    for k in 1..K {
        let lack = (MIN_START_RAD - (angles[k] - angles[k - 1])).max(0.0);
        angles[k - 1] -= lack / 2.0;
        angles[k] += lack / 2.0;
    }
    // The slope of erf(h/√2s) at its centre is √(2/π)/s; the step of the profile is an arc.
    let arc = MEAN_CIRCLE * radius_px * PI / DIRECTIONS as f64;
    let steepness = slope / (K as f64 * signed.abs());
    let blur = (2.0 / PI).sqrt() * arc / steepness;
    // f is +1 between the first two of three edges, −1 between two.
    let amplitude = if odd { signed } else { -signed };
    (amplitude.abs() > f64::EPSILON).then_some(Corner {
        position,
        blur_px: blur.clamp(MIN_START_BLUR_PX, MAX_START_BLUR * radius_px),
        amplitude,
        level: if odd { mean } else { middle },
        slope: DVec2::ZERO,
        angles,
        bends: [0.0; K],
        across_px: [0.0; K],
    })
}

fn direction(index: f64) -> f64 {
    index * PI / DIRECTIONS as f64
}

/// Returns the profile at an index that may lie one before the first.
fn neighbour(profile: &[f64; DIRECTIONS], index: isize, odd: bool) -> f64 {
    match usize::try_from(index) {
        Ok(index) => profile[index],
        Err(_) if odd => -profile[DIRECTIONS - 1],
        Err(_) => profile[DIRECTIONS - 1],
    }
}

/// A division of the half-circle.
struct Runs<const K: usize> {
    /// First index of each run after an edge, increasing.
    edges: [isize; K],
    /// Mean of the profile between the first and second edge, and in runs of the same sign.
    inner: f64,
    /// Mean of the others.
    outer: f64,
}

/// Returns the division with the largest variance between its two classes (Otsu's criterion).
fn best_runs<const K: usize>(profile: &[f64; DIRECTIONS], odd: bool) -> Option<Runs<K>> {
    let mut sums = [0.0; DIRECTIONS + 1];
    for (i, &value) in profile.iter().enumerate() {
        sums[i + 1] = sums[i] + value;
    }
    let n = DIRECTIONS as f64;
    let whole = sums[DIRECTIONS];
    let mut best: Option<(f64, Runs<K>)> = None;
    let mut judge = |edges: [isize; K], inner: f64, outer: f64, separation: f64| {
        if best.as_ref().is_none_or(|(most, _)| separation > *most) {
            best = Some((separation, Runs { edges, inner, outer }));
        }
    };
    for a in 0..DIRECTIONS {
        for b in a + MIN_RUN..DIRECTIONS {
            let (count, sum) = ((b - a) as f64, sums[b] - sums[a]);
            if odd {
                // Beyond the third edge, the profile has the same sign as between the first two;
                // before the first, it has the opposite sign. It is + on a..b and c.., − on ..a and
                // b..c.
                for c in b + MIN_RUN..DIRECTIONS.min(DIRECTIONS + a - MIN_RUN + 1) {
                    let alternating = sum - sums[a] - (sums[c] - sums[b]) + whole - sums[c];
                    let mut edges = [0; K];
                    edges.iter_mut().zip([a, b, c]).for_each(|(e, i)| *e = i as isize);
                    judge(edges, alternating / n, -alternating / n, alternating * alternating);
                }
            } else {
                let (inner, outer) = (sum / count, (whole - sum) / (n - count));
                let mut edges = [0; K];
                edges.iter_mut().zip([a, b]).for_each(|(e, i)| *e = i as isize);
                judge(edges, inner, outer, count * (n - count) * (inner - outer).powi(2));
            }
        }
    }
    best.map(|(_, runs)| runs)
}
