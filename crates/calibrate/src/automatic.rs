//! Automatic selection of a lens model by its error on held-out views.
//!
//! Each model is calibrated from two thirds of the views and evaluated on the others, where only poses are estimated. The model
//! with the fewest parameters is selected whose error no other model undercuts by more than a tolerance, which grows with the
//! number of parameters that the other has more. A model with ill-conditioned parameters is selected only if there is no other.
//! A spline, which has hundreds of parameters, is a candidate only if there are enough corners for each parameter.

use std::collections::BTreeMap;

use super::error::{CalibrationError, ConstraintError};
use super::estimate::values::{CameraEstimate, Estimate, ViewEstimate};
use super::input::calibration::{Calibration, CameraViews};
use super::input::constraint::Constraint;
use super::input::intrinsics::Intrinsics;
use super::input::observation::View;
use super::input::sample::evenly;
use super::model::Model;
use super::problem::whitening::{MEDIAN_OF_CHI_SQUARED_2, OUTLIER_SIGMA};
use super::start::single_camera::enough;
use deltille_core::statistics::median;

/// Minimum number of corner coordinates per parameter of a spline. With fewer, the prior of its knots has as much weight as the
/// corners, and the spline is no better than a smaller model.
const COORDINATES_A_PARAMETER: usize = 10;

/// Maximum number of views used for the selection, evenly sampled.
const MAX_VIEWS: usize = 60;

/// Maximum number of views used for a comparison that is only reported.
const VIEWS_TO_COMPARE: usize = 24;

/// Every n-th view is held out.
const HELD_OUT: usize = 3;

/// A model is adequate if its mean square error exceeds that of any other model by at most this fraction for each parameter
/// that the other has more. An error of the model of 1 % of the noise variance, common to all corners, displaces a parameter by
/// as much as its standard deviation from a hundred coordinates.
const SAME_A_PARAMETER: f64 = 0.01;

/// Smallest and largest fraction: 1 and 5 % in RMS error. Below, the views that are held out decide by chance; above, the error
/// is visible.
const SAME: [f64; 2] = [0.02, 0.1];

/// A model that was compared.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Candidate {
    /// The model.
    pub model: Model,
    /// Number of parameters.
    pub parameters: usize,
    /// RMS error per axis on held-out views, px. Errors are limited to five standard deviations of the best model. `None` if
    /// the calibration did not converge.
    pub held_out_px: Option<f64>,
    /// Whether all its parameters are well-conditioned.
    pub is_stable: bool,
    /// Whether it describes the lens as well as the best one.
    pub is_adequate: bool,
    /// Whether it was selected.
    pub chosen: bool,
    /// The camera that was calibrated from the training views.
    pub found: Option<CameraEstimate>,
}

/// The errors of a model on held-out views.
struct Tried {
    /// By view, px².
    squares: BTreeMap<String, Vec<f64>>,
    is_stable: bool,
    camera: CameraEstimate,
    /// Number of estimated parameters.
    parameters: usize,
}

impl Calibration {
    /// Selects one of these models for a camera, and returns the compared candidates. A model that was given for the camera is
    /// ignored. Models without a [constrained](Self::set_constraints) parameter are not tried.
    ///
    /// # Errors
    /// Returns an error if there are too few views to hold some out, or if no model explains them.
    pub fn choose_model(
        &self,
        camera: usize,
        among: &[Model],
    ) -> Result<(Model, Vec<Candidate>), CalibrationError> {
        let count = self.cameras[camera].views.len();
        enough(count, count)?;
        let views = evenly(&self.cameras[camera].views, MAX_VIEWS);
        let coordinates: usize = views.map(|view: &View| 2 * view.corner_count()).sum();
        let of_fit = coordinates - coordinates / HELD_OUT;
        let is_enough = |model: &Model| {
            let is_spline = matches!(model, Model::Spline { .. });
            !is_spline || of_fit >= COORDINATES_A_PARAMETER * parameters(*model)
        };
        let has_all = |model: &Model| self.check_constraints(camera, *model).is_ok();
        if let (Some(&first), false) = (among.first(), among.iter().any(has_all)) {
            self.check_constraints(camera, first)?;
        }
        let models: Vec<Model> = among.iter().copied().filter(has_all).filter(is_enough).collect();
        let candidates = self.tried(camera, &models, MAX_VIEWS)?;
        let chosen = candidates.iter().find(|candidate| candidate.chosen);
        let model = chosen.map(|chosen| chosen.model).ok_or(CalibrationError::NoStart)?;
        Ok((model, candidates))
    }

    /// Compares the model of a camera with similar models on held-out views. Uses few views, so it takes no longer than the
    /// calibration. Returns no candidates for a fixed camera.
    ///
    /// # Errors
    /// Returns an error if there are too few views to hold some out, or if no model explains them.
    pub fn compare_models(&self, camera: usize) -> Result<Vec<Candidate>, CalibrationError> {
        match self.cameras[camera].intrinsics.model() {
            Some(model) => {
                let mut models = model.neighbours();
                models.retain(|model| self.check_constraints(camera, *model).is_ok());
                self.tried(camera, &models, VIEWS_TO_COMPARE)
            }
            None => Ok(Vec::new()),
        }
    }

    fn check_constraints(&self, camera: usize, model: Model) -> Result<(), ConstraintError> {
        Constraint::check(&self.cameras[camera].constraints, &Intrinsics::Unknown(model))
    }

    fn tried(
        &self,
        camera: usize,
        models: &[Model],
        most_views: usize,
    ) -> Result<Vec<Candidate>, CalibrationError> {
        let views: Vec<View> = evenly(&self.cameras[camera].views, most_views).cloned().collect();
        let alone = self.alone(camera, &self.panels);
        let of_model = |model: Model| {
            let constraints = self.cameras[camera].constraints.clone();
            let only = CameraViews { constraints, ..CameraViews::new("", views.clone(), model) };
            let calibration = alone.of_cameras(vec![only]).hold_out(Some(HELD_OUT));
            calibration.board_shape(false).measure_target(false).solve()
        };
        let tried = models.iter().map(|&model| (model, of_model(model)));
        let mut error = CalibrationError::NoStart;
        let mut found = Vec::new();
        for (model, estimate) in tried {
            let of_model = match &estimate {
                Ok(estimate) => Tried::of(estimate),
                Err(why) => {
                    error = why.clone();
                    None
                }
            };
            found.push((model, of_model));
        }
        let candidates = judged(&found);
        match candidates.iter().any(|candidate| candidate.chosen) {
            true => Ok(candidates),
            false => Err(error),
        }
    }
}

impl Tried {
    /// Returns `None` if no views were held out.
    fn of(found: &Estimate) -> Option<Self> {
        let views = found.held_out.as_deref()?.cameras.iter().flat_map(|camera| &camera.views);
        let of_view = |view: &ViewEstimate| {
            view.corners.iter().map(|corner| corner.residual.length_squared()).collect()
        };
        Some(Self {
            squares: views.map(|view| (view.name.clone(), of_view(view))).collect(),
            parameters: found.cameras.iter().map(CameraEstimate::unknown_count).sum(),
            is_stable: found.cameras.iter().all(|camera| camera.ill_conditioned.is_empty()),
            camera: found.cameras.first()?.clone(),
        })
    }
}

/// Compares models on the same corners: those of all views that any model explains.
fn judged(tried: &[(Model, Option<Tried>)]) -> Vec<Candidate> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let found = || tried.iter().filter_map(|(_, found)| found.as_ref());
    for (name, of_view) in found().flat_map(|found| &found.squares) {
        let count = counts.entry(name).or_default();
        *count = (*count).max(of_view.len());
    }
    let whole = found().filter(|found| 2 * found.squares.len() > counts.len());
    let medians =
        whole.filter_map(|found| median(found.squares.values().flatten().copied().collect()));
    let Some(least) = medians.min_by(f64::total_cmp) else {
        return tried.iter().map(|(model, _)| candidate(*model, None, false)).collect();
    };
    let most = OUTLIER_SIGMA * OUTLIER_SIGMA * least / MEDIAN_OF_CHI_SQUARED_2;
    // Means by view; a corner or a view that a model cannot project counts as an outlier.
    let means = |found: &Tried| -> Vec<f64> {
        let of_view = |(name, &count): (&&str, &usize)| {
            let squares = found.squares.get(*name).map_or(&[][..], Vec::as_slice);
            let sum = squares.iter().map(|square| square.min(most)).sum::<f64>();
            (sum + (count - squares.len()) as f64 * most) / count.max(1) as f64
        };
        counts.iter().map(of_view).collect()
    };
    let means: Vec<Option<Vec<f64>>> =
        tried.iter().map(|(_, found)| found.as_ref().map(means)).collect();
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let candidates = tried.iter().zip(&means).map(|((model, found), own)| {
        let own = own.as_deref().map(mean);
        let is_stable = found.as_ref().is_some_and(|found| found.is_stable);
        Candidate {
            found: found.as_ref().map(|found| found.camera.clone()),
            parameters: found.as_ref().map_or(parameters(*model), |found| found.parameters),
            ..candidate(*model, own.map(|own| (own / 2.0).sqrt()), is_stable)
        }
    });
    let mut candidates: Vec<Candidate> = candidates.collect();
    let are_adequate: Vec<bool> = candidates
        .iter()
        .map(|one| candidates.iter().all(|other| is_adequate(one, other)))
        .collect();
    let marked = candidates.iter_mut().zip(are_adequate);
    marked.for_each(|(candidate, is_adequate)| candidate.is_adequate = is_adequate);
    let holding = candidates.iter_mut().filter(|candidate| candidate.is_adequate);
    let chosen = holding.min_by_key(|candidate| (!candidate.is_stable, candidate.parameters));
    chosen.into_iter().for_each(|chosen| chosen.chosen = true);
    candidates
}

/// Returns whether a model is as good as another, or better.
fn is_adequate(one: &Candidate, other: &Candidate) -> bool {
    let more = other.parameters.saturating_sub(one.parameters) as f64;
    let same = (SAME_A_PARAMETER * more).clamp(SAME[0], SAME[1]);
    match (one.held_out_px, other.held_out_px) {
        (Some(one), Some(other)) => one * one <= (1.0 + same) * other * other,
        (own, _) => own.is_some(),
    }
}

fn parameters(model: Model) -> usize {
    model.free().into_iter().filter(|free| *free).count()
}

fn candidate(model: Model, held_out_px: Option<f64>, is_stable: bool) -> Candidate {
    let (parameters, is_adequate, chosen, found) = (parameters(model), false, false, None);
    Candidate { model, parameters, held_out_px, is_stable, is_adequate, chosen, found }
}
