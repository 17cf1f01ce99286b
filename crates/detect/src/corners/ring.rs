//! Corner response of every pixel: how clearly a ring of twelve samples alternates three times, or twice.
//!
//! On a circle, the cubic form of a monkey saddle is `Re(α·e^{3iθ} + β·e^{iθ})`. The discriminant of star-shaped
//! umbilics (paper, Eq. 5) is `J ∝ |β|² − 9|α|²`. The ring measures the same α and β as third and first harmonic of
//! twelve samples at 30° steps:
//!
//! ```text
//!     R = 4.5|α|² − |β|² − ½V
//! ```
//!
//! V is the variance of the sums of opposite samples. A monkey saddle is odd about its level, `f(−Δ) = −f(Δ)`, so V is
//! noise there. An edge that passes next to the centre increases V. Edges through the centre have
//! 9|α|² ≈ |β|², so |α|² has half the weight that it has in the discriminant. Up to 60° of tilt,
//! corners stay clear of this limit if their blur is small compared with the ring. This is the case
//! on some pyramid level. With twelve samples the third harmonic needs only additions, and the
//! whole image costs about 3 ns per pixel.
//!
//! A checkerboard corner is even, `f(−Δ) = f(Δ)`. Its α is the second harmonic, and
//!
//! ```text
//!     R = 4.5|α|² − ½V − 9(c − m)²
//! ```
//!
//! Here V is the sum of squared differences of opposite samples, which edges next to the centre
//! cause. A bar across the ring is even as well, but its centre c differs from the mean m of the
//! ring. At a corner, even with narrow sectors, c and m agree, because blur makes the centre the
//! mean over all directions. At the middle of a bar, they differ by half of |α| or more. On all but
//! the widest bars they differ by more than the 0.7|α| at which R vanishes.
//!
//! Most of an image has no corners, and values below the threshold need not be computed. Pixels are therefore tested in
//! blocks. R is at most 4.5|α|². For |α|², the octagon
//!
//! ```text
//!     |z| ≤ max(|Re z|, |Im z|) + ½ min(|Re z|, |Im z|)
//! ```
//!
//! is an upper bound that is at most 12 % too large and needs only 16-bit additions. If it exceeds
//! the threshold, a second test excludes edges by lower bounds of the subtracted terms: β, V or c −
//! m. V is at least half the square of the range of the values whose variance it is. It is also at
//! least a sixth of the square of Σ|d|, the sum of the six differences of opposite samples. Only
//! blocks in which some pixel passes both tests are computed, so no corner is missed.

#![allow(clippy::needless_range_loop, reason = "one index for all rows, so that vectors show")]

use multiversion::multiversion;

use crate::tiling::kind;
use deltille_core::lattice::GridKind;
use deltille_core::raster::Gray;

/// Offsets of half the ring, near 0°, 30°, …, 150°; the other half is opposite. The radius is 3.6 to 4 px. This is the
/// smallest ring on which the twelve directions stay within 4° of multiples of 30°. It fits between a corner and the
/// code of a small tag (5 px at 2 px per bit).
pub(super) const HALF_RING: [(isize, isize); 6] =
    [(4, 0), (3, 2), (2, 3), (0, 4), (-2, 3), (-3, 2)];

/// R of a perfect corner, per |α|²: see above.
pub(crate) const PER_AMPLITUDE: f32 = 4.5;

/// Largest offset in [`HALF_RING`], px.
pub(crate) const RADIUS: usize = 4;

/// Pixels per block: a vector of 16-bit numbers. With twice as many, R would be computed for a
/// third more pixels of a photograph.
pub(super) const BLOCK: usize = 16;

/// The minimum R of interest, and the bounds derived from it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Threshold {
    pub(super) response: f32,
    /// Largest |6α| of a deltille corner that does not reach it.
    pub(super) odd: i16,
    /// Largest |12α| of a checkerboard corner that does not reach it.
    pub(super) even: i16,
}

impl Threshold {
    pub(super) fn new(min_amplitude: f32) -> Self {
        // Harmonics are six and twelve times α, as in [`odd_may_reach`] and [`even_may_reach`]. The bounds are rounded
        // down by up to a half.
        let below = |harmonic: f32| (harmonic.floor() - 1.0) as i16;
        Self {
            response: PER_AMPLITUDE * min_amplitude * min_amplitude,
            odd: below(6.0 * min_amplitude),
            even: below(12.0 * min_amplitude),
        }
    }
}

/// State of a block of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Block {
    /// No pixel reaches the threshold; all values are 0.
    Weak,
    /// Computed; no pixel exceeds the threshold.
    Computed,
    /// Computed; some pixel exceeds the threshold.
    Promising,
}

/// R of a row for columns RADIUS .. width − RADIUS; 0 where it cannot reach the threshold.
#[derive(Clone, Debug)]
pub(super) struct ResponseRow {
    pub(super) responses: Vec<f32>,
    pub(super) blocks: Vec<Block>,
    /// Blocks of the row that need a second test.
    pub(super) flags: Vec<bool>,
}

/// A row of pixels at each position of the ring, in opposite pairs.
type Ring<'a> = [[&'a [i16]; 2]; 6];

impl ResponseRow {
    pub(super) fn new(columns: usize) -> Self {
        let blocks = vec![Block::Weak; columns.div_ceil(BLOCK)];
        let flags = vec![false; columns / BLOCK];
        Self { responses: vec![0.0; columns], blocks, flags }
    }

    /// Computes the responses of row `y`, starting at column `x`.
    pub(super) fn compute<const N: usize>(
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

/// Computes R of deltille corners from opposite samples.
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
    // All blocks are tested before any is computed. This avoids branch mispredictions and stalls.
    for b in 0..whole {
        flags[b] = odd_may_reach(block(&blocks, b), threshold);
    }
    let (responses, rest) = out.as_chunks_mut::<BLOCK>();
    for b in 0..whole {
        let pixels = block(&blocks, b);
        if flags[b] && (threshold.odd < 0 || odd_is_not_edge(pixels, threshold)) {
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

/// Returns whether the bound of |α| passes the threshold somewhere in a block.
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

/// Returns whether the bound exceeds the threshold at a pixel where no edge makes R negative.
#[inline(always)]
fn odd_is_not_edge(pixels: Pixels, threshold: Threshold) -> bool {
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
        // 6β except for rounding: R < 0 where it exceeds 2.1213 times 6α.
        let (d1, d2) = (odd[1] - odd[5], odd[2] + odd[4]);
        let c1 = odd[0] + d1 - (d1 >> 3) + ((odd[2] - odd[4]) >> 1);
        let s1 = odd[3] + d2 - (d2 >> 3) + ((odd[1] + odd[5]) >> 1);
        // V is at least half the square of the range; R < 0 where the range exceeds 0.7071 times
        // 6α.
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

/// Computes R of checkerboard corners from opposite samples and the centres.
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
        if flags[b] && (threshold.even < 0 || even_is_not_edge(pixels, &centres[b], threshold)) {
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

/// Returns whether the bound of |α| passes the threshold somewhere in a block.
#[inline(always)]
fn even_may_reach(pixels: Pixels, threshold: Threshold) -> bool {
    let mut may_reach = false;
    for i in 0..BLOCK {
        let even = |k: usize| pixels[k][0][i] + pixels[k][1][i];
        let (e14, e52) = (even(1) - even(4), even(5) - even(2));
        let c2 = 2 * (even(0) - even(3)) + e14 + e52;
        // √3 times it, or slightly more.
        let s2 = (e14 - e52).abs();
        may_reach |= octagon(c2, 2 * s2 - (s2 >> 2)) > threshold.even;
    }
    may_reach
}

/// Returns whether the bound exceeds the threshold at a pixel where no edge and no bar makes R
/// negative.
#[inline(always)]
fn even_is_not_edge(pixels: Pixels, centres: &[i16; BLOCK], threshold: Threshold) -> bool {
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
        // V is at least a sixth of the square of `differences`, so R < 0 where they exceed 0.6124
        // times 12α. For 12(c − m), R < 0 where it exceeds 0.7071 times 12α.
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

/// Returns block `b`. (A loop, as below.)
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

/// Returns the last block of each row, if the rows are long enough.
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

/// Returns the first `count` blocks of each row. (A loop, because closures passed to the standard
/// library would not be compiled for the target, and the lengths would not be known.)
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

/// Returns the state of a computed block.
#[inline(always)]
fn state(responses: &[f32; BLOCK], threshold: f32) -> Block {
    let mut any = false;
    for &response in responses {
        any |= response > threshold;
    }
    if any { Block::Promising } else { Block::Computed }
}

/// Returns an upper bound of the length of a vector, up to half a unit of rounding.
#[inline(always)]
fn octagon(x: i16, y: i16) -> i16 {
    let (x, y) = (x.abs(), y.abs());
    x.max(y) + (x.min(y) >> 1)
}

/// Returns R of a deltille corner; `at` returns the sample of a pair and a side.
#[inline(always)]
pub(super) fn odd_response(at: impl Fn(usize, usize) -> i16) -> f32 {
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

/// Returns R of a checkerboard corner; `at` returns the sample of a pair and a side.
#[inline(always)]
pub(super) fn even_response(at: impl Fn(usize, usize) -> i16, centre: i16) -> f32 {
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
    // 12(c − m); R subtracts 9(c − m)².
    let off = f32::from(12 * centre - sum);
    alpha - 0.5 * squares as f32 - off * off * (9.0 / 144.0)
}
