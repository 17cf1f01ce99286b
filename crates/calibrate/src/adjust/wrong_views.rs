//! Detection of outliers before the final adjustment: panels, views, and panels in single views that contradict the
//! majority.
//!
//! ```text
//!   agree: all corners, with a redescending loss (Cauchy) of ever smaller scale
//!      └─→ the panel with the largest share of outliers is removed, if it stands out; repeat
//!   wrong: median error of the rest for each view, and for each panel in each view
//!   settled: the corners that are left are adjusted
//!      ├─→ a removed panel with no more outliers than others returns; back to wrong
//!      └─→ a view that contradicts the camera of all others (Chow test) is removed; back to settled
//! ```
//!
//! Outliers bias the estimate. The bias is smallest at the smallest scale of the loss that still
//! includes most corners. So the scale is reduced step by step before anything is classified as
//! wrong. If many corners are displaced together, the iteration may end between the two groups of
//! corners. From there, it continues with the corners of every frame that have the smallest
//! residuals, which mostly belong to the larger group. All decisions assume that most corners are
//! correct.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};

use super::finding::{Count, Finding, Moved, OutlierPattern, shared_outliers};
use super::lack_of_fit::lack_of_fit;
use super::reweighting::{Kept, Settled, settle, with_gross_errors};
use super::view_consistency::Consistency;
use crate::equations::minimise::{Until, minimise};
use crate::error::CalibrationError;
use crate::input::loss::Loss;
use crate::input::observation::{MIN_CORNERS, Sighting, View};
use crate::input::panel::PanelRef;
use crate::input::weights::Weights;
use crate::problem::bundle::Problem;
use crate::problem::unknowns::{Block, CameraUnknowns};
use crate::problem::whitening::{Whitening, deviations, residuals, scale};
use crate::start::pose::{estimate_pose, middle, planar_pose};
use deltille_core::camera::Pose;
use deltille_core::statistics::median;

/// Scale of the loss during the reduction, as a fraction of the usual one: 1.5 standard deviations. A wider loss ends
/// between two groups of corners.
const NARROW: f64 = 0.5;

/// The reduction ends if an iteration reduces the scale to more than this fraction of its value, or
/// after [`MAX_ROUNDS`].
const STILL: f64 = 0.98;
const MAX_ROUNDS: usize = 12;

/// Fraction of the corners of each frame that are used to leave an estimate between two groups;
/// most corners are right.
const FOLLOWED: f64 = 0.5;

/// There were two groups of corners if this reduces the scale to less than this fraction of its
/// value. With noise alone, the scale hardly shrinks.
const SHRUNK: f64 = 0.5;

/// Minimum number of panels for identifying a wrong one: with two panels, it is not known which one
/// is wrong.
const MIN_PANELS: usize = 3;

/// Distance beyond the image, in image sizes, at which a corner cannot have been detected in this
/// image.
const BEYOND: f64 = 1.0;

/// Ratio of the median residual of one camera in one frame to the usual median, above which the
/// corners contradict the others. Blur, light and distance change it by a small factor; labels that
/// are off by a tile, and images not taken at the same time, by about a hundred.
const WRONG_RATIO: f64 = 10.0;

/// Minimum median residual of wrong corners, px: every detected corner is accurate to a pixel.
const WRONG_PX: f64 = 1.0;

/// A problem at the estimate on which most of its corners agree, and the parts that contradict it.
pub(crate) struct Gross {
    pub problem: Problem,
    /// Excluded blocks.
    pub left_out: Vec<bool>,
    /// Frames that contradict the others, by index, with the reason.
    pub frames: BTreeMap<usize, WrongFrame>,
    /// The usual median residual of an image, px.
    pub usual_px: f64,
    /// Panels that are excluded in all frames.
    panels: BTreeSet<PanelRef>,
    /// The median residual of every block, px.
    off_px: Vec<f64>,
    /// See [`Kept::some_stand_out`].
    some_stand_out: bool,
}

/// The estimate on which most corners agree.
#[derive(Clone, Debug)]
struct Agreed {
    problem: Problem,
    /// The standard deviation per axis, px.
    sigma: f64,
    /// See [`Kept::some_stand_out`].
    some_stand_out: bool,
}

/// One in this many frames may show another camera; with more, it is unclear which ones do.
const FEW: usize = 10;

/// Why a frame is excluded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum WrongFrame {
    /// The corners of one camera have this median residual, px.
    Off { camera: usize, off_px: f64 },
    /// Its corners are mirrored.
    Mirrored,
    /// It shows only panels that are excluded.
    OnlyWrongPanels,
    /// It contradicts the cameras of the other frames, and shifts their estimate by this many
    /// standard deviations.
    Inconsistent { deviations: f64 },
}

impl Gross {
    /// Computes the estimate on which most corners of a problem agree, and finds the parts that do
    /// not; `None` if nothing can be adjusted.
    pub(crate) fn of(problem: Problem) -> Option<Self> {
        agree(problem).map(|(agreed, panels)| Self::without(agreed, panels))
    }

    /// Finds the frames and blocks that contradict the estimate, besides the excluded `panels`.
    fn without(agreed: Agreed, panels: BTreeSet<PanelRef>) -> Self {
        let Agreed { problem, some_stand_out, .. } = agreed;
        let residuals = residuals(&problem);
        let off_px: Vec<f64> = residuals.iter().map(median_px).collect();
        // The blocks of every image, that is, of each camera in each frame.
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

    /// Adjusts the parts that agree, after `prepare`. A panel that seemed wrong may fit after
    /// outliers have been removed; it is then included again.
    ///
    /// # Errors
    /// Returns an error if nothing can be adjusted.
    pub(crate) fn settled(
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
                return Ok(self.without_inconsistent_frames(settled, loss, settle));
            }
            let agreed = agreed_without(self.problem, &wrong).ok_or(CalibrationError::NoStart)?;
            self = Self::without(agreed, wrong);
        }
    }

    /// Excludes the few frames that contradict the cameras of the others, if the remaining frames
    /// then agree.
    fn without_inconsistent_frames(
        mut self,
        settled: Settled,
        loss: Loss,
        settle: impl Fn(&Self) -> Result<Settled, CalibrationError>,
    ) -> (Self, Settled) {
        let most = self.belonging().count().div_ceil(FEW);
        let before = self.frames.clone();
        let mut without = None;
        for _ in 0..=most {
            // Displaced panels, a bent board, or an unsuitable lens model also make views
            // contradict each other.
            let now = without.as_ref().unwrap_or(&settled);
            let can_test = self.panels.is_empty() && has_no_pattern(now);
            let Some(consistency) = can_test.then(|| Consistency::of(now, loss)).flatten() else {
                break;
            };
            match consistency
                .inconsistent
                .and_then(|(index, by)| Some((self.belonging().nth(index)?, by)))
            {
                None if consistency.agree => return (self, without.unwrap_or(settled)),
                None => break,
                Some((frame, deviations)) => {
                    self.frames.insert(frame, WrongFrame::Inconsistent { deviations });
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

    /// The frames that are not excluded.
    pub(crate) fn belonging(&self) -> impl Iterator<Item = usize> {
        (0..self.problem.frames.len()).filter(|frame| !self.frames.contains_key(frame))
    }

    /// The excluded panels that still have more outliers than others in the adjusted problem.
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

    /// The problem without its excluded frames.
    pub(crate) fn kept(&self) -> Kept {
        let belongs = |frame: usize| !self.frames.contains_key(&frame);
        let of_blocks = self.problem.blocks.iter().zip(&self.left_out);
        let left_out = of_blocks.filter(|(block, _)| belongs(block.frame)).map(|(_, out)| *out);
        let (problem, left_out) = (self.problem.with_frames(belongs), left_out.collect());
        Kept { problem, left_out, some_stand_out: self.some_stand_out, factor: None }
    }

    /// Findings: what the outliers have in common. `names` gives the name of a frame by its index
    /// in the original problem.
    pub(crate) fn findings(
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
            Finding {
                pattern: OutlierPattern::Panel { panel, moved },
                outliers,
                corners,
                is_excluded: true,
            }
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
            let pattern = OutlierPattern::PanelInView { panel, camera, view, off_px };
            found.push(Finding { pattern, outliers: corners, corners, is_excluded: true });
        }
        found.extend(shared_outliers(problem, outliers, &left_out, |frame| names(kept[frame])));
        found
    }
}

/// The median length of the residuals, px.
fn median_px<'a>(residuals: impl IntoIterator<Item = &'a DVec2>) -> f64 {
    median(residuals.into_iter().map(|r| r.length()).collect()).unwrap_or(0.0)
}

/// The median residual beyond which corners contradict the others, px, from the medians of all images.
fn limit_px(medians: &[f64]) -> f64 {
    f64::max(WRONG_RATIO * median(medians.to_vec()).unwrap_or(0.0), WRONG_PX)
}

/// The lower quartile of the lengths of the residuals, px. With wrong labels, not even a quarter of
/// the corners fit.
fn nearest_px(residuals: &[DVec2]) -> f64 {
    let mut off: Vec<f64> = residuals.iter().map(|r| r.length()).collect();
    off.sort_by(f64::total_cmp);
    off.get(off.len() / 4).copied().unwrap_or(f64::INFINITY)
}

/// The blocks whose panel faces the other way than in most views: a mirrored plane has a valid pose, from behind.
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

/// Computes the estimate on which most corners agree, without the panels that contradict most
/// others.
fn agree(problem: Problem) -> Option<(Agreed, BTreeSet<PanelRef>)> {
    let seen: BTreeSet<PanelRef> = problem.blocks.iter().map(|block| block.panel).collect();
    let mut wrong: BTreeSet<PanelRef> = BTreeSet::new();
    let all = narrowed(problem)?;
    if seen.len() < MIN_PANELS {
        return Some((all, wrong));
    }
    let mut agreed = all.clone();
    while let Some(panel) = worst_panel(&agreed.problem, agreed.sigma, &wrong) {
        wrong.insert(panel);
        // If half of the panels are wrong, the images show another target.
        if 2 * wrong.len() >= seen.len() {
            return Some((all, BTreeSet::new()));
        }
        agreed = agreed_without(agreed.problem, &wrong)?;
    }
    Some((agreed, wrong))
}

/// Computes the estimate on which most corners agree without the panels in `wrong`. Frames that
/// show these panels get new poses first, because the wrong panels biased their poses.
fn agreed_without(mut problem: Problem, wrong: &BTreeSet<PanelRef>) -> Option<Agreed> {
    let of_wrong = problem.blocks.iter().filter(|block| wrong.contains(&block.panel));
    let frames: BTreeSet<usize> = of_wrong.map(|block| block.frame).collect();
    frames.into_iter().for_each(|frame| reestimate_pose(&mut problem, frame, wrong));
    let mut part = problem.part(|_, block| !wrong.contains(&block.panel));
    let agreed = narrowed(part.problem)?;
    part.problem = agreed.problem;
    problem.take(part);
    Some(Agreed { problem, ..agreed })
}

/// Whether residuals show no lack of fit: they are independent of the position in the image and on the target.
fn has_no_pattern(settled: &Settled) -> bool {
    lack_of_fit(&settled.minimum.problem, &settled.whitening).is_empty()
}

/// Re-estimates the pose of a frame from the panels that are not wrong, and keeps the better pose by median residual.
fn reestimate_pose(problem: &mut Problem, frame: usize, wrong: &BTreeSet<PanelRef>) {
    let is_right = |block: &&Block| block.frame == frame && !wrong.contains(&block.panel);
    let off_px = |problem: &Problem| {
        let blocks = problem.blocks.iter().filter(is_right);
        let residuals = blocks.flat_map(|block| problem.residuals(block));
        median(residuals.map(|r| r.map_or(f64::INFINITY, |r| r.length())).collect()).unwrap_or(0.0)
    };
    let blocks = problem.blocks.iter().filter(is_right);
    let Some(largest) = blocks.clone().max_by_key(|block| block.observations.len()) else { return };
    let sightings = blocks
        .filter(|block| block.camera == largest.camera)
        .map(|block| Sighting { panel: block.panel, observations: block.observations.to_vec() });
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

/// Of the panels not yet known to be wrong, the one with the largest fraction of outliers, if it
/// stands out.
fn worst_panel(problem: &Problem, sigma: f64, wrong: &BTreeSet<PanelRef>) -> Option<PanelRef> {
    let mut counts = panel_counts(problem, sigma);
    counts.retain(|panel, _| !wrong.contains(panel));
    let all = counts.values().copied().fold(Count::default(), sum);
    let most = counts.into_iter().filter(|(_, count)| count.stands_out(all));
    most.max_by(|a, b| a.1.share().total_cmp(&b.1.share())).map(|(panel, _)| panel)
}

/// Computes the estimate on which most corners agree, with a redescending loss whose scale shrinks
/// in every iteration.
fn narrowed(mut problem: Problem) -> Option<Agreed> {
    let mut sigma = f64::INFINITY;
    for _ in 0..MAX_ROUNDS {
        let mut whitening = scale(&problem);
        if whitening.sigma > STILL * sigma {
            break;
        }
        sigma = whitening.sigma;
        whitening.sigma *= NARROW;
        problem = minimise(problem, &whitening, Loss::Cauchy, Until::Rough)?.problem;
    }
    let mut whitening = Whitening { sigma, ..scale(&problem) };
    if let Some(apart) = to_larger_group(&problem) {
        (problem, whitening) = apart;
    }
    let none_left_out = vec![false; problem.blocks.len()];
    let gross = with_gross_errors(&problem, &none_left_out, &whitening);
    let some_stand_out = gross.concat().contains(&true);
    Some(Agreed { problem, sigma: whitening.sigma, some_stand_out })
}

/// Computes a new estimate from the corners with the smallest residuals of every frame, if the
/// estimate is between two groups of corners; `None` if there is only one group.
fn to_larger_group(problem: &Problem) -> Option<(Problem, Whitening)> {
    let between = scale(problem);
    let (mut found, mut whitening) = (problem.clone(), between.clone());
    for _ in 0..MAX_ROUNDS {
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

/// Marks the corners with the smallest residuals of each frame: the fraction [`FOLLOWED`], or as
/// many as a pose needs.
fn nearest_of_frames(problem: &Problem, whitening: &Whitening) -> Vec<Vec<bool>> {
    let off = deviations(problem, whitening);
    let mut of_frames = vec![Vec::new(); problem.frames.len()];
    for (block, off) in problem.blocks.iter().zip(&off) {
        of_frames[block.frame].extend_from_slice(off);
    }
    let farthest = of_frames.into_iter().map(|mut off| {
        off.sort_by(f64::total_cmp);
        let followed = (FOLLOWED * off.len() as f64).ceil() as usize;
        off.get(followed.max(MIN_CORNERS).min(off.len()).saturating_sub(1)).copied()
    });
    let farthest: Vec<f64> = farthest.map(Option::unwrap_or_default).collect();
    let of_block = |(block, off): (&Block, &Vec<f64>)| {
        off.iter().map(|off| *off <= farthest[block.frame] && off.is_finite()).collect()
    };
    problem.blocks.iter().zip(&off).map(of_block).collect()
}

/// The displacement of an excluded panel: the difference between its stated pose and the pose that
/// its own corners determine together with the inliers of all other panels. `None` if no pose
/// explains its corners.
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
    let seen = || of_panel().flat_map(|block| block.observations.iter()).map(|seen| seen.panel_mm);
    let middle = seen().sum::<DVec3>() / seen().count().max(1) as f64;
    (2 * count.outliers < count.corners).then(|| Moved {
        by_mm: place.apply(middle).distance(stated.apply(middle)),
        rotation_rad: place.rotation.angle_between(stated.rotation),
    })
}

/// The views of a camera without the corners that lie far outside their images, and a finding for
/// each view that had corners like these. Views with too few corners left are omitted.
pub(crate) fn within_pictures(views: &[View], camera: usize) -> (Vec<View>, Vec<Finding>) {
    let mut found = Vec::new();
    let of_view = |view: &View| {
        let size = DVec2::from(view.size_px.map(f64::from));
        let is_within = |pixel: DVec2| {
            pixel.cmpge(-BEYOND * size).all() && pixel.cmple((1.0 + BEYOND) * size).all()
        };
        let mut seen = view.sightings.iter().flat_map(|sighting| &sighting.observations);
        if seen.all(|seen| is_within(seen.pixel))
            && view.sightings.iter().all(|of| !of.observations.is_empty())
        {
            return Some(view.clone());
        }
        let sightings = view.sightings.iter().map(|sighting| {
            let within = sighting.observations.iter().filter(|seen| is_within(seen.pixel));
            Sighting { panel: sighting.panel, observations: within.copied().collect() }
        });
        let sightings = sightings.filter(|sighting| !sighting.observations.is_empty());
        let within = View { sightings: sightings.collect(), ..view.clone() };
        let (corners, left) = (view.corner_count(), within.corner_count());
        if left < corners {
            let pattern = OutlierPattern::OutsideImage { camera, view: view.name.clone() };
            let outliers = corners - left;
            found.push(Finding { pattern, outliers, corners, is_excluded: true });
        }
        (left == corners || left >= MIN_CORNERS).then_some(within)
    };
    (views.iter().filter_map(of_view).collect(), found)
}
