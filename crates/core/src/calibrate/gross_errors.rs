//! Gross errors, found before the last adjustment: panels, views, and panels in views that do not belong
//! with the others.
//!
//! ```text
//!   agree: all corners, with a loss that lets go of those far off, ever narrower
//!      └─→ the panel of which most corners are off, where others are not, goes; again
//!   wrong: medians of the rest, by view, and by panel in it
//!   settled: what is left is adjusted
//!      ├─→ a panel that then has no more outliers than others comes back; wrong again
//!      └─→ a view that speaks for another camera than all others goes; settled again
//! ```
//!
//! What is wrong pulls what is right with it, least where the scale is the narrowest that still
//! holds most corners. So the scale is walked down to before anything is called wrong. Where corners are off
//! alike, the walk may rest between them and the others; from there the nearest are followed, which are
//! mostly those of the larger crowd.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};

use super::error::CalibrationError;
use super::finding::{Count, Finding, Moved, Shared, shared_outliers};
use super::lack_of_fit::lack_of_fit;
use super::loss::Loss;
use super::minimise::{Until, minimise};
use super::panel::PanelRef;
use super::pose::{estimate_pose, planar_pose};
use super::problem::{Block, CameraUnknowns, Problem};
use super::reweighting::{Settled, deviations, residuals, scale, settle, with_gross_errors};
use super::start::middle;
use super::view::{LEAST_CORNERS, Sighting, View};
use super::view_consistency::Opinions;
use super::weights::{Weights, Whitening};
use crate::camera::Pose;
use crate::statistics::median;

/// The loss while the scale is walked down, as a part of the usual one: 1.5 deviations. A loss that
/// lets go later comes to rest between two crowds of corners.
const NARROW: f64 = 0.5;

/// The walk ends when a round leaves more than this part of the scale, or after so many rounds.
const STILL: f64 = 0.98;
const MOST_ROUNDS: usize = 12;

/// Of each frame this part of the corners is followed away from between two crowds, as most corners are right.
const FOLLOWED: f64 = 0.5;

/// There were two crowds if that leaves less than this part of the scale: noise without crowds hardly shrinks.
const SHRUNK: f64 = 0.5;

/// Panels of which one can be wrong: of two nothing tells which.
const LEAST_PANELS: usize = 3;

/// Corners farther outside their picture than it is large, by this factor, were not seen in it.
const BEYOND: f64 = 1.0;

/// Corners seen together do not belong with the others when their median error is more than so many
/// times the usual: blur, light and distance make a few times as much of it, labels that are off by a
/// tile a hundred times, as pictures do that were not taken at the same moment.
const WRONG_RATIO: f64 = 10.0;

/// Nor are they wrong below this: a corner that was found at all is found to the pixel, however much
/// better the others are.
const WRONG_PX: f64 = 1.0;

/// A problem where most of its corners agree, and what does not belong.
pub(super) struct Gross {
    pub problem: Problem,
    /// Blocks that take no part.
    pub left_out: Vec<bool>,
    /// Frames that do not belong.
    pub frames: BTreeMap<usize, WrongFrame>,
    /// The median error of frames that do, px.
    pub usual_px: f64,
    /// Panels that take no part.
    panels: BTreeSet<PanelRef>,
    /// The median error of every block, px.
    off_px: Vec<f64>,
    /// See [`Kept::some_stand_out`].
    some_stand_out: bool,
}

/// What of a problem belongs.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    pub problem: Problem,
    /// Blocks that take no part.
    pub left_out: Vec<bool>,
    /// Whether corners with gross errors stand out from the others at once. Then they must not pull even at first:
    /// two fifths that are off alike pull so much that they would no longer stand out.
    pub some_stand_out: bool,
}

/// Where a walk to where most corners agree ended.
#[derive(Clone, Debug)]
struct Walked {
    problem: Problem,
    /// The deviation of a coordinate.
    sigma: f64,
    /// See [`Kept::some_stand_out`].
    some_stand_out: bool,
}

/// Of so many frames one may be of another camera; where more are it is not clear which.
const FEW: usize = 10;

/// Why a frame does not belong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum WrongFrame {
    /// The corners of a camera are off by so much.
    Off { camera: usize, off_px: f64 },
    /// Its corners are seen as in a mirror.
    Mirrored,
    /// It shows nothing but panels that take no part.
    OnlyWrongPanels,
    /// It speaks for other cameras than the others do, and would move them by so many deviations.
    Stranger { deviations: f64 },
}

impl Gross {
    /// Walks to where most corners of a problem agree, and finds what does not; `None` where nothing
    /// can be adjusted.
    pub(super) fn of(problem: Problem) -> Option<Self> {
        agree(problem).map(|(walked, panels)| Self::without(walked, panels))
    }

    /// Finds what does not belong where most corners agree, beside panels that do not.
    fn without(walked: Walked, panels: BTreeSet<PanelRef>) -> Self {
        let Walked { problem, some_stand_out, .. } = walked;
        let residuals = residuals(&problem);
        let off_px: Vec<f64> = residuals.iter().map(median_px).collect();
        // Of every camera in every frame.
        let mut pictures: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        for (index, block) in problem.blocks.iter().enumerate() {
            if !panels.contains(&block.panel) {
                pictures.entry((block.frame, block.camera)).or_default().push(index);
            }
        }
        let medians: Vec<f64> = pictures
            .values()
            .map(|blocks| median_px(blocks.iter().flat_map(|&block| &residuals[block])))
            .collect();
        let limit = limit_px(&medians);
        let mut left_out: Vec<bool> =
            problem.blocks.iter().map(|block| panels.contains(&block.panel)).collect();
        let mut frames: BTreeMap<usize, WrongFrame> = BTreeMap::new();
        for block in mirrored(&problem) {
            left_out[block] = true;
        }
        for ((&(frame, camera), blocks), &off) in pictures.iter().zip(&medians) {
            if off > limit {
                let worst = frames.entry(frame).or_insert(WrongFrame::Off { camera, off_px: off });
                if matches!(worst, WrongFrame::Off { off_px, .. } if off > *off_px) {
                    *worst = WrongFrame::Off { camera, off_px: off };
                }
            } else if blocks.iter().all(|&block| left_out[block]) {
                frames.insert(frame, WrongFrame::Mirrored);
            } else {
                let wrong = |block: &&usize| nearest_px(&residuals[**block]) > limit;
                blocks.iter().filter(wrong).for_each(|&block| left_out[block] = true);
            }
        }
        for frame in 0..problem.frames.len() {
            let mut of_frame = pictures.range((frame, 0)..=(frame, usize::MAX));
            if of_frame.next().is_none() {
                frames.insert(frame, WrongFrame::OnlyWrongPanels);
            }
        }
        let usual_px = median(medians).unwrap_or(0.0);
        Self { problem, left_out, frames, usual_px, panels, off_px, some_stand_out }
    }

    /// What belongs, adjusted after `prepare`. A panel that looked wrong beside what is may be right, which
    /// shows where all that is wrong has gone: it is let back in then.
    pub(super) fn settled(
        mut self,
        weights: Weights,
        loss: Loss,
        prepare: impl Fn(&mut Kept),
    ) -> Result<(Self, Settled), CalibrationError> {
        let settle = |gross: &Self| {
            let mut kept = gross.kept();
            prepare(&mut kept);
            settle(kept, weights, loss)
        };
        loop {
            let settled = settle(&self)?;
            let wrong = self.wrong_in(&settled);
            if wrong == self.panels {
                return Ok(self.without_strangers(settled, loss, settle));
            }
            let walked = walked_without(self.problem, &wrong).ok_or(CalibrationError::NoStart)?;
            self = Self::without(walked, wrong);
        }
    }

    /// Without the few frames that speak for other cameras than the others do, if these then agree.
    fn without_strangers(
        mut self,
        settled: Settled,
        loss: Loss,
        settle: impl Fn(&Self) -> Result<Settled, CalibrationError>,
    ) -> (Self, Settled) {
        let most = self.belonging().count().div_ceil(FEW);
        let before = self.frames.clone();
        let mut without = None;
        for _ in 0..=most {
            // Views are strange by panels that are displaced, a board that is bent, or another lens, too.
            let now = without.as_ref().unwrap_or(&settled);
            let can_tell = self.panels.is_empty() && has_no_pattern(now);
            let Some(opinions) = can_tell.then(|| Opinions::of(now, loss)).flatten() else { break };
            match opinions.stranger.and_then(|(index, by)| Some((self.belonging().nth(index)?, by)))
            {
                None if opinions.agree => return (self, without.unwrap_or(settled)),
                None => break,
                Some((frame, deviations)) => {
                    self.frames.insert(frame, WrongFrame::Stranger { deviations });
                    match settle(&self) {
                        Ok(settled) => without = Some(settled),
                        Err(_) => break,
                    }
                }
            }
        }
        self.frames = before;
        (self, settled)
    }

    /// The frames that belong.
    pub(super) fn belonging(&self) -> impl Iterator<Item = usize> {
        (0..self.problem.frames.len()).filter(|frame| !self.frames.contains_key(frame))
    }

    /// Which of the panels that took no part have more outliers than others in what was settled.
    fn wrong_in(&self, settled: &Settled) -> BTreeSet<PanelRef> {
        let mut others = Count::default();
        let mut counts: BTreeMap<PanelRef, Count> = BTreeMap::new();
        let of_blocks = settled.problem.blocks.iter().zip(&settled.outliers);
        for ((block, outliers), left_out) in of_blocks.zip(self.kept().left_out) {
            let count = match (self.panels.contains(&block.panel), left_out) {
                (true, _) => counts.entry(block.panel).or_default(),
                (false, false) => &mut others,
                (false, true) => continue,
            };
            outliers.iter().for_each(|&far| count.add(far));
        }
        counts.retain(|_, count| count.exceeds(others));
        counts.into_keys().collect()
    }

    /// The problem without the frames that do not belong.
    pub(super) fn kept(&self) -> Kept {
        let belongs = |frame: usize| !self.frames.contains_key(&frame);
        let of_blocks = self.problem.blocks.iter().zip(&self.left_out);
        let left_out = of_blocks.filter(|(block, _)| belongs(block.frame)).map(|(_, out)| *out);
        let (problem, left_out) = (self.problem.with_frames(belongs), left_out.collect());
        Kept { problem, left_out, some_stand_out: self.some_stand_out }
    }

    /// What the outliers share; `names` are those of the frames, of the problem as it was at first.
    pub(super) fn findings(
        &self,
        settled: &Settled,
        names: impl Fn(usize) -> String,
    ) -> Vec<Finding> {
        let Settled { problem, outliers, .. } = settled;
        let kept: Vec<usize> = self.belonging().collect();
        let Kept { left_out, .. } = self.kept();
        let count = |belongs: &dyn Fn(&Block) -> bool| {
            let mut count = Count::default();
            let of_blocks = problem.blocks.iter().zip(outliers);
            let of_blocks = of_blocks.filter(|(block, _)| belongs(block));
            of_blocks.flat_map(|(_, outliers)| outliers).for_each(|&far| count.add(far));
            count
        };
        let of_panels = self.panels.iter().map(|&panel| {
            let Count { outliers, corners } = count(&|block| block.panel == panel);
            let moved = moved(settled, panel);
            Finding { shared: Shared::Panel { panel, moved }, outliers, corners, left_out: true }
        });
        let mut found: Vec<Finding> = of_panels.collect();
        let single = self.problem.blocks.iter().zip(&self.left_out).zip(&self.off_px);
        for ((block, _), &off_px) in single.filter(|((_, left_out), _)| **left_out) {
            let Block { panel, camera, frame, ref observations } = *block;
            if self.panels.contains(&panel) || self.frames.contains_key(&frame) {
                continue;
            }
            let view = names(frame);
            let corners = observations.len();
            let shared = Shared::PanelInView { panel, camera, view, off_px };
            found.push(Finding { shared, outliers: corners, corners, left_out: true });
        }
        found.extend(shared_outliers(problem, outliers, &left_out, |frame| names(kept[frame])));
        found
    }
}

/// The median error of corners, px.
fn median_px<'a>(residuals: impl IntoIterator<Item = &'a DVec2>) -> f64 {
    median(residuals.into_iter().map(|r| r.x.hypot(r.y)).collect()).unwrap_or(0.0)
}

/// The median error beyond which corners do not belong with the others, px, from those of all.
fn limit_px(medians: &[f64]) -> f64 {
    f64::max(WRONG_RATIO * median(medians.to_vec()).unwrap_or(0.0), WRONG_PX)
}

/// What a quarter of the corners are off by at most, px: labels that are wrong fit none.
fn nearest_px(residuals: &[DVec2]) -> f64 {
    let mut off: Vec<f64> = residuals.iter().map(|r| r.x.hypot(r.y)).collect();
    off.sort_by(f64::total_cmp);
    off.get(off.len() / 4).copied().unwrap_or(f64::INFINITY)
}

/// The blocks of which the other side is seen than of most: a plane in a mirror has a pose like any
/// other, from behind.
fn mirrored(problem: &Problem) -> Vec<usize> {
    let side = |block: &Block| {
        let camera_from_scene =
            problem.cameras[block.camera].camera_from_rig.after(&problem.frames[block.frame]);
        let pose = camera_from_scene.after(&problem.scene_from_panel(block.panel));
        let corner = block.observations.first().map_or(DVec3::ZERO, |seen| seen.panel_mm);
        (pose.rotation * DVec3::Z).dot(pose.apply(corner)).signum()
    };
    let sides: Vec<f64> = problem.blocks.iter().map(side).collect();
    let most = sides.iter().sum::<f64>();
    (0..sides.len()).filter(|&block| sides[block] * most < 0.0).collect()
}

/// Walks to where most corners agree, without the panels that most others speak against.
fn agree(problem: Problem) -> Option<(Walked, BTreeSet<PanelRef>)> {
    let seen: BTreeSet<PanelRef> = problem.blocks.iter().map(|block| block.panel).collect();
    let mut wrong: BTreeSet<PanelRef> = BTreeSet::new();
    let all = narrowed(problem)?;
    if seen.len() < LEAST_PANELS {
        return Some((all, wrong));
    }
    let mut walked = all.clone();
    while let Some(panel) = worst_panel(&walked.problem, walked.sigma, &wrong) {
        wrong.insert(panel);
        // Where as many are wrong as right, the target is another one.
        if 2 * wrong.len() >= seen.len() {
            return Some((all, BTreeSet::new()));
        }
        walked = walked_without(walked.problem, &wrong)?;
    }
    Some((walked, wrong))
}

/// Walks to where most corners agree without some panels, by which frames that show them were misplaced.
fn walked_without(mut problem: Problem, wrong: &BTreeSet<PanelRef>) -> Option<Walked> {
    let of_wrong = problem.blocks.iter().filter(|block| wrong.contains(&block.panel));
    let frames: BTreeSet<usize> = of_wrong.map(|block| block.frame).collect();
    frames.into_iter().for_each(|frame| place_anew(&mut problem, frame, wrong));
    let mut part = problem.part(|_, block| !wrong.contains(&block.panel));
    let walked = narrowed(part.problem)?;
    part.problem = walked.problem;
    problem.take(part);
    Some(Walked { problem, ..walked })
}

/// Whether residuals depend neither on the place in the image nor on that on the target.
fn has_no_pattern(settled: &Settled) -> bool {
    lack_of_fit(&settled.minimum.problem, &settled.whitening).is_empty()
}

/// Estimates the pose of a frame anew, from the panels that are not wrong, and keeps the better one.
fn place_anew(problem: &mut Problem, frame: usize, wrong: &BTreeSet<PanelRef>) {
    let is_right = |block: &&Block| block.frame == frame && !wrong.contains(&block.panel);
    let off_px = |problem: &Problem| {
        let blocks = problem.blocks.iter().filter(is_right);
        let seen =
            blocks.flat_map(|block| block.observations.iter().map(move |seen| (block, seen)));
        let residuals = seen.map(|(block, seen)| problem.residual(block, seen));
        median(residuals.map(|r| r.map_or(f64::INFINITY, |r| r.x.hypot(r.y))).collect())
            .unwrap_or(0.0)
    };
    let blocks = problem.blocks.iter().filter(is_right);
    let Some(largest) = blocks.clone().max_by_key(|block| block.observations.len()) else { return };
    let sightings = blocks
        .filter(|block| block.camera == largest.camera)
        .map(|block| Sighting { panel: block.panel, observations: block.observations.clone() });
    let CameraUnknowns { camera, camera_from_rig, .. } = &problem.cameras[largest.camera];
    let panels: Vec<Pose> = problem.panel_places().collect();
    let pose = estimate_pose(camera, &panels, &sightings.collect::<Vec<_>>());
    let Some(camera_from_scene) = pose else { return };
    let (place, before) = (camera_from_rig.inverse().after(&camera_from_scene), off_px(problem));
    let old = std::mem::replace(&mut problem.frames[frame], place);
    if off_px(problem) > before {
        problem.frames[frame] = old;
    }
}

fn sum(a: Count, b: Count) -> Count {
    Count { outliers: a.outliers + b.outliers, corners: a.corners + b.corners }
}

fn panel_counts(problem: &Problem, sigma: f64) -> BTreeMap<PanelRef, Count> {
    let mut counts: BTreeMap<PanelRef, Count> = BTreeMap::new();
    let whitening = Whitening { sigma, ..scale(problem) };
    let limit = whitening.outlier_limit();
    for (block, off) in problem.blocks.iter().zip(deviations(problem, &whitening)) {
        let count = counts.entry(block.panel).or_default();
        off.into_iter().for_each(|off| count.add(off > limit));
    }
    counts
}

/// The panel that stands out most among those that are not known to be wrong.
fn worst_panel(problem: &Problem, sigma: f64, wrong: &BTreeSet<PanelRef>) -> Option<PanelRef> {
    let mut counts = panel_counts(problem, sigma);
    counts.retain(|panel, _| !wrong.contains(panel));
    let all = counts.values().copied().fold(Count::default(), sum);
    let most = counts.into_iter().filter(|(_, count)| count.stands_out(all));
    most.max_by(|a, b| a.1.share().total_cmp(&b.1.share())).map(|(panel, _)| panel)
}

/// Walks to where most corners agree: with a loss that lets go of those far off, narrower in every
/// round.
fn narrowed(mut problem: Problem) -> Option<Walked> {
    let mut sigma = f64::INFINITY;
    for _ in 0..MOST_ROUNDS {
        let mut whitening = scale(&problem);
        if whitening.sigma > STILL * sigma {
            break;
        }
        sigma = whitening.sigma;
        whitening.sigma *= NARROW;
        problem = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)?.problem;
    }
    let mut whitening = Whitening { sigma, ..scale(&problem) };
    if let Some(apart) = to_larger_crowd(&problem) {
        (problem, whitening) = apart;
    }
    let none_left_out = vec![false; problem.blocks.len()];
    let gross = with_gross_errors(&problem, &none_left_out, &whitening);
    let some_stand_out = gross.concat().contains(&true);
    Some(Walked { problem, sigma: whitening.sigma, some_stand_out })
}

/// Follows the nearest corners of every frame away from between two crowds; `None` where there are not two.
fn to_larger_crowd(problem: &Problem) -> Option<(Problem, Whitening)> {
    let between = scale(problem);
    let (mut found, mut whitening) = (problem.clone(), between.clone());
    for _ in 0..MOST_ROUNDS {
        let part = found.with_corners(&nearest_of_frames(&found, &whitening));
        let of_part = scale(&part);
        found = found.at(&minimise(part, &of_part, Loss::Squared, Until::Rough)?.problem);
        let before = std::mem::replace(&mut whitening, scale(&found)).sigma;
        if whitening.sigma > STILL * before {
            break;
        }
    }
    (whitening.sigma < SHRUNK * between.sigma).then_some((found, whitening))
}

/// Which corners are the nearest of their frames, [`FOLLOWED`] of them or as many as a pose needs.
fn nearest_of_frames(problem: &Problem, whitening: &Whitening) -> Vec<Vec<bool>> {
    let off = deviations(problem, whitening);
    let mut of_frames = vec![Vec::new(); problem.frames.len()];
    for (block, off) in problem.blocks.iter().zip(&off) {
        of_frames[block.frame].extend_from_slice(off);
    }
    let farthest = of_frames.into_iter().map(|mut off| {
        off.sort_by(f64::total_cmp);
        let followed = (FOLLOWED * off.len() as f64).ceil() as usize;
        off.get(followed.max(LEAST_CORNERS).min(off.len()).saturating_sub(1)).copied()
    });
    let farthest: Vec<f64> = farthest.map(Option::unwrap_or_default).collect();
    let of_block = |(block, off): (&Block, &Vec<f64>)| {
        off.iter().map(|off| *off <= farthest[block.frame] && off.is_finite()).collect()
    };
    problem.blocks.iter().zip(&off).map(of_block).collect()
}

/// How far a panel that took no part is from its place: where its own corners have it while all
/// others stay. `None` where no place explains them.
fn moved(settled: &Settled, panel: PanelRef) -> Option<Moved> {
    let Settled { problem, whitening, outliers, .. } = settled;
    let of_panel = || problem.blocks.iter().filter(|block| block.panel == panel);
    let places = of_panel().filter_map(|block| {
        let unknowns = &problem.cameras[block.camera];
        let camera_from_panel = planar_pose(&unknowns.camera, &block.observations)?;
        let camera_from_scene = unknowns.camera_from_rig.after(&problem.frames[block.frame]);
        let camera_from_target = camera_from_scene.after(&problem.scene_from_target(panel));
        Some(camera_from_target.inverse().after(&camera_from_panel))
    });
    let places: Vec<Pose> = places.collect();
    let start = if places.is_empty() { return None } else { middle(&places) };
    let stated = problem.panels[panel.index()].target_from_panel;
    let counting: Vec<Vec<bool>> = problem
        .blocks
        .iter()
        .zip(outliers)
        .map(|(block, outliers)| outliers.iter().map(|far| block.panel == panel || !far).collect())
        .collect();
    let mut free = problem.with_corners(&counting);
    free.panels[panel.index()].target_from_panel = start;
    free.panels[panel.index()].pose_free = true;
    let found = narrowed(free)?.problem;
    let mut count = Count::default();
    for (block, off) in found.blocks.iter().zip(deviations(&found, whitening)) {
        if block.panel == panel {
            off.into_iter().for_each(|off| count.add(off > whitening.outlier_limit()));
        }
    }
    let place = found.panels[panel.index()].target_from_panel;
    let seen = || of_panel().flat_map(|block| &block.observations).map(|seen| seen.panel_mm);
    let middle = seen().sum::<DVec3>() / seen().count().max(1) as f64;
    (2 * count.outliers < count.corners).then(|| Moved {
        by_mm: place.apply(middle).distance(stated.apply(middle)),
        turned_rad: place.rotation.angle_between(stated.rotation),
    })
}

/// The views without corners that lie far beyond their pictures, and what was left out.
pub(super) fn within_pictures(views: &[View], camera: usize) -> (Vec<View>, Vec<Finding>) {
    let mut found = Vec::new();
    let of_view = |view: &View| {
        let size = DVec2::from(view.size_px.map(f64::from));
        let is_within = |pixel: DVec2| {
            pixel.cmpge(-BEYOND * size).all() && pixel.cmple((1.0 + BEYOND) * size).all()
        };
        let sightings = view.sightings.iter().map(|sighting| {
            let within = sighting.observations.iter().filter(|seen| is_within(seen.pixel));
            Sighting { panel: sighting.panel, observations: within.copied().collect() }
        });
        let sightings = sightings.filter(|sighting| !sighting.observations.is_empty());
        let within = View { sightings: sightings.collect(), ..view.clone() };
        let (corners, left) = (view.corner_count(), within.corner_count());
        if left < corners {
            let shared = Shared::Beyond { camera, view: view.name.clone() };
            let outliers = corners - left;
            found.push(Finding { shared, outliers, corners, left_out: true });
        }
        (left == corners || left >= LEAST_CORNERS).then_some(within)
    };
    (views.iter().filter_map(of_view).collect(), found)
}
