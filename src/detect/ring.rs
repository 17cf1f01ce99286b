//! Dense candidates: where a ring of twelve samples alternates three times, or twice.
//!
//! On a circle the cubic form of a monkey saddle is `Re(α·e^{3iθ} + β·e^{iθ})`, and the paper's
//! discriminant of star-shaped umbilics (Eq. 5) is `J ∝ |β|² − 9|α|²`. The ring measures the same
//! α and β as third and first harmonic of twelve samples at 30° steps,
//!
//! ```text
//!     R = 4.5|α|² − |β|² − ½V
//! ```
//!
//! V is the variance of the sums of opposite samples: a monkey saddle is odd, `f(−Δ) = −f(Δ)` about
//! its level, so V is noise there, while an edge that passes beside the centre shows in it. Edges
//! through the centre have 9|α|² ≈ |β|², so |α|² has half the weight of the discriminant: up to 60°
//! of tilt corners stay clear of that wherever their blur is small against the ring, which it is on
//! some level of the pyramid. With twelve samples the third harmonic needs additions only, and the
//! whole image costs about three nanoseconds a pixel.
//!
//! A checkerboard corner is even, `f(−Δ) = f(Δ)`. Its α is the second harmonic, and
//!
//! ```text
//!     R = 4.5|α|² − ½V − 9(c − m)²
//! ```
//!
//! Here V is the sum of squared differences of opposite samples, which edges beside the centre
//! leave; a bar across the ring, which is even as well, leaves the difference of the centre c and
//! the ring's mean m. At a corner, however narrow its sectors, these agree: blur makes the centre
//! the mean over all directions. On the middle of a bar they differ by half of |α| or more, and on
//! all but the widest by more than the 0.7|α| at which R vanishes.

use multiversion::multiversion;

use super::tiling::kind;
use crate::raster::Gray;
use crate::target::GridKind;

/// Offsets of half the ring, near 0°, 30°, …, 150°; the other half is opposite. Radius 3.6 to 4 px:
/// the smallest ring on which the twelve directions stay within 4° of multiples of 30°, so that it
/// fits between a corner and the code of a small tag (5 px at 2 px a bit).
const HALF_RING: [(isize, isize); 6] = [(4, 0), (3, 2), (2, 3), (0, 4), (-2, 3), (-3, 2)];

/// Largest offset in [`HALF_RING`], px.
const RADIUS: usize = 4;

/// Half-width of the window in which a candidate must be the strongest, px. Two corners can not be
/// closer than a ring's radius, so half of it suppresses only echoes.
const SUPPRESSION_RADIUS: usize = 2;

/// A pixel whose neighbourhood looks like a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Column, px.
    pub x: usize,
    /// Row, px.
    pub y: usize,
    /// R, in squared image units.
    pub response: f32,
}

/// All local maxima of R, for corners with N rays, above `4.5·min_amplitude²`, where `min_amplitude` is the smallest amplitude
/// |α| of interest in units of the image (values of at most 10 bits).
pub fn candidates<const N: usize>(image: &Gray<i16>, min_amplitude: f32) -> Vec<Candidate> {
    let (width, height) = (image.width(), image.height());
    let margin = RADIUS + SUPPRESSION_RADIUS;
    if width <= 2 * margin || height <= 2 * margin {
        return Vec::new();
    }
    let threshold = 4.5 * min_amplitude * min_amplitude;
    let rows = 2 * SUPPRESSION_RADIUS + 1;
    // A rolling window of response rows: row y lives at y mod rows.
    let mut window = vec![vec![0.0f32; width]; rows];
    let mut found = Vec::new();
    for y in RADIUS..height - RADIUS {
        response_row::<N>(image, y, &mut window[y % rows][RADIUS..width - RADIUS]);
        if y >= RADIUS + rows - 1 {
            maxima_of_row(&window, y - SUPPRESSION_RADIUS, threshold, &mut found);
        }
    }
    found
}

/// R of row `y` for columns RADIUS .. width − RADIUS.
fn response_row<const N: usize>(image: &Gray<i16>, y: usize, out: &mut [f32]) {
    let n = out.len();
    let at = |dx: isize, dy: isize| {
        let row = image.row(y.wrapping_add_signed(dy));
        &row[RADIUS.wrapping_add_signed(dx)..][..n]
    };
    let ring = HALF_RING.map(|(dx, dy)| [at(dx, dy), at(-dx, -dy)]);
    match kind::<N>() {
        GridKind::Deltille => odd_responses(ring, out),
        GridKind::Checker => even_responses(ring, at(0, 0), out),
    }
}

/// R of deltille corners at places whose opposite samples are given.
#[multiversion(targets = "simd")]
fn odd_responses(ring: [[&[i16]; 2]; 6], out: &mut [f32]) {
    let n = out.len();
    let ring = ring.map(|pair| pair.map(|row| &row[..n]));
    for i in 0..n {
        let odd: [i16; 6] = std::array::from_fn(|k| ring[k][0][i] - ring[k][1][i]);
        let even: [i16; 6] = std::array::from_fn(|k| ring[k][0][i] + ring[k][1][i]);
        // Third harmonic, 6α, and first harmonic with weights 8·cos 30°k ≈ 8, 7, 4, 0: 48β.
        let c3 = i32::from(odd[0] - odd[2] + odd[4]);
        let s3 = i32::from(odd[1] - odd[3] + odd[5]);
        let c1 = i32::from(8 * odd[0] + 7 * (odd[1] - odd[5]) + 4 * (odd[2] - odd[4]));
        let s1 = i32::from(8 * odd[3] + 7 * (odd[2] + odd[4]) + 4 * (odd[1] + odd[5]));
        let sum: i32 = even.iter().map(|&e| i32::from(e)).sum();
        let squares: i32 = even.iter().map(|&e| i32::from(e) * i32::from(e)).sum();
        let alpha = (c3 * c3 + s3 * s3) as f32 * (4.5 / 36.0);
        let beta = (c1 * c1 + s1 * s1) as f32 * (1.0 / 2304.0);
        let variance = squares as f32 - (sum * sum) as f32 * (1.0 / 6.0);
        out[i] = alpha - beta - 0.5 * variance;
    }
}

/// R of checkerboard corners at places whose opposite samples are given, and the centres.
#[multiversion(targets = "simd")]
fn even_responses(ring: [[&[i16]; 2]; 6], centre: &[i16], out: &mut [f32]) {
    let n = out.len();
    let ring = ring.map(|pair| pair.map(|row| &row[..n]));
    let centre = &centre[..n];
    for i in 0..n {
        let odd: [i16; 6] = std::array::from_fn(|k| ring[k][0][i] - ring[k][1][i]);
        let even: [i16; 6] = std::array::from_fn(|k| ring[k][0][i] + ring[k][1][i]);
        // Second harmonic with the weights 2·cos 60°k and 2·sin 60°k/√3: 12α.
        let c2 = i32::from(2 * (even[0] - even[3]) + even[1] - even[2] - even[4] + even[5]);
        let s2 = i32::from(even[1] + even[2] - even[4] - even[5]);
        // Plain sums: closures would not be compiled for the target.
        let mut sum = 0;
        let mut squares = 0;
        for k in 0..6 {
            sum += i32::from(even[k]);
            squares += i32::from(odd[k]) * i32::from(odd[k]);
        }
        let alpha = (c2 * c2 + 3 * s2 * s2) as f32 * (4.5 / 144.0);
        // 12(c − m)
        let off = (12 * i32::from(centre[i]) - sum) as f32;
        out[i] = alpha - 0.5 * squares as f32 - off * off * (9.0 / 144.0);
    }
}

/// Whether any value exceeds the threshold.
#[multiversion(targets = "simd")]
fn any_above(values: &[f32], threshold: f32) -> bool {
    values.iter().fold(false, |any, &value| any | (value > threshold))
}

/// Appends the maxima of row `y`, whose neighbouring rows are all in the window.
fn maxima_of_row(window: &[Vec<f32>], y: usize, threshold: f32, found: &mut Vec<Candidate>) {
    let rows = window.len();
    let width = window[0].len();
    let centre = &window[y % rows];
    let margin = RADIUS + SUPPRESSION_RADIUS;
    /// Values looked at in one go; few rows of few images have a candidate among so many.
    const BLOCK: usize = 64;
    let blocks =
        (margin..width - margin).step_by(BLOCK).map(|x| x..(x + BLOCK).min(width - margin));
    let promising = blocks.filter(|block| any_above(&centre[block.clone()], threshold));
    for x in promising.flatten() {
        let response = centre[x];
        if response <= threshold {
            continue;
        }
        let columns = x - SUPPRESSION_RADIUS..=x + SUPPRESSION_RADIUS;
        // Ties go to the later pixel in reading order, so exactly one of equal neighbours stays.
        let is_maximum = (y - SUPPRESSION_RADIUS..=y + SUPPRESSION_RADIUS).all(|v| {
            let row = &window[v % rows];
            columns
                .clone()
                .all(|u| if (v, u) > (y, x) { row[u] < response } else { row[u] <= response })
        });
        if is_maximum {
            found.push(Candidate { x, y, response });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Pyramid;

    /// Sectors of 50 and 200, meeting at (cx, cy), turned by `angle`.
    fn star(cx: f64, cy: f64, angle: f64, sectors: f64) -> Gray<i16> {
        let sharp = Gray::from_fn(40, 40, |x, y| {
            let theta = (y as f64 - cy).atan2(x as f64 - cx) + angle;
            if (theta * sectors / 2.0).sin() > 0.0 { 200u8 } else { 50 }
        });
        Pyramid::new(&sharp, 1, 8).levels()[0].clone()
    }

    #[test]
    fn one_candidate_at_a_corner_whatever_its_turn() {
        for k in 0..12 {
            let turn = 0.1 * f64::from(k);
            for found in [
                candidates::<6>(&star(20.2, 19.7, turn, 6.0), 20.0),
                candidates::<4>(&star(20.2, 19.7, turn, 4.0), 20.0),
            ] {
                let best = found.iter().max_by(|a, b| a.response.total_cmp(&b.response)).unwrap();
                assert!(best.x.abs_diff(20) <= 1 && best.y.abs_diff(20) <= 1);
            }
        }
    }

    fn strongest<const N: usize>(image: &Gray<i16>) -> f32 {
        candidates::<N>(image, 1.0).iter().map(|c| c.response).fold(0.0, f32::max)
    }

    #[test]
    fn edges_and_corners_of_the_other_kind_are_weak() {
        let deltille = strongest::<6>(&star(20.0, 20.0, 0.05, 6.0));
        let checker = strongest::<4>(&star(20.0, 20.0, 0.05, 4.0));
        for k in 0..12 {
            let star = |sectors| star(20.0, 20.0, 0.1 * f64::from(k) + 0.05, sectors);
            for sectors in [2.0, 4.0] {
                let other = strongest::<6>(&star(sectors));
                assert!(other < deltille / 8.0, "{sectors} sectors: {other} of {deltille}");
            }
            // Around a deltille corner there are two edges with sectors beside them: weaker
            // candidates, which have no four sectors.
            for (sectors, part) in [(2.0, 0.125), (6.0, 0.75)] {
                let other = strongest::<4>(&star(sectors));
                assert!(other < part * checker, "{sectors} sectors: {other} of {checker}");
            }
        }
    }

    #[test]
    fn bars_are_no_checkerboard_corners() {
        let checker = strongest::<4>(&star(20.0, 20.0, 0.05, 4.0));
        for k in 0..12 {
            let (sin, cos) = (0.27 * f64::from(k)).sin_cos();
            for half_width in [0.7, 1.0, 1.5, 2.0] {
                let sharp = Gray::from_fn(40, 40, |x, y| {
                    let off = (x as f64 - 20.0) * cos + (y as f64 - 20.3) * sin;
                    if off.abs() < half_width { 50u8 } else { 200 }
                });
                let bar = strongest::<4>(&Pyramid::new(&sharp, 1, 8).levels()[0].clone());
                assert!(bar < checker / 8.0, "{half_width}: {bar} of {checker}");
            }
        }
    }

    #[test]
    fn small_and_constant_images_have_none() {
        for side in [0, 1, 8, 12, 13, 40] {
            assert!(candidates::<6>(&Gray::new(side, side), 1.0).is_empty());
            assert!(candidates::<4>(&Gray::new(side, side), 1.0).is_empty());
        }
    }
}
