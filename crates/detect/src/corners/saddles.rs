//! Single corners: candidates of all pyramid levels, fitted, read and merged.

use glam::DVec2;

use super::buckets::Buckets;
use super::candidates::{Candidate, candidates, maxima_near};
use super::polynomial::{FittedCorner, Polynomial};
use super::ring::PER_AMPLITUDE;
use super::sectors::{Sectors, contrast_around};
use crate::tiling::kind;
use deltille_core::lattice::GridKind;
use deltille_core::raster::{Gray, Pyramid};

/// Radii of the fits, px. The middle one decides whether there is a corner, as in the reference detector.
const FIT_RADII: [usize; 3] = [2, 3, 4];

/// Index of the usual fit.
const USUAL: usize = 1;

/// Merging distance, px of the level. Fine and coarse candidates of one corner converge to points closer than this.
const MERGE_PX: f64 = 1.5;

/// Weakest harmonic that is searched for, on a scale of 0 to 1023. It is a contrast of 3 grey
/// levels in 8 bits, at which quantisation begins to produce shapes.
const MIN_AMPLITUDE: f32 = 6.0;

/// Noise of the harmonic relative to that of a sample: the mean of twelve, times √2.
const HARMONIC_NOISE: f32 = 0.408;

/// Factor by which candidates must exceed the noise. At five, one pixel in a million passes.
const NOISE_FACTOR: f32 = 5.0;

/// Minimum image area per corner, px²: that of tiles with edges of 7 px, the smallest that can be
/// distinguished from waves of brightness. Noise alone produces twice as many candidates as this
/// permits.
const MIN_TILE_PX2: usize = 40;

/// Maximum number of corners in an image: five times as many as are refined.
const MAX_CORNERS: usize = 100_000;

/// Maximum number of candidates per level, 2.5 times the number of corners. In images of leaves or grass, nine of ten
/// candidates are not corners.
const MAX_CANDIDATES: usize = 250_000;

/// A corner with N rays in the image: a monkey saddle, or a saddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Saddle<const N: usize> {
    /// Position, px.
    pub position: DVec2,
    /// Its edges and brightness.
    pub sectors: Sectors<N>,
    /// Level of the pyramid on which it was read: the finest that shows it sharply.
    pub level: usize,
}

/// Fraction of contrast below which a corner is blurred on a level, relative to the next coarser level. Both are
/// measured on the smallest circle. A corner below it has more than 2 px of blur. The coarser level then shows its
/// edges better, and averages the grain of an enlarged image.
const MAX_BLURRED_CONTRAST: f64 = 0.5;

/// Maximum deviation of the centre of a blurred corner from the level between dark and bright, relative to the contrast
/// on one of the next [`LEVELS_OF_CONTRAST`]. Ink spread darkens the centre, more so where the
/// board appears larger.
const MAX_BLURRED_SHIFT: f64 = 0.3;

/// Number of coarser levels whose contrast counts: all levels of an image whose shorter side is below 2400 px.
const LEVELS_OF_CONTRAST: usize = 3;

/// Maximum displacement of a corner when the window grows by one, px: a corner looks the same at every scale. A
/// superposition of two objects at different distances does not. Value of the paper; corners of photographs move by
/// less than 0.1 px.
const STABLE_PX: f64 = 0.3;

/// Finds and describes saddles in a pyramid.
#[derive(Clone, Debug)]
pub(crate) struct SaddleFinder<const N: usize> {
    /// Fits by increasing radius.
    fits: [Polynomial; FIT_RADII.len()],
}

impl<const N: usize> SaddleFinder<N> {
    /// Creates a finder. Computes the pseudo-inverses of its fits once.
    pub(crate) fn new() -> Self {
        Self { fits: FIT_RADII.map(|radius| Polynomial::new(kind::<N>(), radius)) }
    }

    /// Returns all saddles of an image, in raster order.
    pub(crate) fn find(&self, pyramid: &Pyramid) -> Vec<Saddle<N>> {
        self.find_in(pyramid, 0.0)
    }

    /// Returns all saddles of an image whose samples have at least the noise `sigma`, in raster order.
    pub(crate) fn find_in(&self, pyramid: &Pyramid, sigma: f32) -> Vec<Saddle<N>> {
        let mut noise = Noise::at_least(sigma);
        let mut saddles = Merged::of(pyramid);
        for n in 0..pyramid.levels().len() {
            for candidate in noise.candidates::<N>(&pyramid.levels()[n]) {
                self.add(pyramid, n, candidate, &mut saddles);
            }
        }
        saddles.sorted()
    }

    /// Adds the saddle that the fit reaches from a candidate on level `n`, if there is one that is not known yet.
    fn add(&self, pyramid: &Pyramid, n: usize, candidate: Candidate, saddles: &mut Merged<N>) {
        let level = &pyramid.levels()[n];
        let start = DVec2::new(candidate.x as f64, candidate.y as f64);
        // A candidate on a corner of a finer level is that corner.
        if n > 0 && saddles.is_known(Pyramid::to_level_0(n, start), n) {
            return;
        }
        let Some(on_level) = self.fits[USUAL].find(level.into(), start) else {
            return;
        };
        let place = Pyramid::to_level_0(n, on_level.position);
        if !saddles.is_free(place, n) {
            return;
        }
        let is_stable = self.is_stable(level, on_level.position, USUAL);
        if n == 0 && !is_stable && kind::<N>() == GridKind::Deltille {
            // No narrower fit is tried.
            return;
        }
        let Some(sectors) = Sectors::read(level, on_level.position, &on_level.form) else {
            return;
        };
        let described = Saddle { position: place, sectors, level: n };
        let saddle = match n {
            0 if is_stable => Some(described),
            0 => self.narrow(pyramid, start),
            _ => self.sharpest(pyramid, described, is_stable),
        };
        if let Some(saddle) = saddle {
            saddles.add(saddle, is_blurred::<N>(pyramid, saddle.level, saddle.position));
        }
    }

    /// Follows a corner from a coarse level to finer ones as long as these show it sharply. If a
    /// level shows the position sharply but has no corner there, the corner on the coarser level is
    /// false, too. An example is a thin line next to an edge.
    fn sharpest(&self, pyramid: &Pyramid, coarse: Saddle<N>, is_stable: bool) -> Option<Saddle<N>> {
        let mut found = coarse;
        while found.level > 0 {
            let finer = found.level - 1;
            if is_blurred::<N>(pyramid, finer, found.position) {
                return (found.level < coarse.level || is_stable).then_some(found);
            }
            let reach_px = f64::from(1u32 << found.level);
            found = self.near(pyramid, finer, found.position, reach_px, Some)?;
        }
        Some(found)
    }

    /// Returns the saddle of a checkerboard that a narrower fit reaches. Squares near the edge of a fisheye image are
    /// no wider than the usual window. (Six sectors do not fit into the smaller one.)
    fn narrow(&self, pyramid: &Pyramid, start: DVec2) -> Option<Saddle<N>> {
        match kind::<N>() {
            GridKind::Deltille => None,
            GridKind::Checker => self.at_size(pyramid, start, USUAL - 1),
        }
    }

    fn at_size(&self, pyramid: &Pyramid, start: DVec2, size: usize) -> Option<Saddle<N>> {
        let corner = self.fits[size].find((&pyramid.levels()[0]).into(), start)?;
        self.describe(&pyramid.levels()[0], 0, &corner, size)
    }

    /// Describes the result of a fit in the image of a level, if it is a corner; px of that image.
    fn describe(
        &self,
        image: &Gray<i16>,
        level: usize,
        corner: &FittedCorner,
        size: usize,
    ) -> Option<Saddle<N>> {
        let sectors = Sectors::read(image, corner.position, &corner.form)?;
        let saddle = Saddle { position: corner.position, sectors, level };
        self.is_stable(image, corner.position, size).then_some(saddle)
    }

    /// Returns whether the next wider fit stays at the same position.
    fn is_stable(&self, image: &Gray<i16>, position: DVec2, size: usize) -> bool {
        let wider = &self.fits[size + 1];
        let moved = match kind::<N>() {
            // One step is sufficient.
            GridKind::Deltille => wider.step(image.into(), position),
            // A step of the quadric overshoots if the squares are no wider than its window.
            GridKind::Checker => {
                wider.find(image.into(), position).map(|corner| corner.position - position)
            }
        };
        moved.is_some_and(|moved| moved.length() < STABLE_PX)
    }

    /// Searches like [`Self::near_in`] on a level of a pyramid; positions and reach in px of level 0.
    pub(crate) fn near<S>(
        &self,
        pyramid: &Pyramid,
        level: usize,
        place: DVec2,
        reach_px: f64,
        accept: impl Fn(Saddle<N>) -> Option<S>,
    ) -> Option<S> {
        let on_level = Pyramid::from_level_0(level, place);
        let reach_px = reach_px / f64::from(1u32 << level);
        self.near_in(&pyramid.levels()[level], on_level, reach_px, |found| {
            let position = Pyramid::to_level_0(level, found.position);
            accept(Saddle { position, level, ..found })
        })
    }

    /// Returns the first accepted saddle within `reach_px` of `place`. The fit starts from points at increasing
    /// distances. `accept` converts a saddle to the result, or rejects it.
    pub(crate) fn near_in<S>(
        &self,
        image: &Gray<i16>,
        place: DVec2,
        reach_px: f64,
        accept: impl Fn(Saddle<N>) -> Option<S>,
    ) -> Option<S> {
        // Starts at the position itself and at every position of a possible corner.
        let pixel = place.to_array().map(|c| c.max(0.0).round() as usize);
        let maxima = maxima_near::<N>(image, pixel, reach_px.ceil() as usize);
        let mut starts =
            std::iter::once(place).chain(maxima.into_iter().map(|p| p.map(|c| c as f64).into()));
        let sizes: &[usize] = match kind::<N>() {
            GridKind::Deltille => &[USUAL],
            GridKind::Checker => &[USUAL, USUAL - 1],
        };
        // Many starts lead to the same position, which is described only once per fit.
        let mut refused: Vec<(DVec2, usize)> = Vec::new();
        starts.find_map(|start| {
            sizes.iter().find_map(|&size| {
                let corner = self.fits[size].find(image.into(), start)?;
                let position = corner.position;
                let same = |&(other, with): &(DVec2, usize)| {
                    with == size && position.distance(other) < STABLE_PX
                };
                if position.distance(place) > reach_px || refused.iter().any(same) {
                    return None;
                }
                let found = self.describe(image, 0, &corner, size).and_then(&accept);
                if found.is_none() {
                    refused.push((position, size));
                }
                found
            })
        })
    }
}

/// Noise of the harmonic on the levels of an image, finest first.
struct Noise {
    /// Standard deviation.
    sigma: f32,
    /// Whether all levels so far show only noise.
    is_all: bool,
}

impl Noise {
    /// Returns the noise of an image whose samples have at least the noise `sigma`.
    fn at_least(sigma: f32) -> Self {
        Self { sigma: HARMONIC_NOISE * sigma, is_all: true }
    }

    /// Returns the candidates on the next level.
    fn candidates<const N: usize>(&mut self, level: &Gray<i16>) -> Vec<Candidate> {
        let sampled = sample_noise(level);
        // Averaging does not remove grain that neighbouring pixels share.
        self.sigma = self.sigma.max(HARMONIC_NOISE * sampled.sigma);
        self.is_all &= sampled.is_all;
        let least = NOISE_FACTOR * self.sigma;
        if self.is_all && least > MIN_AMPLITUDE {
            candidates::<N>(level, least)
        } else {
            candidates_above_noise::<N>(level, least)
        }
    }
}

/// Returns the candidates on a level whose harmonic reaches `noise`, or a quarter of that of the ninth strongest if
/// this is less. If a board fills the image, no plain part is left to measure the noise, but then there are at least as
/// many corners as in a grid. (In an image of noise alone, the noise can be measured.)
fn candidates_above_noise<const N: usize>(level: &Gray<i16>, noise: f32) -> Vec<Candidate> {
    /// Number of corners in a grid of 3 × 3.
    const STRONGEST: usize = 9;
    /// Harmonic of the weakest corners of a grid, relative to the ninth strongest. On boards that fill the image under
    /// uneven light, values from 0 to 0.25 lose none of 32 boards; 0.5 loses three, and 1 loses
    /// seven.
    const PART: f32 = 0.25;
    let ninth = |candidates: &[Candidate]| {
        let mut responses: Vec<f32> = candidates.iter().map(|c| c.response).collect();
        (responses.len() >= STRONGEST)
            .then(|| *responses.select_nth_unstable_by(STRONGEST - 1, |a, b| b.total_cmp(a)).1)
    };
    // Nearly always, nine candidates clearly exceed the noise, so weak ones are not needed.
    if noise > MIN_AMPLITUDE {
        let found = candidates::<N>(level, noise);
        if ninth(&found).is_some_and(|ninth| PART * PART * ninth >= PER_AMPLITUDE * noise * noise) {
            return found;
        }
    }
    let mut found = candidates::<N>(level, MIN_AMPLITUDE);
    if let Some(ninth) = ninth(&found) {
        let threshold = (PER_AMPLITUDE * noise * noise).min(PART * PART * ninth);
        found.retain(|candidate| candidate.response > threshold);
    }
    strongest(&mut found, (level.pixels().len() / MIN_TILE_PX2).min(MAX_CANDIDATES));
    found
}

/// Returns whether an image has more corners than any board could show in it.
pub(crate) fn too_many(pyramid: &Pyramid, corners: usize) -> bool {
    corners > (pyramid.levels()[0].pixels().len() / MIN_TILE_PX2).min(MAX_CORNERS)
}

/// Keeps the `count` strongest candidates, the first of equals.
fn strongest(candidates: &mut Vec<Candidate>, count: usize) {
    if candidates.len() <= count || count == 0 {
        return;
    }
    let mut responses: Vec<f32> = candidates.iter().map(|c| c.response).collect();
    let least = *responses.select_nth_unstable_by(count - 1, |a, b| b.total_cmp(a)).1;
    candidates.retain(|candidate| candidate.response >= least);
    let mut equals = count - candidates.iter().filter(|c| c.response > least).count();
    candidates.retain(|candidate| {
        let is_kept = candidate.response > least || equals > 0;
        equals -= usize::from(is_kept && candidate.response == least);
        is_kept
    });
}

/// Returns whether a level shows a corner blurred; false on the coarsest level and at the border. Blur keeps the centre
/// at the level between dark and bright. A gap between dots looks like a corner if blur closes it,
/// but its brightness differs from that level.
fn is_blurred<const N: usize>(pyramid: &Pyramid, level: usize, position: DVec2) -> bool {
    let contrast = |n: usize| {
        let place = Pyramid::from_level_0(n, position);
        contrast_around::<N>(pyramid.levels().get(n)?, place)
    };
    contrast(level).zip(contrast(level + 1)).is_some_and(|(fine, coarse)| {
        let further = (level + 2..=level + LEVELS_OF_CONTRAST).map_while(contrast);
        let whole = further.map(|(_, contrast)| contrast).fold(coarse.1, f64::max);
        fine.1 < MAX_BLURRED_CONTRAST * coarse.1
            && (fine.0 - coarse.0).abs() < MAX_BLURRED_SHIFT * whole
    })
}

/// Saddles with an index of their positions, so that duplicates are merged.
struct Merged<const N: usize> {
    /// Saddles; those that coarser levels show better are removed.
    all: Vec<Option<Saddle<N>>>,
    /// Whether the level of a saddle shows it blurred.
    blurred: Vec<bool>,
    places: Buckets,
}

/// Returns the distance within which saddles of a level count as the same, px of level 0.
pub(crate) fn merge_px(level: usize) -> f64 {
    MERGE_PX * f64::from(1u32 << level)
}

impl<const N: usize> Merged<N> {
    /// Creates an empty set for an image.
    fn of(pyramid: &Pyramid) -> Self {
        let finest = &pyramid.levels()[0];
        let places = Buckets::new(finest.width(), finest.height());
        Self { all: Vec::new(), blurred: Vec::new(), places }
    }

    /// Returns the saddles within the merging distance of a level, px.
    fn within(&self, position: DVec2, level: usize) -> impl Iterator<Item = (usize, Saddle<N>)> {
        let near = self.places.within(position, merge_px(level));
        near.filter_map(|(i, _)| Some((i, self.all[i]?)))
    }

    /// Returns whether a corner at least as good as that of `level` is known within the merging distance.
    fn is_known(&self, position: DVec2, level: usize) -> bool {
        self.within(position, level).any(|(i, other)| !(self.blurred[i] && other.level < level))
    }

    /// Returns whether no corner as good as that of `level` is known there.
    fn is_free(&self, position: DVec2, level: usize) -> bool {
        self.within(position, level).all(|(i, other)| {
            self.blurred[i] && other.level < level
                || other.position.distance(position) >= merge_px(other.level)
        })
    }

    fn add(&mut self, saddle: Saddle<N>, blurred: bool) {
        let same: Vec<(usize, Saddle<N>)> = self.within(saddle.position, saddle.level).collect();
        if !same.iter().all(|(i, other)| self.blurred[*i] && other.level < saddle.level) {
            return;
        }
        same.into_iter().for_each(|(i, _)| self.all[i] = None);
        self.places.insert(saddle.position);
        self.all.push(Some(saddle));
        self.blurred.push(blurred);
    }

    /// Returns all saddles in raster order.
    fn sorted(self) -> Vec<Saddle<N>> {
        let mut all: Vec<Saddle<N>> = self.all.into_iter().flatten().collect();
        all.sort_by(|a, b| {
            let key = |s: &Saddle<N>| [s.position.y, s.position.x];
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        all
    }
}

/// Noise of the samples of a ring away from corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleNoise {
    /// Standard deviation, on a scale of 0 to 1023.
    pub sigma: f32,
    /// Whether the image contains only noise. Then the strength of the noise is known, however
    /// large it is.
    pub is_all: bool,
}

/// Measures the noise of a sample of the ring: noise, and grain that neighbouring pixels share because demosaicing or
/// enlargement smoothed it.
///
/// The measure is |Laplacian| over a sparse raster, with the mask of Immerkær, "Fast noise variance estimation" (1996).
/// The mask vanishes on planes and weakly curved surfaces. It is enlarged so that its nine samples are as far apart as
/// those of the ring.
pub(crate) fn sample_noise(image: &Gray<i16>) -> SampleNoise {
    /// Number of samples that suffices to determine the quiet quantile to 3 %.
    const PLENTY: usize = 8000;
    /// Minimum distance between samples, px: the nine samples of the mask are 8 px wide.
    const MIN_STRIDE: usize = 8;
    /// Distance of the mask's samples: the radius of the ring.
    const STEP: usize = 4;
    /// Fraction of the image that is assumed to be plain. Images of boards or houses have few areas
    /// without edges.
    const QUIET: f64 = 0.1;
    /// σ over that quantile of |x| in Gaussian noise.
    const QUIET_TO_SIGMA: f32 = 1.0 / 0.1257;
    /// Number of samples below which quantiles are uncertain by more than a tenth.
    const MANY: f64 = 4000.0;
    /// The quantile that edges change first.
    const LOUD: f64 = 0.99;
    /// Its ratio to the median of |x| in Gaussian noise.
    const LOUD_TO_MIDDLE: f32 = 3.819;
    /// Relative standard deviation of that ratio, times the square root of the number of samples.
    const LOUD_DEVIATION: f64 = 1.7;
    /// Ratio of the median to the quiet quantile.
    const MIDDLE_TO_QUIET: f32 = 5.367;
    /// Relative standard deviation of that ratio, in the same unit.
    const QUIET_DEVIATION: f64 = 3.0;
    /// Number of standard deviations that ratios of Gaussian noise exceed once in four hundred.
    const SURE: f64 = 3.0;
    /// Gain of the mask: √(1+4+1+4+16+4+1+4+1).
    const GAIN: f32 = 6.0;
    let (width, height) = (image.width(), image.height());
    let stride = (width * height / PLENTY).isqrt().max(MIN_STRIDE);
    let mut magnitudes = Vec::with_capacity((width / stride + 1) * (height / stride + 1));
    for y in (STEP..height.saturating_sub(STEP)).step_by(stride) {
        let rows = [image.row(y - STEP), image.row(y), image.row(y + STEP)];
        for x in (STEP..width.saturating_sub(STEP)).step_by(stride) {
            let sum = |row: &[i16]| {
                i32::from(row[x - STEP]) - 2 * i32::from(row[x]) + i32::from(row[x + STEP])
            };
            magnitudes.push((sum(rows[0]) - 2 * sum(rows[1]) + sum(rows[2])).abs());
        }
    }
    if magnitudes.is_empty() {
        return SampleNoise { sigma: 0.0, is_all: false };
    }
    let count = magnitudes.len() as f64;
    let mut quantile = |part: f64| {
        let (_, &mut magnitude, _) = magnitudes.select_nth_unstable((part * count) as usize);
        // Half a quantisation step above zero.
        magnitude as f32 + 0.5
    };
    let [quiet, middle, loud] = [QUIET, 0.5, LOUD].map(&mut quantile);
    // If a board covers a twentieth of the image, its edges increase the loud quantile by a tenth.
    let is_as = |ratio: f32, usual: f32, deviations: f64| {
        f64::from(ratio / usual - 1.0).abs() <= deviations / count.sqrt()
    };
    let is_all = count >= MANY
        && is_as(middle / quiet, MIDDLE_TO_QUIET, SURE * QUIET_DEVIATION)
        && is_as(loud / middle, LOUD_TO_MIDDLE, SURE * LOUD_DEVIATION);
    SampleNoise { sigma: quiet * QUIET_TO_SIGMA / GAIN, is_all }
}
