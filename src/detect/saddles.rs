//! Corners one by one: candidates of all pyramid levels, fitted, read and merged.

use rstar::RTree;

use super::polynomial::{FittedCorner, Polynomial};
use super::ring::{Candidate, candidates};
use super::sectors::{Sectors, contrast_around};
use super::tiling::kind;
use crate::raster::{Gray, Pyramid};
use crate::target::GridKind;

/// Radii of the fits, px. The middle one decides what is a corner; the reference detector's choice.
const FIT_RADII: [usize; 3] = [2, 3, 4];

/// Index of the usual fit.
const USUAL: usize = 1;

/// Iterations of the fit; the paper's.
const FIT_ITERATIONS: usize = 5;

/// Finer and coarser candidates of one corner converge to points closer than this, px.
const MERGE_PX: f64 = 1.5;

/// The weakest harmonic searched for, of 1023: a contrast of 3 grey levels in 8 bits, where
/// rounding itself begins to draw shapes.
const MIN_AMPLITUDE: f32 = 6.0;

/// Noise of the harmonic over that of a sample: the mean of twelve, times √2.
const HARMONIC_NOISE: f32 = 0.408;

/// Candidates must stand above the noise by this factor; at five, one pixel in a million passes.
const NOISE_FACTOR: f32 = 5.0;

/// A corner with N rays in the image: a monkey saddle, or a saddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saddle<const N: usize> {
    /// Position, px.
    pub position: [f64; 2],
    /// Its edges and brightness.
    pub sectors: Sectors<N>,
}

/// A blurred corner shows less than this part of its contrast on the smallest circle: half of it
/// would make it a corner at full resolution.
const MAX_BLURRED_CONTRAST: f64 = 0.5;

/// Distance between the starts of a search, px: the fit converges from that far.
const START_STEP_PX: f64 = 2.0;

/// Most rings of starts around an uncertain place.
const MAX_START_RINGS: i32 = 4;

/// A corner moves by less than this when the window grows by one, px: it looks the same at every
/// size. What is made up of two things at different distances does not. The paper's choice; corners
/// of photographs move by less than 0.1 px.
const STABLE_PX: f64 = 0.3;

/// Finds and describes saddles in a pyramid.
#[derive(Clone, Debug)]
pub struct SaddleFinder<const N: usize> {
    /// By rising radius.
    fits: [Polynomial; FIT_RADII.len()],
}

impl<const N: usize> SaddleFinder<N> {
    /// A finder; computes the pseudo-inverses of its fits once.
    pub fn new() -> Self {
        Self { fits: FIT_RADII.map(|radius| Polynomial::new(kind::<N>(), radius)) }
    }

    /// All saddles of an image, in reading order.
    pub fn find(&self, pyramid: &Pyramid) -> Vec<Saddle<N>> {
        let noise = HARMONIC_NOISE * sample_noise(&pyramid.levels()[0]);
        let mut saddles = Merged::<N>::default();
        for (n, level) in pyramid.levels().iter().enumerate() {
            let mut candidates = candidates::<N>(level, MIN_AMPLITUDE);
            drop_noise(&mut candidates, NOISE_FACTOR * noise);
            for candidate in candidates {
                let start = [candidate.x as f64, candidate.y as f64];
                let fit = &self.fits[USUAL];
                let Some(on_level) = fit.refine(level, start, FIT_ITERATIONS) else {
                    continue;
                };
                let coarse = Pyramid::to_level_0(n, on_level.position);
                if !saddles.is_free(coarse) {
                    continue;
                }
                let Some(sectors) = Sectors::read(level, on_level.position, &on_level.form) else {
                    continue;
                };
                let described = Saddle { position: coarse, sectors };
                // What a coarse level shows is looked for again at full resolution; a corner that
                // is too blurred for that stays as it was found.
                let saddle = match n {
                    0 if self.is_stable(level, coarse, USUAL) => Some(described),
                    0 => self.narrow(pyramid, start),
                    _ => self
                        .near(&pyramid.levels()[0], coarse, f64::from(1u32 << n))
                        .or_else(|| is_blurred(pyramid, &described).then_some(described)),
                };
                saddles.extend(saddle);
            }
        }
        let mut all = saddles.all;
        all.sort_by(|a, b| {
            let key = |s: &Saddle<N>| [s.position[1], s.position[0]];
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        all
    }

    /// The saddle of a checkerboard that a narrower fit reaches: squares seen at the rim of a
    /// fisheye lens are no wider than the usual window. (Six sectors do not fit into the smaller.)
    fn narrow(&self, pyramid: &Pyramid, start: [f64; 2]) -> Option<Saddle<N>> {
        match kind::<N>() {
            GridKind::Deltille => None,
            GridKind::Checker => self.at_size(pyramid, start, USUAL - 1),
        }
    }

    fn at_size(&self, pyramid: &Pyramid, start: [f64; 2], size: usize) -> Option<Saddle<N>> {
        let corner = self.fits[size].refine(&pyramid.levels()[0], start, FIT_ITERATIONS)?;
        self.describe(&pyramid.levels()[0], &corner, size)
    }

    /// What a fit at full resolution has reached, if it is a corner.
    fn describe(&self, image: &Gray<i16>, corner: &FittedCorner, size: usize) -> Option<Saddle<N>> {
        let sectors = Sectors::read(image, corner.position, &corner.form)?;
        let saddle = Saddle { position: corner.position, sectors };
        self.is_stable(image, corner.position, size).then_some(saddle)
    }

    /// Whether the next wider fit finds a corner in the same place.
    fn is_stable(&self, image: &Gray<i16>, [x, y]: [f64; 2], size: usize) -> bool {
        let wider = self.fits[size + 1].refine(image, [x, y], FIT_ITERATIONS);
        let moved = wider.map(|corner| (corner.position[0] - x).hypot(corner.position[1] - y));
        moved.is_some_and(|moved_px| moved_px < STABLE_PX)
    }

    /// The first saddle that the fit reaches from starts ever further from `place`, if it lies
    /// within `reach_px` of it.
    pub fn near(&self, image: &Gray<i16>, place: [f64; 2], reach_px: f64) -> Option<Saddle<N>> {
        let distance = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let rings = ((reach_px / START_STEP_PX).ceil() as i32).clamp(1, MAX_START_RINGS);
        let step = reach_px / f64::from(rings);
        let starts = (-rings..=rings).flat_map(|v| (-rings..=rings).map(move |u| (u, v)));
        let mut starts: Vec<(i32, i32)> =
            starts.filter(|&(u, v)| u * u + v * v <= rings * rings).collect();
        starts.sort_by_key(|&(u, v)| (u * u + v * v, v, u));
        let sizes: &[usize] = match kind::<N>() {
            GridKind::Deltille => &[USUAL],
            GridKind::Checker => &[USUAL, USUAL - 1],
        };
        // Many starts lead to the same place, which is looked at once with each fit.
        let mut refused: Vec<([f64; 2], usize)> = Vec::new();
        starts.into_iter().find_map(|(u, v)| {
            let start = [place[0] + f64::from(u) * step, place[1] + f64::from(v) * step];
            let saddle = sizes.iter().find_map(|&size| {
                let corner = self.fits[size].refine(image, start, FIT_ITERATIONS)?;
                let position = corner.position;
                let same = |&(other, with): &([f64; 2], usize)| {
                    with == size && distance(position, other) < STABLE_PX
                };
                if refused.iter().any(same) {
                    return None;
                }
                let saddle = self.describe(image, &corner, size);
                if saddle.is_none() {
                    refused.push((position, size));
                }
                saddle
            })?;
            (distance(saddle.position, place) <= reach_px).then_some(saddle)
        })
    }
}

/// Drops candidates whose harmonic is weaker than `min_amplitude`, or than a quarter of that of the
/// ninth strongest where this is less: an image that is all board has no plain part to tell its noise
/// from, but then it has at least as many corners as a grid.
fn drop_noise(candidates: &mut Vec<Candidate>, min_amplitude: f32) {
    const STRONGEST: usize = 9;
    const PART: f32 = 0.25;
    if candidates.len() < STRONGEST {
        return;
    }
    let mut responses: Vec<f32> = candidates.iter().map(|c| c.response).collect();
    let (_, &mut ninth, _) = responses.select_nth_unstable_by(STRONGEST - 1, |a, b| b.total_cmp(a));
    let threshold = (4.5 * min_amplitude * min_amplitude).min(PART * PART * ninth);
    candidates.retain(|candidate| candidate.response > threshold);
}

/// Whether full resolution shows next to nothing where a coarse level shows a corner. What is sharp
/// there, and no corner, is none on a coarse level either: a thin line beside an edge, say.
fn is_blurred<const N: usize>(pyramid: &Pyramid, coarse: &Saddle<N>) -> bool {
    let fine = contrast_around::<N>(&pyramid.levels()[0], coarse.position);
    fine.is_some_and(|amplitude| amplitude < MAX_BLURRED_CONTRAST * coarse.sectors.amplitude)
}

/// Saddles with an index of their places, so that a corner found twice is kept once.
struct Merged<const N: usize> {
    all: Vec<Saddle<N>>,
    places: RTree<[f64; 2]>,
}

impl<const N: usize> Default for Merged<N> {
    fn default() -> Self {
        Self { all: Vec::new(), places: RTree::new() }
    }
}

impl<const N: usize> Merged<N> {
    fn is_free(&self, position: [f64; 2]) -> bool {
        self.places.locate_within_distance(position, MERGE_PX * MERGE_PX).next().is_none()
    }

    fn extend(&mut self, saddle: Option<Saddle<N>>) {
        if let Some(saddle) = saddle.filter(|saddle| self.is_free(saddle.position)) {
            self.places.insert(saddle.position);
            self.all.push(saddle);
        }
    }
}

/// Standard deviation of what a sample of the ring shows beside a corner, of 1023: noise, and grain
/// smoothed by a camera's demosaicing or by enlarging, which pixels next to each other share.
///
/// From |Laplacian| over a sparse raster, with the mask of Immerkær, "Fast noise variance
/// estimation" (1996), which vanishes on planes and weakly curved surfaces, drawn out so that its
/// nine samples are as far apart as those of the ring.
fn sample_noise(image: &Gray<i16>) -> f32 {
    /// One pixel in 64 is plenty for a quantile.
    const STRIDE: usize = 8;
    /// Distance of the mask's samples: the ring's radius.
    const STEP: usize = 4;
    /// The part of the image that is taken to be plain, and the quantile of |x| there for Gaussian
    /// noise: boards and houses leave little without an edge.
    const QUIET: f64 = 0.1;
    const QUIET_TO_SIGMA: f32 = 1.0 / 0.1257;
    /// The mask's gain: √(1+4+1+4+16+4+1+4+1).
    const GAIN: f32 = 6.0;
    let (width, height) = (image.width(), image.height());
    let mut magnitudes = Vec::with_capacity((width / STRIDE + 1) * (height / STRIDE + 1));
    for y in (STEP..height.saturating_sub(STEP)).step_by(STRIDE) {
        let rows = [image.row(y - STEP), image.row(y), image.row(y + STEP)];
        for x in (STEP..width.saturating_sub(STEP)).step_by(STRIDE) {
            let sum = |row: &[i16]| {
                i32::from(row[x - STEP]) - 2 * i32::from(row[x]) + i32::from(row[x + STEP])
            };
            magnitudes.push((sum(rows[0]) - 2 * sum(rows[1]) + sum(rows[2])).abs());
        }
    }
    if magnitudes.is_empty() {
        return 0.0;
    }
    let quiet = (QUIET * magnitudes.len() as f64) as usize;
    let (_, &mut magnitude, _) = magnitudes.select_nth_unstable(quiet);
    // Half a step of the quantisation more than nothing.
    (magnitude as f32 + 0.5) * QUIET_TO_SIGMA / GAIN
}
