//! Follows labelled grids from one image of a video to the next.
//!
//! Corners move on like between the last two images. On a coarse level of the pyramid, where they are still separate, the
//! polynomial finds how far they are from there, and a common affine motion rejects those that it mistook. Refinement
//! starts from these positions with the optics of an earlier image. Then some tags, or the outline of an untagged board,
//! have to confirm the labels by the same evidence as in a single image. If anything fails, the image is searched.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;
use nalgebra::{Matrix3, Vector3};

use super::{Frame, MIN_COARSE_EDGE_PX, OneTiling, Shared, is_labelled};
use crate::corners::ring;
use crate::grid::saddle_grid::{PlacedSaddle, SaddleGrid};
use crate::labels::grid_labels::FoundGrid;
use crate::labels::placement::labeller::Budget;
use crate::refine::clearance::Prediction;
use crate::refine::edge_shift::positions;
use crate::refine::model::fitter::CornerFitter;
use crate::refine::optics::Optics;
use crate::timing::Timing;
use deltille_core::detection::{Detection, Grid, GridCorner};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::{ImageView, Pyramid};
use deltille_core::statistics::median;

/// Number of images after which missing corners of a single board are searched for again. Most of them are noticed when
/// they appear.
const SEARCH_EVERY: usize = 10;

/// The same for other panels and targets, of which nothing is predicted.
const SEARCH_PANELS_EVERY: usize = 3;

/// Number of corners beyond a board, in places without corners before, from which another board may be in view. Single
/// ones are tips of tiles.
const BEYOND: usize = 3;

/// Maximum number of corners whose motion is measured; it has six parameters.
const MOTION_CORNERS: usize = 40;

/// Maximum distance of a corner from its prediction, as a fraction of the shortest edge. Beyond half an edge, the nearest
/// corner is another one.
const MAX_WAY: f64 = 0.35;

/// Minimum fraction of corners that agree with a common motion.
const MIN_AGREEING: f64 = 0.6;

/// Rounds in which corners that disagree are rejected.
const ROUNDS: usize = 3;

/// Deviation from the common motion up to which a corner agrees, px of the level.
const AGREES_PX: f64 = 0.75;

/// Maximum change of the noise under the same optics, as a ratio. The median over a hundred corners scatters by 2 %.
const MAX_NOISE_RATIO: f64 = 1.1;

/// Maximum ratio of the standard deviation of a corner to that in the last image. Beyond, its edges were fitted instead of
/// the corner.
const MAX_SIGMA_RATIO: f64 = 4.0;

/// Number of tags that confirm the labels of a grid. Each alone is evidence enough in a usual family.
const TAGS: usize = 5;

/// Minimum distance of a corner from the side of the image, px: the circle on which corners are searched for.
const CLEAR_PX: f64 = ring::RADIUS as f64;

/// The labelled grids of an image and its optics, from which the next image starts.
#[derive(Clone, Debug)]
pub(crate) struct Track {
    grids: Vec<TrackedGrid>,
    optics: Optics,
    /// Noise of the corners in the image from which the optics were estimated.
    noise: f64,
    blurs: Vec<Option<f64>>,
    /// Whether the last image had the same noise under these optics.
    is_steady: bool,
    /// Number of images since the last search.
    age: usize,
}

#[derive(Clone, Debug)]
struct TrackedGrid {
    grid: Grid,
    /// Displacements since the image before, px.
    steps: BTreeMap<Vertex, DVec2>,
    /// Vertices beside it that had no corner when it was last searched for, and whether the polynomial found something
    /// there.
    beside: BTreeMap<Vertex, Beside>,
}

/// A vertex beside a grid.
#[derive(Clone, Copy, Debug)]
struct Beside {
    /// Whether the polynomial finds a corner there.
    is_seen: bool,
    /// Whether it belongs to the panel.
    is_on_panel: bool,
}

impl Track {
    /// Returns whether other panels are searched for in the next image.
    pub(crate) fn is_due(&self) -> bool {
        self.age + 1 >= SEARCH_PANELS_EVERY
    }
}

impl OneTiling {
    /// Returns the track that begins with the labelled grids of a searched image. `before` is the track up to the image
    /// before it.
    pub(crate) fn track(
        &self,
        image: ImageView,
        grids: &[Grid],
        shared: Shared,
        before: Option<&Track>,
    ) -> Option<Track> {
        let Shared { optics, noise, mut blurs, .. } = shared;
        if blurs.len() != grids.len() {
            // Some grids were dropped after refinement.
            blurs = vec![None; grids.len()];
        }
        let can_be_followed = |(grid, _): &(&Grid, _)| {
            !grid.mirrored && self.is_sought() && (is_labelled(grid) || self.is_whole(grid))
        };
        let tracked = |(grid, blur_px): (&Grid, Option<f64>)| {
            let beside = self.beside(image, grid);
            (TrackedGrid { beside, ..TrackedGrid::after(grid, before) }, blur_px)
        };
        let followed = grids.iter().zip(blurs).filter(can_be_followed).map(tracked);
        let (grids, blurs): (Vec<TrackedGrid>, Vec<Option<f64>>) = followed.unzip();
        let is_any = !grids.is_empty();
        is_any.then_some(Track { grids, optics, noise: noise?, blurs, is_steady: true, age: 0 })
    }

    /// Returns the detection of the next image, and the track from there. Returns `None` if the image has to be searched.
    pub(crate) fn follow(
        &self,
        frame: Frame,
        track: &Track,
        mut timing: Timing,
        name: &str,
    ) -> Option<(Detection, Option<Track>)> {
        let is_complete = track.grids.len() == 1 && self.is_whole(&track.grids[0].grid);
        let is_only_panel = self.labels.whole().is_some();
        let every = if is_only_panel { SEARCH_EVERY } else { SEARCH_PANELS_EVERY };
        if track.age + 1 >= every && !is_complete {
            return None;
        }
        let moved: Option<Vec<Grid>> =
            track.grids.iter().map(|tracked| self.moved(frame, tracked)).collect();
        let mut grids = moved?;
        let is_new = |(grid, tracked): (&Grid, &TrackedGrid)| {
            let now = self.beside(frame.image, grid).into_iter();
            tracked.is_new_beside(now)
        };
        if grids.iter().zip(&track.grids).any(is_new) {
            return None;
        }
        timing.lap("follow");
        let counts: Vec<usize> = grids.iter().map(|grid| grid.corners.len()).collect();
        let (refined, is_steady) = self.refine_moved(frame, &mut grids, track);
        timing.lap("refine");
        // Where the model fails, something has changed, or the prediction was wrong.
        let is_kept = |((grid, count), tracked): ((&Grid, &usize), &TrackedGrid)| {
            grid.corners.len() == *count
                && grid.corners.iter().all(|corner| tracked.is_as_certain(corner))
        };
        let is_lost = !grids.iter().zip(&counts).zip(&track.grids).all(is_kept)
            || refined.are_waves.contains(&true);
        if is_lost || !grids.iter_mut().all(|grid| self.confirm(frame.image, grid, track.age)) {
            return None;
        }
        timing.lap("labels");
        let found = self.detection(frame.image, name, grids.clone(), &refined.optics, timing);
        let next = refined.noise.map(|noise| {
            let tracked = grids.iter().zip(&track.grids).map(|(grid, before)| TrackedGrid {
                beside: before.beside.clone(),
                ..TrackedGrid::after(grid, Some(track))
            });
            let Shared { optics, blurs, .. } = refined;
            Track { grids: tracked.collect(), optics, noise, blurs, is_steady, age: track.age + 1 }
        });
        Some((found, next))
    }

    /// Refines grids near their corners, under the optics of an earlier image unless exposure, motion or focus has changed.
    /// Returns whether it has not.
    fn refine_moved(&self, frame: Frame, grids: &mut Vec<Grid>, track: &Track) -> (Shared, bool) {
        let mut fitter = CornerFitter::default();
        let Track { optics, noise, blurs, .. } = track;
        let start = grids.clone();
        if track.is_steady {
            let refined = self.refine_again(&mut fitter, frame.image, grids, optics, blurs);
            if refined.noise.is_some_and(|now| is_about(now, *noise)) {
                return (Shared { noise: Some(*noise), ..refined }, true);
            }
            *grids = start;
        }
        let refined = self.refine(&mut fitter, frame, grids);
        let is_steady = refined.noise.is_some_and(|now| is_about(now, *noise));
        (refined, is_steady)
    }

    /// Returns the detection of an image that was not searched.
    pub(crate) fn nothing(&self, image: ImageView, name: &str) -> Detection {
        self.detection(image, name, Vec::new(), &Optics::default(), self.timing())
    }

    /// Returns a grid with its corners at the positions to which they have moved in this image; `None` if they are not
    /// found.
    fn moved(&self, frame: Frame, tracked: &TrackedGrid) -> Option<Grid> {
        let levels = frame.pyramid.levels();
        let mut grid = tracked.predicted();
        let shortest_px = shortest_edge_px(&grid);
        let is_coarse_enough =
            |&level: &usize| shortest_px >= MIN_COARSE_EDGE_PX * f64::from(1u32 << level);
        let level = (0..levels.len()).rfind(is_coarse_enough).unwrap_or(0);
        let image = if level == 0 { frame.image } else { ImageView::from(&levels[level]) };
        let every = grid.corners.len().div_ceil(MOTION_CORNERS).max(1);
        let found = grid.corners.iter().step_by(every).filter_map(|corner| {
            let start = corner.position();
            let place = self.refiner.found(image, Pyramid::from_level_0(level, start))?;
            let way = Pyramid::to_level_0(level, place) - start;
            (way.length() <= MAX_WAY * shortest_px).then_some((start, way))
        });
        let found: Vec<(DVec2, DVec2)> = found.collect();
        let least = MIN_AGREEING * (grid.corners.len() as f64 / every as f64);
        let motion = affine_motion(found, AGREES_PX * f64::from(1u32 << level), least)?;
        grid.corners.retain_mut(|corner| {
            corner.move_to(corner.position() + motion(corner.position()));
            is_inside(frame.image, corner.position())
        });
        Some(grid)
    }

    /// Returns whether some tags of a grid, or its outline, confirm its labels. Replaces its tags by those that were read.
    fn confirm(&self, image: ImageView, grid: &mut Grid, number: usize) -> bool {
        let Some(panel) = self.labels.panel_of(grid) else { return false };
        let known = positions(grid);
        let tiles: Vec<_> = panel
            .tagged
            .iter()
            .map(|tile| tile.vertices().collect::<Vec<_>>())
            .filter(|tile| tile.iter().all(|vertex| known.contains_key(vertex)))
            .collect();
        let every = tiles.len().div_ceil(TAGS).max(1);
        let chosen: BTreeSet<Vertex> = match panel.tagged.is_empty() {
            true => known.keys().copied().collect(),
            // Others in each image.
            false => tiles.iter().skip(number % every).step_by(every).flatten().copied().collect(),
        };
        // Upright tiles of a found grid are dark.
        let as_found = |Vertex { row, col }: Vertex| match (panel.inverted, grid.kind) {
            (false, _) => Vertex::new(row, col),
            (true, GridKind::Deltille) => Vertex::new(-row, -col),
            (true, GridKind::Checker) => Vertex::new(row, col + 1),
        };
        let placed = |vertex: &Vertex| {
            (as_found(*vertex), PlacedSaddle { position: known[vertex], amplitude: 0.0 })
        };
        let corners: SaddleGrid = chosen.iter().map(placed).collect();
        let found = FoundGrid { kind: grid.kind, corners: &corners };
        let labelled = self.labels.label(image, found, &mut Budget::default());
        let [(labelled, None)] = &labelled[..] else { return false };
        let is_equal = |corner: &GridCorner| {
            known.get(&Vertex::new(corner.row, corner.col)) == Some(&corner.position())
        };
        let is_confirmed = labelled.panel == grid.panel
            && labelled.target == grid.target
            && labelled.corners.len() == corners.len()
            && labelled.corners.iter().all(is_equal);
        grid.tags.clone_from(&labelled.tags);
        is_confirmed
    }

    /// Returns whether a grid shows all corners of the only panel of the target.
    fn is_whole(&self, grid: &Grid) -> bool {
        self.labels.whole().is_some_and(|whole| whole.corners() == grid.corners.len())
    }

    /// Returns the vertices next to a grid, on its panel or beyond, that are predicted in the image.
    fn beside(&self, image: ImageView, grid: &Grid) -> BTreeMap<Vertex, Beside> {
        let Some(panel) = self.labels.panel_of(grid) else { return BTreeMap::new() };
        let known = positions(grid);
        let neighbours = known.keys().flat_map(|&vertex| grid.kind.neighbours(vertex));
        let missing: BTreeSet<Vertex> =
            neighbours.filter(|vertex| !known.contains_key(vertex)).collect();
        let predicted = Prediction::from(grid);
        let look = |vertex: Vertex| {
            let (place, sd_px) = predicted.at(vertex).filter(|(at, _)| is_inside(image, *at))?;
            let found = self.refiner.found(image, place);
            let is_near = |found: DVec2| found.distance(place) <= AGREES_PX.max(3.0 * sd_px);
            let is_seen = found.is_some_and(is_near);
            Some((vertex, Beside { is_seen, is_on_panel: panel.corners.contains(&vertex) }))
        };
        missing.into_iter().filter_map(look).collect()
    }
}

impl TrackedGrid {
    /// Creates it for a grid, with its displacements since the last image of a track.
    fn after(grid: &Grid, before: Option<&Track>) -> Self {
        let same = |tracked: &&TrackedGrid| {
            (tracked.grid.panel, &tracked.grid.target) == (grid.panel, &grid.target)
        };
        let last = before.and_then(|track| track.grids.iter().find(same));
        let last = last.map(|tracked| positions(&tracked.grid)).unwrap_or_default();
        let step = |(vertex, place): (Vertex, DVec2)| Some((vertex, place - *last.get(&vertex)?));
        let steps = positions(grid).into_iter().filter_map(step).collect();
        Self { grid: grid.clone(), steps, beside: BTreeMap::new() }
    }

    /// Returns whether a corner of the panel may have come into view, or a part of another board.
    fn is_new_beside(&self, now: impl Iterator<Item = (Vertex, Beside)>) -> bool {
        let mut beyond = 0;
        for (vertex, Beside { is_seen, is_on_panel }) in now {
            let is_new = match self.beside.get(&vertex) {
                Some(before) => is_seen && !before.is_seen,
                None => is_on_panel || is_seen,
            };
            if is_new && is_on_panel {
                return true;
            }
            beyond += usize::from(is_new);
        }
        beyond >= BEYOND
    }

    /// Returns whether a corner has a covariance that is not much larger than in the last image.
    fn is_as_certain(&self, corner: &GridCorner) -> bool {
        let size = |cov: [f64; 3]| cov[0] + cov[2];
        let place = |c: &GridCorner| (c.row, c.col).cmp(&(corner.row, corner.col));
        let last = self.grid.corners.binary_search_by(place).ok();
        let last = last.and_then(|index| self.grid.corners[index].cov).map(size);
        let most = last.map_or(f64::INFINITY, |last| MAX_SIGMA_RATIO * MAX_SIGMA_RATIO * last);
        corner.cov.is_some_and(|cov| size(cov) <= most)
    }

    /// Returns the grid with its corners where they are if they have moved like before.
    fn predicted(&self) -> Grid {
        let mut grid = self.grid.clone();
        let along = |of: fn(&DVec2) -> f64| median(self.steps.values().map(of).collect());
        let usual = along(|step| step.x).zip(along(|step| step.y)).unwrap_or_default();
        for corner in &mut grid.corners {
            let step = self.steps.get(&Vertex::new(corner.row, corner.col)).copied();
            corner.move_to(corner.position() + step.unwrap_or(usual.into()));
            corner.cov = None;
        }
        grid
    }
}

/// Returns the affine displacement that most of these points agree with, each given with its displacement, px; `None` if
/// they are fewer than `least`.
fn affine_motion(
    mut points: Vec<(DVec2, DVec2)>,
    agrees_px: f64,
    least: f64,
) -> Option<impl Fn(DVec2) -> DVec2> {
    let middle_of = |of: fn(&(DVec2, DVec2)) -> f64| median(points.iter().map(of).collect());
    let middle = DVec2::new(middle_of(|p| p.0.x)?, middle_of(|p| p.0.y)?);
    let usual = DVec2::new(middle_of(|p| p.1.x)?, middle_of(|p| p.1.y)?);
    let terms = move |place: DVec2| Vector3::new(1.0, place.x - middle.x, place.y - middle.y);
    let mut motion = [usual.x, usual.y].map(|first| Vector3::new(first, 0.0, 0.0));
    for round in 0..ROUNDS {
        let mut off_px: Vec<f64> = Vec::new();
        for (place, way) in &points {
            let [x, y] = motion.map(|motion| motion.dot(&terms(*place)));
            off_px.push(way.distance(DVec2::new(x, y)));
        }
        // The first motion is the same everywhere, so parts of a board that turns disagree with it.
        let most_px = agrees_px.max(3.0 * median(off_px.clone())?);
        let most_px = if round + 1 < ROUNDS { most_px } else { agrees_px };
        let mut off_px = off_px.into_iter();
        points.retain(|_| off_px.next().is_some_and(|off_px| off_px <= most_px));
        if (points.len() as f64) < least.max(3.0) {
            return None;
        }
        let (mut normal, mut right) = (Matrix3::zeros(), [Vector3::zeros(); 2]);
        for (place, way) in &points {
            let terms = terms(*place);
            normal += terms * terms.transpose();
            right[0] += way.x * terms;
            right[1] += way.y * terms;
        }
        let factor = normal.cholesky()?;
        motion = right.map(|right| factor.solve(&right));
    }
    Some(move |place: DVec2| {
        let [x, y] = motion.map(|motion| motion.dot(&terms(place)));
        DVec2::new(x, y)
    })
}

/// Returns whether two noises are equal up to their scatter.
fn is_about(noise: f64, other: f64) -> bool {
    (1.0 / MAX_NOISE_RATIO..=MAX_NOISE_RATIO).contains(&(noise / other))
}

/// Returns the shortest distance of neighbours in a grid, px.
fn shortest_edge_px(grid: &Grid) -> f64 {
    let places = positions(grid);
    let edges = places.iter().flat_map(|(&vertex, place)| {
        let next = grid.kind.neighbours(vertex);
        next.filter_map(|next| Some(places.get(&next)?.distance(*place))).collect::<Vec<_>>()
    });
    edges.fold(f64::INFINITY, f64::min)
}

/// Returns whether a corner may be seen at a position.
fn is_inside(image: ImageView, place: DVec2) -> bool {
    let size = DVec2::new(image.width() as f64, image.height() as f64) - 1.0;
    place.min(size - place).min_element() >= CLEAR_PX
}
