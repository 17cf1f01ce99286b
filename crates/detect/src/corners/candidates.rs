//! Candidates for corners: maxima of R, which [`super::ring`] computes for every pixel.

#![allow(clippy::needless_range_loop, reason = "one index for all rows, so that vectors show")]

use std::ops::Range;

use multiversion::multiversion;

use super::ring::{BLOCK, Block, RADIUS, ResponseRow, Threshold};
use deltille_core::raster::{Gray, bands};

/// Half-width of the window in which a candidate must be the strongest, px. Two corners cannot be
/// closer than the radius of a ring, so half that radius suppresses only duplicates.
const SUPPRESSION_RADIUS: usize = 2;

/// Number of rows in which a maximum must be the strongest.
const WINDOW_ROWS: usize = 2 * SUPPRESSION_RADIUS + 1;

/// A pixel whose neighbourhood looks like a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// Column, px.
    pub x: usize,
    /// Row, px.
    pub y: usize,
    /// R, in squared image units.
    pub response: f32,
}

/// Returns all local maxima of R above `4.5·min_amplitude²` for corners with N rays, in raster
/// order. `min_amplitude` is the smallest amplitude |α| of interest in units of the image (values
/// of at most 10 bits).
pub(crate) fn candidates<const N: usize>(image: &Gray<i16>, min_amplitude: f32) -> Vec<Candidate> {
    let (width, height) = (image.width(), image.height());
    let margin = RADIUS + SUPPRESSION_RADIUS;
    if width <= 2 * margin || height <= 2 * margin {
        return Vec::new();
    }
    let threshold = Threshold::new(min_amplitude);
    let rows = margin..height - margin;
    bands(rows, width, |band| candidates_in_rows::<N>(image, band, threshold))
}

/// Returns the maxima in a range of rows.
fn candidates_in_rows<const N: usize>(
    image: &Gray<i16>,
    rows: Range<usize>,
    threshold: Threshold,
) -> Vec<Candidate> {
    let columns = image.width() - 2 * RADIUS;
    // A rolling window of response rows: row y is stored at y mod WINDOW_ROWS.
    let mut window: [ResponseRow; WINDOW_ROWS] = std::array::from_fn(|_| ResponseRow::new(columns));
    let mut found = Vec::new();
    let first = rows.start - SUPPRESSION_RADIUS;
    for y in first..rows.end + SUPPRESSION_RADIUS {
        window[y % WINDOW_ROWS].compute::<N>(image, [RADIUS, y], threshold);
        if y >= first + WINDOW_ROWS - 1 {
            maxima_of_row(&window, y - SUPPRESSION_RADIUS, threshold.response, &mut found);
        }
    }
    found
}

/// Maximum number of results of [`maxima_near`]. A corner, if there is one, is among the strongest.
const MAXIMA_NEAR: usize = 8;

/// Maximum search distance of [`maxima_near`], px.
const MAX_REACH: usize = 24;

/// Returns positions around a pixel, within `reach` px in either coordinate, from which a fit may
/// reach a corner. These are the strongest 3 × 3 maxima of R, without a threshold. The nearest come
/// first.
pub(crate) fn maxima_near<const N: usize>(
    image: &Gray<i16>,
    place: [usize; 2],
    reach: usize,
) -> Vec<[usize; 2]> {
    let reach = reach.min(MAX_REACH);
    // The border of the area is computed too, but has no maxima.
    let span = |i: usize, side: usize| {
        let first = place[i].saturating_sub(reach + 1).max(RADIUS);
        first..(place[i] + reach + 2).min(side.saturating_sub(RADIUS))
    };
    let (columns, rows) = (span(0, image.width()), span(1, image.height()));
    if columns.len() < 3 || rows.len() < 3 {
        return Vec::new();
    }
    // Whole blocks are faster than a partial one.
    let whole = columns.len().next_multiple_of(BLOCK);
    let fits = columns.start + whole + RADIUS <= image.width();
    let computed = if fits { whole } else { columns.len() };
    let all = Threshold { response: f32::INFINITY, odd: -1, even: -1 };
    let mut window: [ResponseRow; 3] = std::array::from_fn(|_| ResponseRow::new(computed));
    let mut found: Vec<Candidate> = Vec::new();
    for y in rows.clone() {
        window[y % 3].compute::<N>(image, [columns.start, y], all);
        if y < rows.start + 2 {
            continue;
        }
        let [above, here, below] = [y - 2, y - 1, y].map(|y| &window[y % 3].responses);
        for u in 1..columns.len() - 1 {
            let response = here[u];
            if here[u - 1].max(here[u + 1]) <= response
                && [above, below]
                    .iter()
                    .all(|row| row[u - 1].max(row[u]).max(row[u + 1]) <= response)
            {
                found.push(Candidate { x: columns.start + u, y: y - 1, response });
            }
        }
    }
    found.sort_by(|a, b| b.response.total_cmp(&a.response));
    found.truncate(MAXIMA_NEAR);
    let distance2 = |c: &Candidate| c.x.abs_diff(place[0]).pow(2) + c.y.abs_diff(place[1]).pow(2);
    found.sort_by_key(distance2);
    found.into_iter().map(|c| [c.x, c.y]).collect()
}

/// Returns whether a pixel in the middle of three rows reaches a threshold, and none of its four
/// neighbours is stronger.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn may_contain_maximum(rows: [&Vec<f32>; 3], places: Range<usize>, threshold: f32) -> bool {
    let part = |row: usize, from: usize| &rows[row][from..from + places.len()];
    let (above, below) = (part(0, places.start), part(2, places.start));
    let here = part(1, places.start);
    let (left, right) = (part(1, places.start - 1), part(1, places.start + 1));
    let mut may = false;
    for i in 0..here.len() {
        may |= (here[i] > threshold)
            & (here[i] >= left[i])
            & (here[i] >= right[i])
            & (here[i] >= above[i])
            & (here[i] >= below[i]);
    }
    may
}

/// Appends the maxima of row `y`, whose neighbouring rows are all in the window.
fn maxima_of_row(
    window: &[ResponseRow; WINDOW_ROWS],
    y: usize,
    threshold: f32,
    found: &mut Vec<Candidate>,
) {
    let ResponseRow { responses: centre, blocks, .. } = &window[y % WINDOW_ROWS];
    let [above, below] = [y - 1, y + 1].map(|v| &window[v % WINDOW_ROWS].responses);
    // Positions that have all their neighbours.
    let inner = SUPPRESSION_RADIUS..centre.len() - SUPPRESSION_RADIUS;
    for (b, _) in blocks.iter().enumerate().filter(|&(_, &block)| block == Block::Promising) {
        let places = (b * BLOCK).max(inner.start)..((b + 1) * BLOCK).min(inner.end);
        if !may_contain_maximum([above, centre, below], places.clone(), threshold) {
            continue;
        }
        for (i, response) in places.map(|i| (i, centre[i])) {
            // Ties go to the later pixel in raster order, so exactly one of equal neighbours
            // remains. Most pixels are weaker than one of their four neighbours.
            let may_be = response > threshold
                && centre[i - 1].max(above[i]) <= response
                && centre[i + 1].max(below[i]) < response;
            if !may_be {
                continue;
            }
            let near = i - SUPPRESSION_RADIUS..=i + SUPPRESSION_RADIUS;
            let is_maximum = (y - SUPPRESSION_RADIUS..=y + SUPPRESSION_RADIUS).all(|v| {
                let row = &window[v % WINDOW_ROWS].responses[near.clone()];
                let (before, rest) = row.split_at(if v < y { row.len() } else { 0 });
                let (same, after) = rest.split_at(if v == y { SUPPRESSION_RADIUS + 1 } else { 0 });
                before.iter().chain(same).all(|&other| other <= response)
                    && after.iter().all(|&other| other < response)
            });
            if is_maximum {
                found.push(Candidate { x: i + RADIUS, y, response });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::corners::ring::{HALF_RING, PER_AMPLITUDE, even_response, odd_response};
    use crate::tiling::kind;
    use deltille_core::lattice::GridKind;
    use deltille_core::raster::Pyramid;

    /// Renders sectors of 50 and 200 that meet at (cx, cy), rotated by `angle`.
    fn star(cx: f64, cy: f64, angle: f64, sectors: f64) -> Gray<i16> {
        let sharp = Gray::from_fn(40, 40, |x, y| {
            let theta = (y as f64 - cy).atan2(x as f64 - cx) + angle;
            if (theta * sectors / 2.0).sin() > 0.0 { 200u8 } else { 50 }
        });
        Pyramid::new(&sharp, 1, 8).levels()[0].clone()
    }

    #[test]
    fn one_candidate_at_a_corner_in_any_orientation() {
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
            // Around a deltille corner, two edges with their adjacent sectors form weaker
            // candidates, which do not have four sectors.
            for (sectors, part) in [(2.0, 0.125), (6.0, 0.75)] {
                let other = strongest::<4>(&star(sectors));
                assert!(other < part * checker, "{sectors} sectors: {other} of {checker}");
            }
        }
    }

    #[test]
    fn bars_are_not_checkerboard_corners() {
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
    fn skipped_blocks_contain_no_candidate() {
        // Sectors of all sizes and angles, edges, and noise of all strengths.
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let image = Gray::from_fn(300, 200, |x, y| {
            let (u, v) = ((x % 50) as f64 - 24.3, (y % 40) as f64 - 19.6);
            let sectors = ((x / 50 + y / 40) % 7) as f64;
            let star = (v.atan2(u) + 0.01 * x as f64).mul_add(sectors / 2.0, 0.4).sin();
            let noise = random.random_range(-1.0..1.0) * (y / 40) as f64 * 30.0;
            (512.0 + 450.0 * star.signum() + noise) as i16
        });
        let image = Gray::from_fn(300, 200, |x, y| image.at(x, y).clamp(0, 1023));
        for min_amplitude in [1.0, 6.0, 20.0, 60.0] {
            let threshold = Threshold::new(min_amplitude);
            let whole = Threshold { odd: -1, even: -1, ..threshold };
            let rows = 6..194;
            let odd = |t| candidates_in_rows::<6>(&image, rows.clone(), t);
            let even = |t| candidates_in_rows::<4>(&image, rows.clone(), t);
            assert!(odd(threshold).len() > 3 && even(threshold).len() > 3);
            assert_eq!(odd(threshold), odd(whole));
            assert_eq!(even(threshold), even(whole));
        }
    }

    /// Computes R pixel by pixel, and its maxima by a search of the whole window.
    fn one_by_one<const N: usize>(image: &Gray<i16>, min_amplitude: f32) -> Vec<Candidate> {
        let response = |x: usize, y: usize| {
            let at = |k: usize, side: usize| {
                let sign = if side == 0 { 1 } else { -1 };
                let (dx, dy) = HALF_RING[k];
                image.at(x.wrapping_add_signed(sign * dx), y.wrapping_add_signed(sign * dy))
            };
            match kind::<N>() {
                GridKind::Deltille => odd_response(at),
                GridKind::Checker => even_response(at, image.at(x, y)),
            }
        };
        let reach = SUPPRESSION_RADIUS as isize;
        let window = || (-reach..=reach).flat_map(|v| (-reach..=reach).map(move |u| (v, u)));
        let margin = RADIUS + SUPPRESSION_RADIUS;
        let mut found = Vec::new();
        for y in margin..image.height() - margin {
            for x in margin..image.width() - margin {
                let here = response(x, y);
                let strongest = window().all(|(v, u)| {
                    let other = response(x.wrapping_add_signed(u), y.wrapping_add_signed(v));
                    if (v, u) > (0, 0) { other < here } else { other <= here }
                });
                if here > PER_AMPLITUDE * min_amplitude * min_amplitude && strongest {
                    found.push(Candidate { x, y, response: here });
                }
            }
        }
        found
    }

    #[test]
    fn blocks_find_the_same_as_single_pixels_for_any_row_length() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        for width in [13, 20, 24, 33, 40, 71] {
            let image = Gray::from_fn(width, 40, |_, _| random.random_range(0..1024));
            for min_amplitude in [6.0, 60.0] {
                assert_eq!(
                    candidates::<6>(&image, min_amplitude),
                    one_by_one::<6>(&image, min_amplitude)
                );
                assert_eq!(
                    candidates::<4>(&image, min_amplitude),
                    one_by_one::<4>(&image, min_amplitude)
                );
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
