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
//!
//! Most of an image shows nothing, and what cannot reach the threshold need not be known. So pixels
//! are looked at in blocks: R is at most 4.5|α|², and of |α|² the octagon
//!
//! ```text
//!     |z| ≤ max(|Re z|, |Im z|) + ½ min(|Re z|, |Im z|)
//! ```
//!
//! is an upper bound, at most 12 % too large, that 16-bit additions give. Where it passes the
//! threshold, a second look leaves out edges by lower bounds of what is taken away from it: of β, of V (half
//! the square of the range of what it is the variance of, or a sixth of the square of Σ|d|, the sum of the
//! six differences of opposite samples), or of c − m. Only blocks that pass both somewhere are computed, so that nothing is missed.

#![allow(clippy::needless_range_loop, reason = "one index for all rows, so that vectors show")]

use std::ops::Range;

use multiversion::multiversion;

use crate::tiling::kind;
use deltille_core::lattice::GridKind;
use deltille_core::raster::{Gray, bands};

/// Offsets of half the ring, near 0°, 30°, …, 150°; the other half is opposite. Radius 3.6 to 4 px:
/// the smallest ring on which the twelve directions stay within 4° of multiples of 30°, so that it
/// fits between a corner and the code of a small tag (5 px at 2 px a bit).
const HALF_RING: [(isize, isize); 6] = [(4, 0), (3, 2), (2, 3), (0, 4), (-2, 3), (-3, 2)];

/// R of a perfect corner, per |α|²: see above.
pub const PER_AMPLITUDE: f32 = 4.5;

/// Largest offset in [`HALF_RING`], px.
const RADIUS: usize = 4;

/// Half-width of the window in which a candidate must be the strongest, px. Two corners can not be
/// closer than a ring's radius, so half of it suppresses only echoes.
const SUPPRESSION_RADIUS: usize = 2;

/// Rows of which a maximum must be the strongest.
const WINDOW_ROWS: usize = 2 * SUPPRESSION_RADIUS + 1;

/// Pixels that are looked at in one go: a vector of 16-bit numbers. Twice as many would leave a third
/// more of a photograph to compute.
const BLOCK: usize = 16;

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

/// The least R of interest, and what follows from it.
#[derive(Clone, Copy, Debug)]
struct Threshold {
    response: f32,
    /// No |6α| of a deltille corner up to this reaches it.
    odd: i16,
    /// No |12α| of a checkerboard corner up to this reaches it.
    even: i16,
}

impl Threshold {
    fn new(min_amplitude: f32) -> Self {
        // Of harmonics six and twelve times α, as [`odd_may_reach`] and [`even_may_reach`] have them. The bounds are rounded
        // down by up to a half.
        let below = |harmonic: f32| (harmonic.floor() - 1.0) as i16;
        Self {
            response: PER_AMPLITUDE * min_amplitude * min_amplitude,
            odd: below(6.0 * min_amplitude),
            even: below(12.0 * min_amplitude),
        }
    }
}

/// All local maxima of R, for corners with N rays, above `4.5·min_amplitude²`, where `min_amplitude` is the smallest amplitude
/// |α| of interest in units of the image (values of at most 10 bits). In reading order.
pub fn candidates<const N: usize>(image: &Gray<i16>, min_amplitude: f32) -> Vec<Candidate> {
    let (width, height) = (image.width(), image.height());
    let margin = RADIUS + SUPPRESSION_RADIUS;
    if width <= 2 * margin || height <= 2 * margin {
        return Vec::new();
    }
    let threshold = Threshold::new(min_amplitude);
    let rows = margin..height - margin;
    bands(rows, width, |band| candidates_in_rows::<N>(image, band, threshold))
}

/// The maxima in some rows.
fn candidates_in_rows<const N: usize>(
    image: &Gray<i16>,
    rows: Range<usize>,
    threshold: Threshold,
) -> Vec<Candidate> {
    let columns = image.width() - 2 * RADIUS;
    // A rolling window of response rows: row y lives at y mod WINDOW_ROWS.
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

/// Most maxima that [`maxima_near`] gives: the corner, if there is one, is among the strongest.
const MAXIMA_NEAR: usize = 8;

/// Farthest that [`maxima_near`] looks, px.
const MAX_REACH: usize = 24;

/// Places around a pixel, within `reach` px of it in either coordinate, from which a fit may reach a
/// corner: the strongest of those where R, be it what it may, is the greatest of nine. The nearest
/// come first.
pub fn maxima_near<const N: usize>(
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
    // Whole blocks are faster than what is left of one.
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

/// What is known of a block of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    /// Nothing in it reaches the threshold; all is 0.
    Weak,
    /// Computed, and nothing in it exceeds the threshold.
    Computed,
    /// Computed, and something does.
    Promising,
}

/// R of a row for columns RADIUS .. width − RADIUS; 0 where it cannot reach the threshold.
#[derive(Clone, Debug)]
struct ResponseRow {
    responses: Vec<f32>,
    blocks: Vec<Block>,
    /// Which blocks of the row are worth a second look.
    flags: Vec<bool>,
}

/// A row of pixels at each place of the ring, opposite ones together.
type Ring<'a> = [[&'a [i16]; 2]; 6];

impl ResponseRow {
    fn new(columns: usize) -> Self {
        let blocks = vec![Block::Weak; columns.div_ceil(BLOCK)];
        let flags = vec![false; columns / BLOCK];
        Self { responses: vec![0.0; columns], blocks, flags }
    }

    /// The responses of row `y` from column `x` on.
    fn compute<const N: usize>(
        &mut self,
        image: &Gray<i16>,
        [x, y]: [usize; 2],
        threshold: Threshold,
    ) {
        let n = self.responses.len();
        let at = |dx: isize, dy: isize| {
            let row = image.row(y.wrapping_add_signed(dy));
            &row[x.wrapping_add_signed(dx)..][..n]
        };
        let ring: Ring = HALF_RING.map(|(dx, dy)| [at(dx, dy), at(-dx, -dy)]);
        let Self { responses, blocks, flags } = self;
        match kind::<N>() {
            GridKind::Deltille => odd_row(ring, threshold, flags, responses, blocks),
            GridKind::Checker => even_row(ring, at(0, 0), threshold, flags, responses, blocks),
        }
    }
}

/// R of deltille corners at places whose opposite samples are given.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn odd_row(
    ring: Ring,
    threshold: Threshold,
    flags: &mut [bool],
    out: &mut [f32],
    states: &mut [Block],
) {
    let whole = out.len() / BLOCK;
    let blocks = in_blocks(ring, whole);
    let flags = &mut flags[..whole];
    // All blocks are looked at before any is computed: nothing to be guessed, and no look waits.
    for b in 0..whole {
        flags[b] = odd_may_reach(block(&blocks, b), threshold);
    }
    let (responses, rest) = out.as_chunks_mut::<BLOCK>();
    for b in 0..whole {
        let pixels = block(&blocks, b);
        if flags[b] && (threshold.odd < 0 || odd_is_no_edge(pixels, threshold)) {
            responses[b] = odd_block(pixels);
            states[b] = state(&responses[b], threshold.response);
        } else if states[b] != Block::Weak {
            responses[b] = [0.0; BLOCK];
            states[b] = Block::Weak;
        }
    }
    if rest.is_empty() {
        return;
    }
    states[whole] = Block::Promising;
    if let Some(pixels) = last_block(ring) {
        rest.copy_from_slice(&odd_block(pixels)[BLOCK - rest.len()..]);
    } else {
        for (i, response) in rest.iter_mut().enumerate() {
            *response = odd_response(|k, side| ring[k][side][i]);
        }
    }
}

/// Whether the bound of |α| passes the threshold somewhere in a block.
#[inline(always)]
fn odd_may_reach(pixels: Pixels, threshold: Threshold) -> bool {
    let mut may_reach = false;
    for i in 0..BLOCK {
        let odd = |k: usize| pixels[k][0][i] - pixels[k][1][i];
        let c3 = odd(0) - odd(2) + odd(4);
        let s3 = odd(1) - odd(3) + odd(5);
        may_reach |= octagon(c3, s3) > threshold.odd;
    }
    may_reach
}

/// Whether it does where no edge takes R below zero.
#[inline(always)]
fn odd_is_no_edge(pixels: Pixels, threshold: Threshold) -> bool {
    let mut may_reach = false;
    for i in 0..BLOCK {
        let mut odd = [0i16; 6];
        let (mut least, mut most) = (i16::MAX, i16::MIN);
        for k in 0..6 {
            odd[k] = pixels[k][0][i] - pixels[k][1][i];
            let even = pixels[k][0][i] + pixels[k][1][i];
            least = least.min(even);
            most = most.max(even);
        }
        let alpha = octagon(odd[0] - odd[2] + odd[4], odd[1] - odd[3] + odd[5]);
        // 6β but for the rounding: R < 0 where it is 2.1213 times 6α.
        let (d1, d2) = (odd[1] - odd[5], odd[2] + odd[4]);
        let c1 = odd[0] + d1 - (d1 >> 3) + ((odd[2] - odd[4]) >> 1);
        let s1 = odd[3] + d2 - (d2 >> 3) + ((odd[1] + odd[5]) >> 1);
        // V is no less than half the square of the range; R < 0 where that is 0.7071 of 6α.
        let is_edge = (c1.abs().max(s1.abs()) - 2 > 2 * alpha + (alpha >> 2))
            | (most - least > (alpha >> 1) + (alpha >> 2) + 1);
        may_reach |= (alpha > threshold.odd) & !is_edge;
    }
    may_reach
}

#[inline(always)]
fn odd_block(pixels: Pixels) -> [f32; BLOCK] {
    let mut responses = [0.0; BLOCK];
    for i in 0..BLOCK {
        responses[i] = odd_response(|k, side| pixels[k][side][i]);
    }
    responses
}

/// R of checkerboard corners at places whose opposite samples are given, and the centres.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn even_row(
    ring: Ring,
    centre: &[i16],
    threshold: Threshold,
    flags: &mut [bool],
    out: &mut [f32],
    states: &mut [Block],
) {
    let whole = out.len() / BLOCK;
    let blocks = in_blocks(ring, whole);
    let centres = &centre.as_chunks::<BLOCK>().0[..whole];
    let flags = &mut flags[..whole];
    for b in 0..whole {
        flags[b] = even_may_reach(block(&blocks, b), threshold);
    }
    let (responses, rest) = out.as_chunks_mut::<BLOCK>();
    for b in 0..whole {
        let pixels = block(&blocks, b);
        if flags[b] && (threshold.even < 0 || even_is_no_edge(pixels, &centres[b], threshold)) {
            responses[b] = even_block(pixels, &centres[b]);
            states[b] = state(&responses[b], threshold.response);
        } else if states[b] != Block::Weak {
            responses[b] = [0.0; BLOCK];
            states[b] = Block::Weak;
        }
    }
    if rest.is_empty() {
        return;
    }
    states[whole] = Block::Promising;
    if let (Some(pixels), Some(centres)) = (last_block(ring), centre.last_chunk()) {
        rest.copy_from_slice(&even_block(pixels, centres)[BLOCK - rest.len()..]);
    } else {
        for (i, response) in rest.iter_mut().enumerate() {
            *response = even_response(|k, side| ring[k][side][i], centre[i]);
        }
    }
}

/// Whether the bound of |α| passes the threshold somewhere in a block.
#[inline(always)]
fn even_may_reach(pixels: Pixels, threshold: Threshold) -> bool {
    let mut may_reach = false;
    for i in 0..BLOCK {
        let even = |k: usize| pixels[k][0][i] + pixels[k][1][i];
        let (e14, e52) = (even(1) - even(4), even(5) - even(2));
        let c2 = 2 * (even(0) - even(3)) + e14 + e52;
        // √3 of it, or slightly more.
        let s2 = (e14 - e52).abs();
        may_reach |= octagon(c2, 2 * s2 - (s2 >> 2)) > threshold.even;
    }
    may_reach
}

/// Whether it does where neither an edge nor a bar takes R below zero.
#[inline(always)]
fn even_is_no_edge(pixels: Pixels, centres: &[i16; BLOCK], threshold: Threshold) -> bool {
    let mut may_reach = false;
    for i in 0..BLOCK {
        let (mut even, mut differences) = ([0i16; 6], 0i16);
        for k in 0..6 {
            even[k] = pixels[k][0][i] + pixels[k][1][i];
            differences += (pixels[k][0][i] - pixels[k][1][i]).abs();
        }
        let (e14, e52) = (even[1] - even[4], even[5] - even[2]);
        let s2 = (e14 - e52).abs();
        let alpha = octagon(2 * (even[0] - even[3]) + e14 + e52, 2 * s2 - (s2 >> 2));
        // V is no less than a sixth of their square, and R < 0 where they are 0.6124 of 12α.
        // 12(c − m) leaves R < 0 where it is 0.7071 of 12α.
        let sum = even[0] + even[1] + even[2] + even[3] + even[4] + even[5];
        let off = (12 * centres[i] - sum).abs();
        let is_edge = (differences > (alpha >> 1) + (alpha >> 3) + 2)
            | (off > (alpha >> 1) + (alpha >> 2) + 1);
        may_reach |= (alpha > threshold.even) & !is_edge;
    }
    may_reach
}

#[inline(always)]
fn even_block(pixels: Pixels, centres: &[i16; BLOCK]) -> [f32; BLOCK] {
    let mut responses = [0.0; BLOCK];
    for i in 0..BLOCK {
        responses[i] = even_response(|k, side| pixels[k][side][i], centres[i]);
    }
    responses
}

/// A block of each of the rows of a ring.
type Pixels<'a> = [[&'a [i16; BLOCK]; 2]; 6];

/// Block `b`. (A loop, as below.)
#[inline(always)]
fn block<'a>(blocks: &[[&'a [[i16; BLOCK]]; 2]; 6], b: usize) -> Pixels<'a> {
    let mut pixels = [[&[0; BLOCK]; 2]; 6];
    for k in 0..6 {
        for side in 0..2 {
            pixels[k][side] = &blocks[k][side][b];
        }
    }
    pixels
}

/// The last pixels of each row, as many as a block has, if there are so many.
#[inline(always)]
fn last_block<'a>(ring: Ring<'a>) -> Option<Pixels<'a>> {
    let mut pixels: Pixels<'a> = [[&[0; BLOCK]; 2]; 6];
    for k in 0..6 {
        for side in 0..2 {
            pixels[k][side] = ring[k][side].last_chunk()?;
        }
    }
    Some(pixels)
}

/// The first `count` blocks of each row. (A loop: closures handed to the standard library would not
/// be compiled for the target, and the lengths would be forgotten.)
#[inline(always)]
fn in_blocks<'a>(ring: Ring<'a>, count: usize) -> [[&'a [[i16; BLOCK]]; 2]; 6] {
    let mut blocks: [[&'a [[i16; BLOCK]]; 2]; 6] = [[&[]; 2]; 6];
    for k in 0..6 {
        for side in 0..2 {
            blocks[k][side] = &ring[k][side].as_chunks::<BLOCK>().0[..count];
        }
    }
    blocks
}

/// Of a block that has been computed.
#[inline(always)]
fn state(responses: &[f32; BLOCK], threshold: f32) -> Block {
    let mut any = false;
    for &response in responses {
        any |= response > threshold;
    }
    if any { Block::Promising } else { Block::Computed }
}

/// No less than the length of a vector, up to half a unit of rounding.
#[inline(always)]
fn octagon(x: i16, y: i16) -> i16 {
    let (x, y) = (x.abs(), y.abs());
    x.max(y) + (x.min(y) >> 1)
}

/// R of a deltille corner; `at` gives the sample of a pair and a side.
#[inline(always)]
fn odd_response(at: impl Fn(usize, usize) -> i16) -> f32 {
    let (mut odd, mut even) = ([0i16; 6], [0i16; 6]);
    for k in 0..6 {
        odd[k] = at(k, 0) - at(k, 1);
        even[k] = at(k, 0) + at(k, 1);
    }
    // Third harmonic, 6α, and first harmonic with weights 8·cos 30°k ≈ 8, 7, 4, 0: 48β.
    let c3 = i32::from(odd[0] - odd[2] + odd[4]);
    let s3 = i32::from(odd[1] - odd[3] + odd[5]);
    let c1 = i32::from(8 * odd[0] + 7 * (odd[1] - odd[5]) + 4 * (odd[2] - odd[4]));
    let s1 = i32::from(8 * odd[3] + 7 * (odd[2] + odd[4]) + 4 * (odd[1] + odd[5]));
    // Plain sums: closures would not be compiled for the target.
    let (mut sum, mut squares) = (0i16, 0);
    for even in even {
        sum += even;
        squares += i32::from(even) * i32::from(even);
    }
    let sum = i32::from(sum);
    // |α|² and |β|² are these over 6² and 48².
    let alpha = (c3 * c3 + s3 * s3) as f32 * (PER_AMPLITUDE / 36.0);
    let beta = (c1 * c1 + s1 * s1) as f32 * (1.0 / 2304.0);
    // Six times the variance of the six sums.
    let variance = squares as f32 - (sum * sum) as f32 * (1.0 / 6.0);
    alpha - beta - 0.5 * variance
}

/// R of a checkerboard corner; `at` gives the sample of a pair and a side.
#[inline(always)]
fn even_response(at: impl Fn(usize, usize) -> i16, centre: i16) -> f32 {
    let (mut odd, mut even) = ([0i16; 6], [0i16; 6]);
    for k in 0..6 {
        odd[k] = at(k, 0) - at(k, 1);
        even[k] = at(k, 0) + at(k, 1);
    }
    // Second harmonic with the weights 2·cos 60°k and 2·sin 60°k/√3: 12α.
    let c2 = i32::from(2 * (even[0] - even[3]) + even[1] - even[2] - even[4] + even[5]);
    let s2 = i32::from(even[1] + even[2] - even[4] - even[5]);
    let (mut sum, mut squares) = (0i16, 0);
    for k in 0..6 {
        sum += even[k];
        squares += i32::from(odd[k]) * i32::from(odd[k]);
    }
    // |α|² is this over 12².
    let alpha = (c2 * c2 + 3 * (s2 * s2)) as f32 * (PER_AMPLITUDE / 144.0);
    // 12(c − m), of which R takes 9(c − m)² away.
    let off = f32::from(12 * centre - sum);
    alpha - 0.5 * squares as f32 - off * off * (9.0 / 144.0)
}

/// Whether some of the middle one of three rows reach a threshold and none of the four places next to
/// them is stronger.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512dq+avx512vl", "x86_64+avx2"))]
fn may_hold_maximum(rows: [&Vec<f32>; 3], places: Range<usize>, threshold: f32) -> bool {
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
    // Those that have all their neighbours.
    let inner = SUPPRESSION_RADIUS..centre.len() - SUPPRESSION_RADIUS;
    for (b, _) in blocks.iter().enumerate().filter(|&(_, &block)| block == Block::Promising) {
        let places = (b * BLOCK).max(inner.start)..((b + 1) * BLOCK).min(inner.end);
        if !may_hold_maximum([above, centre, below], places.clone(), threshold) {
            continue;
        }
        for (i, response) in places.map(|i| (i, centre[i])) {
            // Ties go to the later pixel in reading order, so exactly one of equal neighbours stays.
            // Most fall short of one of the four next to them.
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
    use deltille_core::raster::Pyramid;

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
    fn what_is_passed_over_holds_no_candidate() {
        // Sectors of all sizes at all angles, edges, and noise of all strengths.
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

    /// R pixel by pixel, and its maxima by looking at all of the window.
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
    fn blocks_of_rows_of_any_length_find_what_single_pixels_do() {
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
