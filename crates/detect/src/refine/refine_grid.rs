//! Subpixel refinement of all corners of a grid, each from all pixels that show only this corner.
//!
//! The blur determines how far neighbouring edges reach into a window. It is estimated from a few corners, on coarser
//! levels of the pyramid if the finest shows too little of it. The curvature of edges by lens distortion follows from
//! the corners, which are then fitted again. An occluder may still lie next to a corner. The
//! residual of the model is then larger than elsewhere in the grid, and smaller windows are tried.
//! Where no window shows a corner cleanly, its edges determine its position. A corner at the end of the visible part of
//! the board is dropped if they are not all visible, because the occluder biases its position.

use std::collections::BTreeMap;

use glam::DVec2;
use rayon::prelude::*;

use super::clearance::{Prediction, Surroundings, TagAreas, surroundings, surroundings_of};
use super::displaced_rows::widen;
use super::joint_fit::Sample;
use super::model::fitter::{CornerFitter, MAX_WAY_PX};
use super::model::window::Patch;
use super::optics::Optics;
use super::refiner::{
    MIN_MODEL_RADIUS, MIN_PIXELS, ModelFit, Refined, Refinement, Refiner, Room, Sharpness,
    USUAL_MIN_PIXELS,
};
use super::shared_optics::{REACH_PX, REACH_SIGMAS, SAMPLES};
use crate::grid::gaps::edge_crossing::EdgeCrossing;
use deltille_core::detection::{Grid, GridCorner};
use deltille_core::lattice::Vertex;
use deltille_core::raster::{Gray, ImageView, Pyramid};
use deltille_core::statistics::median;

/// Number of corners from which the blur is estimated, those with the most room.
const BLUR_CORNERS: usize = 15;

/// Number of candidate corners, spread over the grid, for each of these corners. Of four
/// candidates, some are clear of tags and of the border.
const OVERSAMPLING: usize = 4;

/// Blur that is assumed before it is estimated, px: that of a good photograph.
const TYPICAL_BLUR_PX: f64 = 1.0;

/// Largest blur as a fraction of the radius of the largest window. A larger one is estimated again on a coarser level,
/// because the window shows hardly more than the centre of the edges.
const MAX_BLUR: f64 = 0.5;

/// Maximum residual, relative to the median of the grid. A larger one shows an object other than the corner; the noise
/// of a 7×7 window varies by a tenth.
const MAX_RESIDUAL_RATIO: f64 = 3.0;

/// Residual below which a corner is always accepted, as a fraction of the amplitude. In a clean
/// image the median is close to zero.
const MIN_RESIDUAL: f64 = 0.05;

/// Residual, relative to the median, above which residuals contain more than noise. The noise of a
/// single window scatters by a tenth.
const UNUSUAL: f64 = 1.3;

/// Maximum correlation of neighbouring residuals that is distinguished. Above it, they form one shape over the window.
const MAX_CORRELATED: f64 = 0.9;

/// Blur at which sampling once per pixel loses nothing, px: the spectrum falls to 1/10 000 at the highest frequency.
const SHARP_PX: f64 = 1.4;

/// Minimum number of corners for a task on a separate thread.
const PART: usize = 128;

/// Maximum ratio of the blur of a corner to that of its neighbours. A larger one indicates the edge
/// of an occluder; near the edge of fisheye images, blur doubles from one corner to the next.
const MAX_BLUR_RATIO: f64 = 3.0;

/// Maximum standard deviation of a position, px, including systematic residuals. Positions above it
/// are dropped, because the grid predicts them equally well.
const WORST_SIGMA_PX: f64 = 3.0;

/// Distance of a corner from its prediction, in standard deviations in addition to the range of the model, from which it
/// was mistaken.
const MISTAKEN_SIGMAS: f64 = 3.0;

/// Size ratio of successive windows.
const NEXT_WINDOW: f64 = 0.7;

/// A pyramid level of an image, or the image itself in place of the finest one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level<'a> {
    /// Image of this level.
    pub image: ImageView<'a>,
    /// Number of finer levels.
    pub enlarged: usize,
    /// The coarser levels, finest first.
    pub coarser: &'a [Gray<i16>],
}

/// Medians over the corners of a grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// Standard deviation of the residuals, as a fraction of full scale.
    pub noise: f64,
}

impl Refiner {
    /// Returns the blur of each grid, px, if the model can measure it.
    pub(crate) fn blurs(
        &self,
        fitter: &mut CornerFitter,
        level: Level,
        grids: &[Grid],
        tags: &TagAreas,
    ) -> Vec<Option<f64>> {
        grids.iter().map(|grid| self.blur_of_grid(fitter, level, grid, tags)).collect()
    }

    /// Returns the optics that the grids of an image share, given their blurs, from one level of the pyramid.
    pub(crate) fn optics(
        &self,
        fitter: &mut CornerFitter,
        Level { image, enlarged, .. }: Level,
        grids: &[Grid],
        blurs: &[Option<f64>],
        tags: &TagAreas,
    ) -> Optics {
        let mut known = self.known.clone();
        if self.method() == Refinement::Polynomial {
            return known;
        }
        if enlarged > 0 {
            // The blur of an enlarged image is not Gaussian, which an ink spread would explain.
            known = known.with_ink_as_known();
        }
        let all: usize = grids.iter().map(|grid| grid.corners.len()).sum();
        let every = all.div_ceil(2 * OVERSAMPLING * SAMPLES).max(1);
        let mut places = Vec::new();
        for (grid, blur) in grids.iter().zip(blurs) {
            let Some(blur_px) = blur.filter(|px| *px <= MAX_BLUR * self.largest_radius()) else {
                continue;
            };
            let sampled = (0..grid.corners.len()).step_by(every);
            for (i, around) in sampled.clone().zip(surroundings_of(grid, tags, 1.0, sampled)) {
                let margin = Sharpness { blur_px, optics: &self.known }.margin();
                let (order, clear_px) = (places.len(), around.clear_square_px(margin));
                places.push((order, clear_px, blur_px, grid.corners[i], around));
            }
        }
        places.sort_by(|a, b| b.1.total_cmp(&a.1));
        // Those with the most room lie where the board is nearest, and the light may differ elsewhere.
        let is_roomy = |clear_px: f64| clear_px >= MIN_MODEL_RADIUS as f64;
        let roomy = places.partition_point(|(_, clear_px, ..)| is_roomy(*clear_px));
        places.truncate(SAMPLES.max(roomy / 2));
        let sharpness = |blur_px: f64| Sharpness { blur_px, optics: &self.known };
        places.retain(|(_, clear_px, blur_px, corner, around)| {
            // The clear area may have another shape than a square.
            let room = self.near(around, sharpness(*blur_px));
            let count = || self.window(image, corner.position(), room).count();
            is_roomy(*clear_px) || count() >= USUAL_MIN_PIXELS
        });
        places.sort_by_key(|(order, ..)| *order);
        let count = places.len();
        let taken = (0..count.min(SAMPLES)).map(|i| &places[i * count / SAMPLES.min(count)]);
        let samples = taken.filter_map(|(_, _, blur_px, corner, around)| {
            let room = self.near(around, sharpness(*blur_px));
            let place = corner.position();
            let fit = self.model(fitter, image, place, room, None)?;
            let window = self.window(image, place, room).into_owned();
            let patch = Patch { window, centre: place.round() };
            Some(Sample { patch, corner: fit.corner, residual: fit.residual })
        });
        let samples = samples.collect();
        self.joint_optics(fitter, image, samples, &known)
    }

    /// Refines the corners of a grid in place, given its blur in px, and drops corrupted corners. Returns medians of the
    /// others.
    pub(crate) fn refine_grid(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        grid: &mut Grid,
        tags: &TagAreas,
        optics: &Optics,
        blur_px: Option<f64>,
    ) -> Option<Seen> {
        let sharpness = Sharpness { blur_px: blur_px.unwrap_or(TYPICAL_BLUR_PX), optics };
        let mut around = surroundings(grid, tags, 1.0);
        let mut refined = self.refine_each(image, grid, &around, sharpness);
        let mistaken = self.put_back(grid, &refined);
        if refined.iter().any(|(_, fit)| fit.is_none()) {
            around = surroundings(grid, tags, 1.0);
            refined = self.refine_each(image, grid, &around, sharpness);
        }
        let residuals: Vec<f64> =
            refined.iter().filter_map(|(_, fit)| Some((*fit)?.residual)).collect();
        let judged = is_judge(&refined);
        // The shared optics reduce the residuals of most corners, but not of all.
        let usual = median(residuals).unwrap_or(0.0).max(optics.plain_residual);
        let limit = (MAX_RESIDUAL_RATIO * usual).max(MIN_RESIDUAL);
        let (mut kept, mut fits) = (Vec::new(), Vec::new());
        for (i, (corner, (refined, fit))) in grid.corners.iter().zip(refined).enumerate() {
            let room = self.whole(&around[i], sharpness);
            let clean = fit.is_some_and(|fit| fit.residual <= limit);
            let modelled =
                || self.method() == Refinement::Model && self.has_room(image, corner, room);
            let (refined, fit) = if mistaken[i] && fit.is_none() {
                (None, None)
            } else if clean || !judged || !modelled() {
                (Some(refined), fit.filter(|_| clean))
            } else {
                // If the model finds nothing, for example at the edge of an occluder, the position
                // is unknown.
                let smaller = self.clean_fit(fitter, image, corner, room, limit);
                let found = smaller.or(fit.filter(|_| around[i].is_inner));
                (found.map(Refined::from), found)
            };
            let by_edges = || met_by_edges(image, corner, &around[i]);
            let refined = refined.map(|Refined { position: DVec2 { x, y }, cov, .. }| GridCorner {
                x,
                y,
                cov,
                ..*corner
            });
            if let Some(corner) = refined.or_else(by_edges) {
                kept.push(corner);
                fits.push(fit);
            }
        }
        grid.corners = kept;
        self.follow_bends(image, grid, tags, &fits, limit, sharpness)
    }

    /// Fits the corners again with the curvature of the edges, which follows from their positions. Fits with a residual
    /// above `limit` do not count. Returns medians of the fits.
    fn follow_bends(
        &self,
        image: ImageView,
        grid: &mut Grid,
        tags: &TagAreas,
        fits: &[Option<ModelFit>],
        limit: f64,
        sharpness: Sharpness,
    ) -> Option<Seen> {
        let again = |around: &[Surroundings], fits: &[Option<ModelFit>]| {
            each(fits.len(), |fitter, i| {
                let fit = fits[i].as_ref()?;
                let room = self.whole(&around[i], sharpness);
                let bent = self.model(fitter, image, fit.position(), room, Some(fit));
                bent.filter(|fit| fit.residual <= limit).or(Some(*fit))
            })
        };
        let mut around = surroundings(grid, tags, 1.0);
        let mut fits = again(&around, fits);
        let may_show_borders = |around: &Surroundings| {
            let clear_px = around.clear_square_px(sharpness.margin());
            !around.borders.is_empty() && clear_px < MIN_MODEL_RADIUS as f64
        };
        if around.iter().any(may_show_borders) {
            // The corners determine where the borders of tags are.
            for (corner, fit) in grid.corners.iter_mut().zip(&fits) {
                corner.move_to(fit.map_or(corner.position(), |fit| fit.position()));
            }
            around = surroundings(grid, tags, 1.0);
            fits = again(&around, &fits);
        }
        let noises = fits.iter().flatten().map(ModelFit::noise).collect();
        let usual = median(noises).unwrap_or(0.0);
        let blurs: BTreeMap<Vertex, f64> = grid
            .corners
            .iter()
            .zip(&fits)
            .filter_map(|(c, fit)| Some((Vertex::new(c.row, c.col), fit.as_ref()?.blur_px())))
            .collect();
        let kind = grid.kind;
        let settled = |(corner, fit): (&GridCorner, &Option<ModelFit>)| {
            let Some(fit) = fit else { return Some(*corner) };
            let here = Vertex::new(corner.row, corner.col);
            let around = kind.steps().iter().filter_map(|&step| blurs.get(&(here + step)).copied());
            let usual_px = median(around.collect()).unwrap_or(fit.blur_px());
            let DVec2 { x, y } = fit.position();
            let cov = fit.cov.map(|c| c * shape_of_residuals(fit, usual));
            let is_known = cov[0] + cov[2] < WORST_SIGMA_PX * WORST_SIGMA_PX;
            let is_corner = is_known && fit.blur_px() <= MAX_BLUR_RATIO * usual_px;
            is_corner.then_some(GridCorner { x, y, cov: Some(cov), ..*corner })
        };
        let corners = grid.corners.iter().zip(&fits).zip(&around);
        let held = |(of_fit, around): ((&GridCorner, _), &Surroundings)| {
            settled(of_fit).or_else(|| met_by_edges(image, of_fit.0, around))
        };
        grid.corners = corners.filter_map(held).collect();
        let blurs = fits.iter().flatten().map(ModelFit::blur_px).collect();
        let blur_px = median(blurs)?;
        widen(grid, sharpness.optics, blur_px);
        Some(Seen { blur_px, noise: usual })
    }

    /// Returns whether the clear area around a corner suffices for the model.
    fn has_room(&self, image: ImageView, corner: &GridCorner, room: Room) -> bool {
        self.window(image, corner.position(), room).count() >= MIN_PIXELS
    }

    /// Refines all corners of a grid separately.
    fn refine_each(
        &self,
        image: ImageView,
        grid: &Grid,
        around: &[Surroundings],
        sharpness: Sharpness,
    ) -> Vec<(Refined, Option<ModelFit>)> {
        each(grid.corners.len(), |fitter, i| {
            let room = self.near(&around[i], sharpness);
            self.refine_within(fitter, image, grid.corners[i].position(), room)
        })
    }

    /// Moves corners at which the model fails, although it fits most others, to the position that the others predict: a
    /// cell of a tag may have been mistaken for the corner. Returns which corners were certainly mistaken.
    fn put_back(&self, grid: &mut Grid, refined: &[(Refined, Option<ModelFit>)]) -> Vec<bool> {
        let mut mistaken = vec![false; refined.len()];
        if !is_judge(refined) || refined.iter().all(|(_, fit)| fit.is_some()) {
            return mistaken;
        }
        let mut fitted = grid.clone();
        let mut fits = refined.iter().map(|(_, fit)| fit.as_ref());
        fitted.corners.retain_mut(|corner| {
            let fit = fits.next().flatten();
            fit.inspect(|fit| corner.move_to(fit.position())).is_some()
        });
        let predicted = Prediction::from(&fitted);
        for (i, corner) in grid.corners.iter_mut().enumerate() {
            if refined[i].1.is_none()
                && let Some((position, sd_px)) = predicted.at(Vertex::new(corner.row, corner.col))
                && sd_px < MAX_WAY_PX
            {
                let off_px = position.distance(corner.position());
                mistaken[i] = off_px > MAX_WAY_PX + MISTAKEN_SIGMAS * sd_px;
                corner.move_to(position);
            }
        }
        mistaken
    }

    /// Returns all of the clear area around a corner, in the largest window.
    fn whole<'a>(&self, around: &'a Surroundings, sharpness: Sharpness<'a>) -> Room<'a> {
        let Sharpness { blur_px, optics } = sharpness;
        Room { around, blur_px, reach_px: self.largest_radius(), optics }
    }

    /// Returns the immediate surroundings of a corner, from which the edges are initialised.
    fn near<'a>(&self, around: &'a Surroundings, sharpness: Sharpness<'a>) -> Room<'a> {
        let reach_px = REACH_PX.max(REACH_SIGMAS * sharpness.blur_px);
        let reach_px = reach_px.round().min(self.largest_radius());
        Room { reach_px, ..self.whole(around, sharpness) }
    }

    /// Returns the blur of a grid, px, from the finest level of the pyramid that shows enough of it.
    fn blur_of_grid(
        &self,
        fitter: &mut CornerFitter,
        level: Level,
        grid: &Grid,
        tags: &TagAreas,
    ) -> Option<f64> {
        // In a grid without tags, nothing indicates that its tiles are not plain.
        let plain = TagAreas::default();
        let shown = if grid.tags.is_empty() { &plain } else { tags };
        let most_px = MAX_BLUR * self.largest_radius();
        let mut known = self.blur(fitter, level.image, 0, grid, shown);
        for (n, level) in (1..).zip(level.coarser) {
            if known.is_some_and(|blur_px| blur_px <= most_px * f64::from(1u32 << (n - 1))) {
                break;
            }
            known = self.blur(fitter, level.into(), n, grid, shown).or(known);
        }
        known
    }

    /// Returns the blur of a grid in `image`, a level of its pyramid, in px of level 0: the median over the corners
    /// with the most room.
    fn blur(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        level: usize,
        grid: &Grid,
        tags: &TagAreas,
    ) -> Option<f64> {
        let scale = f64::from(1u32 << level);
        let every = grid.corners.len().div_ceil(OVERSAMPLING * BLUR_CORNERS).max(1);
        let sampled = (0..grid.corners.len()).step_by(every);
        let around = surroundings_of(grid, tags, scale, sampled.clone()).into_iter();
        let typical = Sharpness { blur_px: TYPICAL_BLUR_PX, optics: &self.known }.margin();
        let mut places: Vec<(f64, GridCorner, Surroundings)> = sampled
            .zip(around)
            .map(|(i, around)| (around.clear_square_px(typical), grid.corners[i], around))
            .collect();
        places.sort_by(|a, b| b.0.total_cmp(&a.0));
        let fits = places.iter().take(BLUR_CORNERS).filter_map(|(clear_px, corner, around)| {
            let place = Pyramid::from_level_0(level, corner.position());
            // A wave is visible in the middle of the tiles.
            let reach_px = clear_px.max(MIN_MODEL_RADIUS as f64).floor();
            let room = Room { around, blur_px: TYPICAL_BLUR_PX, reach_px, optics: &self.known };
            self.model(fitter, image, place, room, None).map(|fit| scale * fit.blur_px())
        });
        median(fits.collect())
    }

    /// Returns the fit in the largest window smaller than that of `room` whose residual is at most `limit`.
    fn clean_fit(
        &self,
        fitter: &mut CornerFitter,
        image: ImageView,
        corner: &GridCorner,
        room: Room,
        limit: f64,
    ) -> Option<ModelFit> {
        let least = MIN_MODEL_RADIUS as f64;
        let first = room.clear_square_px();
        let sides = std::iter::successors(Some(first), |side| Some(NEXT_WINDOW * side));
        let sides =
            sides.take_while(|&side| side / NEXT_WINDOW > least).map(|side| side.max(least));
        let mut fits = sides.filter_map(|side| {
            let room = Room { reach_px: side.floor(), ..room };
            self.model(fitter, image, corner.position(), room, None)
        });
        fits.find(|fit| fit.residual <= limit)
    }
}

/// Returns a corner that its pixels do not show at the position in which its edges meet, if all of them are visible.
fn met_by_edges(
    image: ImageView,
    corner: &GridCorner,
    around: &Surroundings,
) -> Option<GridCorner> {
    let met = EdgeCrossing::find(image, corner.position(), &around.neighbours)?;
    let DVec2 { x, y } = met.position;
    let is_known = met.cov[0] + met.cov[2] < WORST_SIGMA_PX * WORST_SIGMA_PX;
    is_known.then_some(GridCorner { x, y, cov: Some(met.cov), ..*corner })
}

/// Returns the results of `work` for corners 0 to `count` − 1, in order, on the threads of the current pool.
fn each<F: Send>(count: usize, work: impl Fn(&mut CornerFitter, usize) -> F + Sync) -> Vec<F> {
    let parts = (0..count).into_par_iter().with_min_len(PART);
    parts.map_init(CornerFitter::default, |fitter, i| work(fitter, i)).collect()
}

/// Returns the level of the pyramid, of `levels`, on which an image is refined: the coarsest on which its sharpest grid
/// is no sharper than [`SHARP_PX`]. On the finest level, an enlarged image shows little but the centre of the edges,
/// and noise is correlated over all pixels of the window.
pub(crate) fn sharp_level(blurs: &[Option<f64>], levels: usize) -> usize {
    let is_sampled_on = |&level: &usize| is_sampled(blurs, 1.0 / f64::from(1u32 << level));
    (1..levels).rfind(is_sampled_on).unwrap_or(0)
}

/// Returns whether the sharpest grid, with its blur multiplied by `part`, is no sharper than [`SHARP_PX`].
pub(crate) fn is_sampled(blurs: &[Option<f64>], part: f64) -> bool {
    let sharpest = blurs.iter().copied().flatten().reduce(f64::min);
    sharpest.is_some_and(|blur_px| part * blur_px >= SHARP_PX)
}

/// Returns the factor of the covariance of a corner for systematic residuals. Residuals beyond the usual noise of the
/// grid show an object in the image, such as glare or the edge of an occluder. Neighbouring pixels
/// are then not independent. Residuals with the correlation r between neighbours, in rows and in
/// columns, count as ((1 + r)/(1 − r))² times their variance.
fn shape_of_residuals(fit: &ModelFit, usual_noise: f64) -> f64 {
    let share = 1.0 - (UNUSUAL * usual_noise / fit.noise()).powi(2);
    let correlation = (1.0 - fit.whiteness).clamp(0.0, MAX_CORRELATED);
    let together = ((1.0 + correlation) / (1.0 - correlation)).powi(2);
    1.0 + share.max(0.0) * (together - 1.0)
}

/// Returns whether the model fits most corners of a grid. It cannot fit edges as sharp as a pixel,
/// and must not reject corners of these grids.
fn is_judge(refined: &[(Refined, Option<ModelFit>)]) -> bool {
    let fitted = refined.iter().filter(|(_, fit)| fit.is_some()).count();
    2 * fitted > refined.len()
}
