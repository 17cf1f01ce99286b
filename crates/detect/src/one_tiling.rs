//! The stages of detection for the targets of one tiling.

pub(crate) mod following;
mod refining;

use std::collections::BTreeMap;

use glam::DVec2;

use super::config::DetectorConfig;
use super::nothing_seen::nothing_found;
use super::tiling::{CHECKER, DELTILLE, kind, step};
use super::timing::Timing;
use crate::corners::ring;
use crate::corners::saddles::{SaddleFinder, too_many};
use crate::grid::grids::grids;
use crate::grid::saddle_grid::{PlacedSaddle, SaddleGrid};
use crate::grid::untagged::beyond::go_on;
use crate::grid::untagged::tile_shape::{LARGE_INK, is_of_squares};
use crate::labels::grid_labels::{FoundGrid, Labels, MAX_CORNERS, report_once};
use crate::labels::placement::labeller::Budget;
use crate::refine::clearance::{Margin, TagAreas, surroundings};
use crate::refine::edge_shift::{MAX_SHIFT, centre, has_straight_edges};
use crate::refine::model::fitter::CornerFitter;
use crate::refine::optics::Optics;
use crate::refine::refiner::Refiner;
use crate::transformed::enlarged::enlarged_grids;
use crate::transformed::foreshortened::{Direction, foreshortened_direction, foreshortened_grids};
use crate::transformed::moved_edges::grids_of_moved_edges;
use deltille_core::Clock;
use deltille_core::detection::{
    Detection, Grid, GridCorner, Ink, InkEstimate, MIN_UNTAGGED_EDGE_PX, Reason, ReasonKind,
};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::{ImageView, Pyramid};
use deltille_core::statistics::median;
use deltille_core::targets::least_untagged_corners;

/// Maximum number of reported reasons for missing labels, those of the largest grids.
const MAX_REASONS: usize = 3;

/// Minimum number of pixels per corner on a level that is searched for the whole board. If the
/// board covers a third of the image, its edges are 18 px long there.
const MIN_PX2_A_CORNER: usize = 1000;

/// Minimum edge length on a coarser level, px. The corner fit uses pixels up to this distance.
/// Pixels near neighbouring corners bias it.
const MIN_COARSE_EDGE_PX: f64 = 7.0;

/// Radius of the polynomial refinement, px, as in the reference detector.
const POLYNOMIAL_RADIUS: usize = 3;

/// Number of times that a grid has as many corners as the target if it shows something else, not the target with false
/// corners beyond its border.
const LARGER: usize = 2;

/// Micrometres per millimetre.
const UM_IN_MM: f64 = 1e3;

/// Largest radius of the model refinement, px. Beyond it, the curvature of edges by lens distortion
/// costs more accuracy than a wider window gains.
const MODEL_RADIUS: usize = 10;

/// An image and its pyramid.
#[derive(Clone, Copy)]
pub(super) struct Frame<'a> {
    pub(super) image: ImageView<'a>,
    pub(super) pyramid: &'a Pyramid<'a>,
}

/// How thoroughly an image is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Search {
    /// Only in the image itself if it shows no grid.
    Quick,
    /// Also in transformed images.
    Thorough,
}

/// Grids, each with the reason why it has no labels.
type Judged = Vec<(Grid, Option<Reason>)>;

/// What the refined corners of an image have in common.
#[derive(Clone, Debug)]
pub(crate) struct Shared {
    pub(crate) optics: Optics,
    /// For each grid, whether blur leaves only its fundamental wave.
    pub(crate) are_waves: Vec<bool>,
    /// The blur of each grid, px.
    pub(crate) blurs: Vec<Option<f64>>,
    /// Noise of the first grid, as a fraction of full scale; `None` if grids were refined on a coarser level, or from
    /// their motion or moved edges.
    pub(crate) noise: Option<f64>,
}

/// Result for an image.
struct Found {
    grids: Judged,
    /// What the corners have in common.
    shared: Shared,
    /// Reasons why other grids are left out.
    left_out: Vec<Reason>,
    /// Number of detected corners.
    saddles: usize,
}

/// Finder for the corners of a tiling.
#[derive(Clone, Debug)]
enum Finder {
    Deltille(SaddleFinder<DELTILLE>),
    Checker(SaddleFinder<CHECKER>),
}

impl Finder {
    fn of(kind: GridKind) -> Self {
        match kind {
            GridKind::Deltille => Self::Deltille(SaddleFinder::new()),
            GridKind::Checker => Self::Checker(SaddleFinder::new()),
        }
    }
}

/// Finds and labels the grids of one tiling.
#[derive(Clone, Debug)]
pub(super) struct OneTiling {
    finder: Finder,
    refiner: Refiner,
    /// Areas of the tiles that a tag covers.
    tag_areas: TagAreas,
    labels: Labels,
    /// Edge length of the tiles, mm, if all panels have the same.
    pub(super) edge_mm: Option<f64>,
    /// Whether the ink spread was given.
    is_ink_given: bool,
    /// Ink spread estimated from other images.
    pub(super) ink: Option<InkEstimate>,
    /// Clock that times the stages, if any.
    clock: Option<Clock>,
}

impl OneTiling {
    pub(super) fn new(
        kind: GridKind,
        labels: Labels,
        tag_areas: TagAreas,
        edge_mm: Option<f64>,
        config: DetectorConfig,
    ) -> Self {
        let is_ink_given = config.ink != Ink::Auto;
        let (finder, refiner) = (Finder::of(kind), refiner(kind, config, edge_mm));
        Self { finder, refiner, tag_areas, labels, edge_mm, is_ink_given, ink: None, clock: None }
    }

    /// Returns these stages with a clock that times each of them.
    pub(super) fn with_clock(self, clock: Clock) -> Self {
        Self { clock: Some(clock), ..self }
    }

    /// Returns these stages for a print whose ink spread is already estimated.
    pub(super) fn with_ink(self, ink: InkEstimate) -> Self {
        Self { refiner: self.refiner.with_ink(Some(ink.edges)), ink: Some(ink), ..self }
    }

    /// Returns whether the ink spread is estimated from images.
    pub(super) fn is_ink_asked(&self) -> bool {
        !self.is_ink_given
    }

    /// Returns whether these stages find checkerboards.
    pub(super) fn is_of_squares(&self) -> bool {
        matches!(self.finder, Finder::Checker(_))
    }

    /// Returns the detection of an image. `name` is copied to the result.
    pub(super) fn detect(&self, frame: Frame, timing: Timing, name: &str) -> Detection {
        self.search(frame, Search::Thorough, timing, name).0
    }

    /// Returns the detection of an image, and what its corners have in common.
    pub(super) fn search(
        &self,
        frame: Frame,
        how: Search,
        timing: Timing,
        name: &str,
    ) -> (Detection, Shared) {
        match &self.finder {
            Finder::Deltille(finder) => self.search_with(finder, frame, how, timing, name),
            Finder::Checker(finder) => self.search_with(finder, frame, how, timing, name),
        }
    }

    /// Starts the stopwatch of the stages.
    pub(super) fn timing(&self) -> Timing {
        Timing::start(self.clock)
    }

    fn search_with<const N: usize>(
        &self,
        finder: &SaddleFinder<N>,
        frame: Frame,
        how: Search,
        mut timing: Timing,
        name: &str,
    ) -> (Detection, Shared) {
        let Frame { image, pyramid } = frame;
        let whole = self.whole_on_coarser_level(finder, frame, &mut timing);
        let Found { grids, shared, left_out, saddles } = match whole {
            Some((grids, shared)) => Found { grids, shared, left_out: Vec::new(), saddles: 0 },
            None => self.all_grids(finder, frame, how, &mut timing),
        };
        let mut reasons = if grids.is_empty() {
            let nothing = || nothing_found::<N>(pyramid, saddles);
            let mut reason = left_out.first().cloned().unwrap_or_else(nothing);
            reason.grid = None;
            vec![reason]
        } else if self.labels.are_wanted() && grids.iter().all(|(_, reason)| reason.is_some()) {
            let of_grid = |(i, (_, reason)): (usize, &(Grid, Option<Reason>))| {
                let mut reason = reason.clone()?;
                reason.grid = Some(i);
                Some(reason)
            };
            grids.iter().enumerate().filter_map(of_grid).take(MAX_REASONS).collect()
        } else {
            Vec::new()
        };
        let is_of_others = |reason: &Reason| {
            matches!(reason.kind, ReasonKind::SeenTwice | ReasonKind::TooManyGrids)
        };
        reasons.extend(
            left_out.into_iter().filter(|reason| !grids.is_empty() && is_of_others(reason)),
        );
        let grids = grids.into_iter().map(|(grid, _)| grid).collect();
        let mut found = self.detection(image, name, grids, &shared.optics, timing);
        found.reasons = reasons;
        (found, shared)
    }

    fn detection(
        &self,
        image: ImageView,
        name: &str,
        grids: Vec<Grid>,
        optics: &Optics,
        timing: Timing,
    ) -> Detection {
        let size = [image.width() as u32, image.height() as u32];
        let mut found = Detection::new(name, size, grids);
        found.tone = optics.tone;
        found.ink = self.ink.or_else(|| {
            let ink = optics.ink_found?;
            Some(self.edge_mm.map_or(ink, |edge_mm| ink.on_print(edge_mm)))
        });
        found.timing_ms = timing.laps;
        found
    }

    /// Searches for a single board on the coarser levels of the pyramid. Returns it if a level
    /// shows the whole board and nothing else that resembles a board. Finer levels would add only
    /// the positions of corners, which are refined anyway. If refinement loses a corner, the finer
    /// levels are searched too.
    fn whole_on_coarser_level<const N: usize>(
        &self,
        finder: &SaddleFinder<N>,
        frame: Frame,
        timing: &mut Timing,
    ) -> Option<(Judged, Shared)> {
        let whole = self.labels.whole()?;
        let pyramid = frame.pyramid;
        let levels = pyramid.levels();
        let least = MIN_PX2_A_CORNER * whole.corners();
        let coarsest = levels.iter().rposition(|level| level.pixels().len() >= least)?;
        let seen = (1..=coarsest).rev().find_map(|level| {
            let coarse = pyramid.from_level(level);
            let saddles = finder.find(&coarse);
            if saddles.len() < whole.corners() {
                return None;
            }
            let mut found = grids(finder, &coarse, &saddles, Some(whole));
            let is_seen = |grid: &SaddleGrid| {
                whole.is_shown_by(grid) && shortest_edge_px::<N>(grid) >= MIN_COARSE_EDGE_PX
            };
            if !found.first().is_some_and(is_seen) {
                return None;
            }
            for placed in found.iter_mut().flat_map(|grid| grid.values_mut()) {
                placed.position = Pyramid::to_level_0(level, placed.position);
            }
            let mut left_out = Vec::new();
            let labelled = self.plausible::<N>(frame, &found, &mut left_out);
            let is_alone = labelled.len() == 1 && labelled[0].1.is_none() && left_out.is_empty();
            is_alone.then_some(labelled)
        });
        timing.lap("coarse");
        let refined = seen.map(|seen| self.refined::<N>(frame, seen));
        timing.lap("refine");
        refined.filter(|(grids, _)| {
            grids.first().is_some_and(|(grid, _)| grid.corners.len() == whole.corners())
        })
    }

    /// Finds, labels and refines all grids of an image.
    fn all_grids<const N: usize>(
        &self,
        finder: &SaddleFinder<N>,
        frame: Frame,
        how: Search,
        timing: &mut Timing,
    ) -> Found {
        let Frame { image, pyramid } = frame;
        let saddles = finder.find(pyramid);
        timing.lap("saddles");
        let found = grids(finder, pyramid, &saddles, self.labels.whole());
        let mut left_out = Vec::new();
        if too_many(pyramid, saddles.len()) {
            let edge_px = ((image.width() * image.height()) as f64 / saddles.len() as f64).sqrt();
            let figures = [("edge_px", edge_px), ("needed_edge_px", MIN_UNTAGGED_EDGE_PX)];
            left_out.push(match edge_px < MIN_UNTAGGED_EDGE_PX {
                true => Reason::new(ReasonKind::TooSmall, figures),
                false => Reason::new(ReasonKind::TooManyGrids, []),
            });
        }
        timing.lap("grids");
        let mut grids = self.plausible::<N>(frame, &found, &mut left_out);
        let of_found = left_out.len();
        timing.lap("labels");
        let is_worth = self.is_sought() && (how == Search::Thorough || !grids.is_empty());
        let is_other = |grid: &&SaddleGrid| grid.len() > LARGER * self.labels.most_corners();
        let others = found.iter().filter(is_other).flat_map(|grid| grid.values());
        let others: Vec<DVec2> = others.map(|placed| placed.position).collect();
        if is_worth && self.may_lack_corners(&grids) {
            let found = enlarged_grids(finder, image, pyramid, self.labels.whole(), &others);
            let found = self.plausible::<N>(frame, &found, &mut Vec::new());
            grids = self.with_larger_panels(grids, found);
            timing.lap("enlarged");
        }
        if let Some(direction) = self.foreshortened_direction::<N>(&found, &grids)
            && is_worth
        {
            let foreshortened = foreshortened_grids(finder, pyramid, direction, &others);
            // Foreshortened patterns of all kinds contain triangles and squares too.
            let left_out = if grids.is_empty() { &mut left_out } else { &mut Vec::new() };
            let foreshortened = self.plausible::<N>(frame, &foreshortened, left_out);
            grids = self.with_larger_panels(grids, foreshortened);
            timing.lap("foreshortened");
        }
        if is_worth && !grids.iter().any(|found| self.is_identified(found)) {
            let found = grids_of_moved_edges(finder, pyramid, self.labels.whole(), &others);
            let mut identified = self.plausible::<N>(frame, &found, &mut Vec::new());
            identified.iter_mut().for_each(|(grid, _)| centre(frame.image, grid, MAX_SHIFT));
            // Dots look like squares whose edges have moved.
            identified.retain(|found| {
                self.is_identified(found)
                    && (is_confirmed(&found.0) || has_straight_edges(frame.image, &found.0))
            });
            if !identified.is_empty() {
                grids = identified;
            }
            timing.lap("moved edges");
        }
        if grids.iter().all(|(_, no_labels)| no_labels.is_some()) {
            let reasons = grids.iter_mut().filter_map(|(_, no_labels)| no_labels.as_mut());
            let reasons = reasons.chain(left_out.iter_mut().take(of_found));
            self.name_other_settings(image, &found, reasons);
        }
        let (mut grids, mut shared) = self.refined::<N>(frame, grids);
        timing.lap("refine");
        if !self.tag_areas.is_empty()
            && !grids.is_empty()
            && !grids.iter().any(|(grid, _)| is_labelled(grid))
        {
            // Under strong blur, the tags displace the corners that are not yet refined.
            let precise: Vec<SaddleGrid> =
                grids.iter().filter_map(|grid| with_positions(&found, grid)).collect();
            let again = self.plausible::<N>(frame, &precise, &mut Vec::new());
            if again.iter().any(|(grid, _)| is_labelled(grid)) {
                (grids, shared) = self.refined::<N>(frame, again);
            }
            timing.lap("labels");
        }
        Found { grids, shared, left_out, saddles: saddles.len() }
    }

    /// Returns whether grids may lack corners because their tags are too near: none is identified, or one that is does not
    /// show a whole board, and the circle on which corners are searched for reaches the tags.
    fn may_lack_corners(&self, grids: &Judged) -> bool {
        let is_near = |grid: &Grid| {
            let around = surroundings(grid, &self.tag_areas, 1.0);
            let clear =
                around.iter().map(|around| around.clear_square_px(Margin::of(0.0))).collect();
            median(clear).is_some_and(|clear_px| clear_px < ring::RADIUS as f64)
        };
        let mut identified = grids.iter().filter(|found| self.is_identified(found));
        let whole = self.labels.whole().map_or(usize::MAX, |whole| whole.corners());
        match identified.clone().count() {
            0 => true,
            _ => identified.any(|(grid, _)| grid.corners.len() < whole && is_near(grid)),
        }
    }

    /// Returns the direction in which tiles may be long that are missing because they are foreshortened: that of the largest
    /// grid if it is foreshortened and not whole, and that of parallel edges if there is no grid.
    fn foreshortened_direction<const N: usize>(
        &self,
        found: &[SaddleGrid],
        grids: &Judged,
    ) -> Option<Direction> {
        let whole = self.labels.whole().map_or(usize::MAX, |whole| whole.corners());
        let is_whole =
            |found: &(Grid, _)| self.is_identified(found) && found.0.corners.len() >= whole;
        match found.first() {
            _ if grids.iter().any(is_whole) => None,
            Some(largest) if !grids.is_empty() => {
                foreshortened_direction::<N>(largest).map(Direction::Known)
            }
            _ => Some(Direction::OfEdges),
        }
    }

    /// Adds to each reason the settings with which the tags in its grid, one of `found`, would fit.
    fn name_other_settings<'a>(
        &self,
        image: ImageView,
        found: &[SaddleGrid],
        reasons: impl Iterator<Item = &'a mut Reason>,
    ) {
        let of_tags = reasons.filter(|reason| reason.kind.is_of_tags_read());
        for reason in of_tags.take(MAX_REASONS) {
            let grid = reason.grid.and_then(|index| found.get(index));
            reason.fits = grid.and_then(|grid| self.labels.other_settings(image, grid));
        }
    }

    /// Refines the corners of the grids. Returns those that are still grids, and what they have in common.
    fn refined<const N: usize>(&self, frame: Frame, grids: Judged) -> (Judged, Shared) {
        let least = least_untagged_corners(kind::<N>()) as usize;
        let mut fitter = CornerFitter::default();
        let (mut refined, reasons): (Vec<Grid>, Vec<Option<Reason>>) = grids.into_iter().unzip();
        let shared = self.refine(&mut fitter, frame, &mut refined);
        let refined = refined.into_iter().zip(reasons).zip(shared.are_waves.iter().copied());
        let mut grids: Judged = refined
            .filter(|((grid, _), is_wave)| {
                is_confirmed(grid) || grid.corners.len() >= least && !is_wave
            })
            .map(|(grid, _)| grid)
            .collect();
        let may_have_tags = !self.tag_areas.is_empty();
        // Halftones look like boards of unknown size whose edges have moved.
        let ink = self.labels.whole().map_or(0.0, |_| shared.optics.ink());
        grids.retain(|(grid, _)| {
            // An outline alone does not distinguish squares that have shrunk from dots.
            let is_certain = is_confirmed(grid) || is_labelled(grid) && ink.abs() <= LARGE_INK;
            is_certain || is_of_squares(frame.image, grid, ink, may_have_tags)
        });
        // Refinement has removed some false corners.
        self.refuse_patterns(frame.pyramid, &mut grids);
        (grids, shared)
    }

    /// Returns the labelled grids that may belong to a target. Adds the reasons for the others to `left_out`. Reasons
    /// refer to grids by their index in `found`.
    fn plausible<const N: usize>(
        &self,
        frame: Frame,
        found: &[SaddleGrid],
        left_out: &mut Vec<Reason>,
    ) -> Judged {
        let mut budget = Budget::default();
        let label = |(index, corners): (usize, &SaddleGrid)| {
            let grid = FoundGrid { kind: kind::<N>(), corners };
            let mut labelled = self.labels.label(frame.image, grid, &mut budget);
            let reasons = labelled.iter_mut().filter_map(|(_, no_labels)| no_labels.as_mut());
            reasons.for_each(|reason| reason.grid = Some(index));
            labelled
        };
        let mut grids: Judged = found.iter().enumerate().flat_map(label).collect();
        let least = least_untagged_corners(kind::<N>()) as usize;
        let most = self.labels.most_corners();
        let mut refused = None;
        grids.retain(|(grid, no_labels)| {
            let (corners, edge_px) = (grid.corners.len(), grid.edge_px().unwrap_or(0.0));
            let is_large = corners >= least;
            let why = if edge_px < MIN_UNTAGGED_EDGE_PX {
                let figures = [("edge_px", edge_px), ("needed_edge_px", MIN_UNTAGGED_EDGE_PX)];
                Some(Reason::new(ReasonKind::TooSmall, figures))
            } else if corners > most {
                let figures = [("corners", corners as f64), ("expected", most as f64)];
                // Tags that were read give a more specific reason.
                let by_tags = no_labels.clone().filter(|reason| reason.kind.is_of_tags_read());
                let kind = match self.labels.are_wanted() {
                    true => ReasonKind::NotWhole,
                    false => ReasonKind::TooManyCorners,
                };
                by_tags.or_else(|| Some(Reason::new(kind, figures)))
            } else {
                None
            };
            let is_plausible = is_large && why.is_none();
            refused = refused.take().or(why.filter(|_| is_large && !is_confirmed(grid)));
            is_confirmed(grid) || is_plausible
        });
        left_out.extend(refused);
        self.refuse_patterns(frame.pyramid, &mut grids);
        left_out.extend(report_once(&mut grids));
        let (count, mut corners) = (grids.len(), 0);
        grids.retain(|(grid, _)| {
            corners += grid.corners.len();
            is_confirmed(grid) || corners <= MAX_CORNERS
        });
        left_out.extend((grids.len() < count).then(|| Reason::new(ReasonKind::TooManyGrids, [])));
        sort_by_panel(&mut grids);
        grids
    }

    /// Returns whether a target or a board of known size is searched for.
    fn is_sought(&self) -> bool {
        self.labels.are_wanted() || self.labels.whole().is_some()
    }

    /// Returns whether a grid is labelled, or is the complete board of known size.
    fn is_identified(&self, (grid, no_labels): &(Grid, Option<Reason>)) -> bool {
        is_labelled(grid) || self.is_sought() && no_labels.is_none()
    }

    /// Returns for each panel its grids from the list that shows more of its corners. Unidentified grids are only kept if no
    /// panel has gained corners, because they may show parts of those that have.
    fn with_larger_panels(&self, grids: Judged, mut others: Judged) -> Judged {
        let panel = |grid: &Grid| (grid.target.clone(), grid.panel);
        let corners = |grids: &Judged| {
            let mut corners = BTreeMap::new();
            for (grid, _) in grids.iter().filter(|found| self.is_identified(found)) {
                *corners.entry(panel(grid)).or_insert(0) += grid.corners.len();
            }
            corners
        };
        let (before, after) = (corners(&grids), corners(&others));
        let has_gained = |grid: &Grid| after.get(&panel(grid)) > before.get(&panel(grid));
        others.retain(|found| self.is_identified(found) && has_gained(&found.0));
        if others.is_empty() {
            return grids;
        }
        let kept = grids.into_iter();
        others.extend(kept.filter(|found| self.is_identified(found) && !has_gained(&found.0)));
        sort_by_panel(&mut others);
        others
    }

    /// Removes unconfirmed grids whose pattern continues beyond their border.
    fn refuse_patterns(&self, pyramid: &Pyramid, grids: &mut Judged) {
        loop {
            let all: Vec<&Grid> = grids.iter().map(|(grid, _)| grid).collect();
            let is_board = |i: usize| self.is_identified(&grids[i]);
            let mut goes_on = go_on(&pyramid.levels()[0], &all, is_board).into_iter();
            let count = grids.len();
            grids.retain(|(grid, _)| goes_on.next() != Some(true) || is_confirmed(grid));
            // A removed grid is part of the pattern into which others may continue.
            if grids.len() == count {
                return;
            }
        }
    }
}

/// Returns the shortest distance between neighbours in a grid, px.
fn shortest_edge_px<const N: usize>(grid: &SaddleGrid) -> f64 {
    let edges = grid.iter().flat_map(|(&vertex, placed)| {
        let next = (0..N / 2).filter_map(move |k| grid.get(&(vertex + step::<N>(k))));
        next.map(|next| next.position.distance(placed.position))
    });
    edges.fold(f64::INFINITY, f64::min)
}

/// Returns whether tags, or the outline of a mirrored board, confirm a grid.
fn is_confirmed(grid: &Grid) -> bool {
    !grid.tags.is_empty() || grid.mirrored
}

/// Returns whether a grid is confirmed by tags or as a whole board.
fn is_labelled(grid: &Grid) -> bool {
    is_confirmed(grid) || grid.panel.is_some()
}

/// Returns one of the `found` grids, which was refined without labels, at its refined positions.
fn with_positions(
    found: &[SaddleGrid],
    (grid, reason): &(Grid, Option<Reason>),
) -> Option<SaddleGrid> {
    let before = found.get(reason.as_ref()?.grid?)?;
    let placed = |corner: &GridCorner| {
        let vertex = Vertex::new(corner.row, corner.col);
        let PlacedSaddle { amplitude, .. } = *before.get(&vertex)?;
        Some((vertex, PlacedSaddle { position: corner.position(), amplitude }))
    };
    Some(grid.corners.iter().filter_map(placed).collect())
}

/// Sorts labelled grids by panel, then the others; a stable sort keeps the largest first.
fn sort_by_panel(grids: &mut Judged) {
    grids.sort_by_cached_key(|(grid, _)| {
        (grid.panel.is_none(), grid.target.clone(), grid.panel.unwrap_or(u32::MAX))
    });
}

fn refiner(kind: GridKind, config: DetectorConfig, edge_mm: Option<f64>) -> Refiner {
    let ink = match config.ink {
        Ink::Auto => None,
        Ink::Um(um) => Some(edge_mm.map_or(0.0, |edge_mm| um / UM_IN_MM / edge_mm)),
    };
    Refiner::with_radii(kind, config.refinement, POLYNOMIAL_RADIUS, MODEL_RADIUS)
        .with_tone(config.tone)
        .with_ink(ink)
}
