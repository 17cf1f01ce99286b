//! What would make a calibration fit that does not: what it takes for given is found instead.

use std::collections::BTreeSet;

use super::error::CalibrationError;
use super::loss::Loss;
use super::misfit::{MATTERS, SIGNIFICANT, deviate_of_f};
use super::rig::{PanelPlace, RigOptions, RigViews, calibrate_rig};
use super::solution::{Corner, Solution};
use super::solve::{self, Options, calibrated};
use super::start::evenly;
use super::view::View;
use super::weights::{MEDIAN_OF_CHI_SQUARED_2, OUTLIER_SIGMA, Weights};
use super::{Model, SHAPE_COEFFICIENTS};
use crate::camera::{Camera, PROJECTION_PARAMETERS, Pose};
use crate::statistics::median;

/// Where detections explain at least this part of the squares of the residuals, nothing is sought: what is
/// left beside them does not matter, whatever it is.
const EXPLAINED: f64 = 1.0 / (1.0 + MATTERS * MATTERS);

/// A remedy is as good as the best if it gains this part of what that does: squares of a thousand corners
/// are known to a few in a hundred.
const AS_GOOD: f64 = 0.9;

/// Views that are calibrated anew, evenly over the sequence: what matters shows in so many, and trying must
/// not take longer than the calibration itself.
const TRIAL_VIEWS: usize = 12;

/// The views on which other calibrations are tried, and what this one makes of them.
pub(super) fn trial(
    views: &[View],
    panels: &[Pose],
    options: Options,
    solution: &Solution,
) -> Option<(Vec<View>, Solution)> {
    let sample: Vec<View> = evenly(views, TRIAL_VIEWS).cloned().collect();
    let of_sample = match sample.len() < views.len() {
        true => calibrated(&sample, panels, options, solution.shape.is_some()).ok()?,
        false => solution.clone(),
    };
    Some((sample, of_sample))
}

/// What makes the residuals of a calibration smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Remedy {
    /// What was found that had been given.
    pub instead: Instead,
    /// Root mean square error of a coordinate then, outliers left out, px.
    pub rms_px: f64,
}

/// What is to be found instead of taken for given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instead {
    /// A lens of another model.
    Model(Model),
    /// The shape of the board's sheet.
    Shape,
    /// The places of the target's panels.
    Panels,
    /// The camera itself.
    Camera,
}

/// What explains a calibration's residuals better, by more than chance and so much that it matters;
/// `None` where they are what detections lead to expect, or nothing here does.
pub fn remedy(
    views: &[View],
    panels: &[Pose],
    options: Options,
    solution: &Solution,
) -> Option<Remedy> {
    if is_explained(solution) {
        return None;
    }
    let with_shape = solution.shape.is_some();
    let (views, tried_on) = trial(views, panels, options, solution)?;
    let models = options.model.richer().iter().map(|&model| {
        let other = calibrated(&views, panels, Options { model, ..options }, with_shape);
        (Instead::Model(model), other)
    });
    let shape = (panels.len() == 1 && !with_shape)
        .then(|| (Instead::Shape, calibrated(&views, panels, options, true)));
    let places = views
        .iter()
        .any(|view| view.sightings.len() > 1)
        .then(|| (Instead::Panels, with_panels_found(&views, panels, options)));
    let tried = shape.into_iter().chain(models).chain(places);
    let tried = tried.filter_map(|(instead, other)| Some((instead, other.ok()?)));
    best(&tried_on, tried).filter(|found| found.rms_px < solution.inlier_rms_px())
}

/// The calibration with the panels where the views have them.
fn with_panels_found(
    views: &[View],
    panels: &[Pose],
    options: Options,
) -> Result<Solution, CalibrationError> {
    let Options { model, loss, weights } = options;
    let stated = |&target_from_panel: &Pose| PanelPlace { target_from_panel, covariance: None };
    let stated: Vec<PanelPlace> = panels.iter().map(stated).collect();
    let camera = RigViews { name: String::new(), views: views.to_vec(), known: None };
    let with_panels = RigOptions { model, loss, weights, refine_target: true };
    let found = calibrate_rig(&[camera], &stated, with_panels)?;
    let places: Vec<Pose> = found.panels.iter().map(|place| place.target_from_panel).collect();
    calibrated(views, &places, options, false)
}

/// The same where the camera was given: whether it is another one, or the board is bent.
pub fn remedy_of_given(
    views: &[View],
    panels: &[Pose],
    camera: &Camera,
    loss: Loss,
    weights: Weights,
    solution: &Solution,
) -> Option<Remedy> {
    if is_explained(solution) {
        return None;
    }
    let values = camera.parameters().into_iter().enumerate();
    let of_lens = |(i, value): (usize, f64)| i < PROJECTION_PARAMETERS.len() || value != 0.0;
    let free: Vec<bool> = values.map(of_lens).collect();
    let kept = vec![false; free.len()];
    let with = |free, shape| solve::given(views, panels, camera, loss, weights, free, shape).ok();
    let shape = if panels.len() == 1 { with(kept, true) } else { None };
    let shape = shape.map(|other| (Instead::Shape, other));
    let other = with(free, false).map(|other| (Instead::Camera, other));
    best(solution, shape.into_iter().chain(other))
}

fn is_explained(solution: &Solution) -> bool {
    let of_noise = |common: f64| 1.0 - (common / solution.inlier_rms_px()).powi(2);
    solution.common_px.is_some_and(|common| of_noise(common) > EXPLAINED)
}

fn best(solution: &Solution, tried: impl Iterator<Item = (Instead, Solution)>) -> Option<Remedy> {
    let better = tried.filter_map(|(instead, other)| {
        let gain = gain(solution, &other, instead)?;
        Some((gain, Remedy { instead, rms_px: other.inlier_rms_px() }))
    });
    let better: Vec<_> = better.collect();
    let most = better.iter().map(|(gain, _)| *gain).fold(0.0, f64::max);
    // Those with fewer parameters come first.
    better.into_iter().find(|(gain, _)| *gain > AS_GOOD * most).map(|(_, remedy)| remedy)
}

/// How many times smaller the mean square is. What is an outlier where the fit is better counts as just
/// one in both, so that wild corners are no gain; nor is it one to call more of them wild.
fn gain(solution: &Solution, other: &Solution, instead: Instead) -> Option<f64> {
    let squares = |solution: &Solution| -> Vec<f64> {
        let of = |corner: &Corner| corner.residual.iter().map(|r| r * r).sum::<f64>();
        solution.views.iter().flat_map(|view| &view.corners).map(of).collect()
    };
    let variance = median(squares(other)).unwrap_or(0.0) / MEDIAN_OF_CHI_SQUARED_2;
    let most = OUTLIER_SIGMA * OUTLIER_SIGMA * variance;
    let mean = |solution: &Solution| {
        let squares = squares(solution);
        squares.iter().map(|square| square.min(most)).sum::<f64>() / squares.len() as f64
    };
    let unknowns = |solution: &Solution| {
        let of_shape = if solution.shape.is_some() { SHAPE_COEFFICIENTS } else { 0 };
        (solution.found().count() + of_shape) as f64
    };
    let of_panels = match instead {
        Instead::Panels => 6.0 * (panel_count(other) - 1.0),
        Instead::Model(_) | Instead::Shape | Instead::Camera => 0.0,
    };
    let gain = mean(solution) / mean(other);
    let more = (unknowns(other) + of_panels - unknowns(solution)).max(1.0);
    let freedom = (2 * other.corner_count()) as f64
        - unknowns(other)
        - of_panels
        - 6.0 * other.views.len() as f64;
    let is_sure = deviate_of_f((gain - 1.0) * freedom / more, more, freedom) > SIGNIFICANT;
    let is_of_all = other.views.len() >= solution.views.len();
    let is_smaller = other.inlier_rms_px() < solution.inlier_rms_px();
    (is_of_all && is_sure && is_smaller && gain > 1.0 + MATTERS * MATTERS).then_some(gain)
}

/// How many panels were seen.
fn panel_count(solution: &Solution) -> f64 {
    let corners = solution.views.iter().flat_map(|view| &view.corners);
    corners.map(|corner| corner.panel.index()).collect::<BTreeSet<usize>>().len() as f64
}
