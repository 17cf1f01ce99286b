//! Model selection: finds the wrong assumption that explains the lack of fit of a calibration (lens
//! model, flat board, panel poses, known camera), and a smaller lens model that suffices.
//!
//! Each alternative is fitted to a sample of the views and compared by an F test. Its effect has to
//! be significant and large enough to matter.

use std::collections::BTreeSet;

use crate::adjust::lack_of_fit::{MATTERS, SIGNIFICANT, deviate_of_f};
use crate::estimate::values::{CameraEstimate, Estimate, ViewEstimate};
use crate::input::calibration::{Calibration, CameraViews};
use crate::input::intrinsics::Intrinsics;
use crate::input::observation::View;
use crate::input::panel::PanelPrior;
use crate::input::sample::evenly;
use crate::model::Model;
use crate::problem::whitening::{MEDIAN_OF_CHI_SQUARED_2, OUTLIER_SIGMA};
use deltille_core::camera::{Camera, PROJECTION_PARAMETERS};
use deltille_core::statistics::median;

/// If the noise of detections explains more than this fraction of the squared residuals, the rest
/// does not matter, and no remedy is tested.
const EXPLAINED: f64 = 1.0 / (1.0 + MATTERS * MATTERS);

/// A remedy counts as equal to the best one if it reaches this fraction of its gain: the sum of
/// squares of a thousand corners is known to a few per cent.
const AS_GOOD: f64 = 0.9;

/// Number of views in the sample, evenly spaced over the sequence. A lack of fit that matters is
/// visible in this many views, and a test must not take longer than the calibration.
const TRIAL_VIEWS: usize = 12;

/// Largest residual of a given camera, as a fraction of the image width. Poses absorb most of the effect of a wrong
/// focal length or principal point; only another lens, zoom or crop leaves more.
pub(super) const FOREIGN_PART: f64 = 0.005;

/// A change of assumptions that makes the residuals of a calibration significantly smaller.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Remedy {
    /// The quantity that was estimated instead of being assumed.
    pub alternative: Alternative,
    /// RMS residual per axis without the remedy, outliers excluded, px.
    pub from_px: f64,
    /// RMS residual per axis with the remedy, outliers excluded, px.
    pub to_px: f64,
    /// Number of excluded views that a richer model fits as well as the others; 0 if the remedy explains the residuals
    /// of the views that were kept.
    pub excluded_views: usize,
}

/// The quantity to estimate instead of assuming it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Alternative {
    /// The lens, with this richer model.
    Model(Model),
    /// The deviation of the board from a plane.
    Shape,
    /// The poses of the panels on the target.
    Panels,
    /// The intrinsics of the camera, which had been given.
    Camera,
    /// The parameters of the camera without its constraints.
    Constraints,
}

impl Alternative {
    /// Whether it changes what the calibration assumes about the lens.
    pub(super) fn is_of_lens(self) -> bool {
        matches!(self, Self::Model(_) | Self::Constraints)
    }
}

/// The separate calibration of one camera, and its estimate.
pub(super) type Alone = Option<(Calibration, Estimate)>;

/// Minimum number of excluded views that show that the lens departs from its model: a richer model can fit a single wrong view by
/// its additional parameters.
const EXCLUDED_VIEWS: usize = 2;

/// Number of coefficients of a lens, k1 and k2, that are estimated instead of none.
const PLAIN_COEFFICIENTS: usize = 2;

impl Calibration {
    /// This calibration of one camera with other views.
    pub(crate) fn of_views(&self, views: Vec<View>) -> Self {
        let camera = CameraViews { views, ..self.cameras[0].clone() };
        self.of_cameras(vec![camera]).covariance_of_all(false)
    }

    /// This calibration without constraints; `None` if it has none.
    pub(crate) fn unconstrained(&self) -> Option<Self> {
        let is_constrained = self.cameras.iter().any(|of| !of.constraints.is_empty());
        let free = |of: &CameraViews| CameraViews { constraints: Vec::new(), ..of.clone() };
        let cameras = || self.cameras.iter().map(free).collect();
        is_constrained.then(|| self.of_cameras(cameras()).covariance_of_all(false))
    }

    /// This calibration of one camera with other intrinsics.
    fn of_intrinsics(&self, intrinsics: impl Into<Intrinsics>) -> Self {
        let intrinsics = intrinsics.into();
        let camera = CameraViews { intrinsics, ..self.cameras[0].clone() };
        self.of_cameras(vec![camera]).covariance_of_all(false)
    }

    /// A sample of the views of a calibration of one camera, on which alternatives are tested, and
    /// its estimate.
    fn trial(&self, found: &Estimate) -> Option<(Self, Estimate)> {
        let views = &self.cameras[0].views;
        let sample = self.of_views(evenly(views, TRIAL_VIEWS).cloned().collect());
        let of_sample = match sample.cameras[0].views.len() < views.len() {
            true => sample.adjusted().ok()?,
            false => found.clone(),
        };
        Some((sample, of_sample))
    }

    /// The alternative that explains the residuals of a calibration of one camera significantly
    /// better, and by an amount that matters, or that also fits views which were excluded. `None` if the noise of
    /// detections explains the residuals and no view was excluded, or if no alternative does.
    pub(super) fn remedy(&self, found: &Estimate) -> Option<Remedy> {
        let of_residuals = || match &self.cameras[0].intrinsics {
            _ if is_explained(found) => None,
            Intrinsics::Unknown(model) => self.remedy_of_found(*model, found),
            Intrinsics::Known(camera) => self.remedy_of_known(camera, found),
            Intrinsics::Near { .. } => None,
        };
        lens_first(of_residuals(), || self.remedy_of_excluded(found))
    }

    /// The richer model that fits most of the excluded views as well as this one fits the others. Corners with wrong
    /// labels, or of another camera, fit no model; so the excluded corners are right, and the lens departs from the
    /// model where they lie.
    fn remedy_of_excluded(&self, found: &Estimate) -> Option<Remedy> {
        let model = self.cameras[0].intrinsics.model()?;
        let excluded = found.excluded.iter().filter(|out| out.may_be_of_lens());
        let excluded: BTreeSet<&str> = excluded.map(|out| out.view.as_str()).collect();
        let is_out = |view: &&View| excluded.contains(view.name.as_str());
        let (out, kept): (Vec<&View>, Vec<&View>) = self.cameras[0].views.iter().partition(is_out);
        let out: Vec<&View> = evenly(&out, TRIAL_VIEWS).copied().collect();
        if out.len() < EXCLUDED_VIEWS {
            return None;
        }
        let sample = evenly(&kept, TRIAL_VIEWS).chain(&out).map(|view| (*view).clone());
        let trial = self.of_views(sample.collect());
        let from_px = found.inlier_rms_px();
        model.richer().iter().find_map(|&model| {
            let other = trial.of_intrinsics(model).adjusted().ok()?;
            let to_px = other.inlier_rms_px();
            let fits = |view: &&ViewEstimate| {
                let outliers = view.corners.iter().filter(|corner| corner.outlier).count();
                excluded.contains(view.name.as_str()) && 2 * outliers < view.corners.len()
            };
            let excluded_views = other.cameras[0].views.iter().filter(fits).count();
            let fits_as_well = to_px * to_px < (1.0 + MATTERS * MATTERS) * from_px * from_px;
            (fits_as_well && 2 * excluded_views > out.len()).then_some(Remedy {
                alternative: Alternative::Model(model),
                from_px,
                to_px,
                excluded_views,
            })
        })
    }

    fn remedy_of_found(&self, model: Model, found: &Estimate) -> Option<Remedy> {
        let (trial, tried_on) = self.trial(found)?;
        let models = model
            .richer()
            .iter()
            .map(|&model| (Alternative::Model(model), trial.of_intrinsics(model).adjusted().ok()));
        // Even a strongly bent board does not cause residuals this large.
        let bends = self.panels.len() == 1 && !self.board_shape && !is_absurd(&found.cameras[0]);
        let shape =
            bends.then(|| (Alternative::Shape, trial.clone().board_shape(true).adjusted().ok()));
        let free =
            trial.unconstrained().map(|trial| (Alternative::Constraints, trial.adjusted().ok()));
        let shows_several = trial.cameras[0].views.iter().any(|view| view.sightings.len() > 1);
        let places = shows_several.then(|| (Alternative::Panels, trial.with_panels_found()));
        let tried = free.into_iter().chain(shape).chain(models).chain(places);
        let tried = tried.filter_map(|(alternative, other)| Some((alternative, other?)));
        let from_px = found.inlier_rms_px();
        // The sample may exclude views that the whole calibration includes.
        let best = lens_first(best(&tried_on, tried), || trial.remedy_of_excluded(&tried_on));
        let best = best.filter(|remedy| remedy.to_px < from_px)?;
        Some(Remedy { from_px, excluded_views: 0, ..best })
    }

    /// The same if the camera was given: either it is another camera, or the board is bent.
    fn remedy_of_known(&self, camera: &Camera, found: &Estimate) -> Option<Remedy> {
        let values = camera.parameters();
        let of_lens = PROJECTION_PARAMETERS.len();
        // Without any distortion, it is not known which coefficients the lens has.
        let is_plain = values.iter().skip(of_lens).all(|value| *value == 0.0);
        let least = if is_plain { of_lens + PLAIN_COEFFICIENTS } else { of_lens };
        let free = values.iter().enumerate().map(|(i, value)| i < least || *value != 0.0);
        let near = Intrinsics::Near { camera: camera.clone(), free: free.collect() };
        let bent = (self.panels.len() == 1).then(|| self.clone().board_shape(true).adjusted().ok());
        let bent = bent.flatten().map(|other| (Alternative::Shape, other));
        let other = self.of_intrinsics(near).board_shape(false).adjusted().ok();
        best(found, bent.into_iter().chain(other.map(|other| (Alternative::Camera, other))))
    }

    /// The estimate with the poses of the panels as the views determine them.
    fn with_panels_found(&self) -> Option<Estimate> {
        // Each view becomes a separate frame, regardless of its name.
        let views = self.cameras[0].views.iter().enumerate();
        let views = views.map(|(index, view)| View { name: format!("{index:06}"), ..view.clone() });
        let panels = self.of_views(views.collect()).refine_panels(true).adjusted().ok()?.panels;
        let stated = |place: &PanelPrior| place.target_from_panel.into();
        let panels = panels.iter().map(stated).collect();
        Self { panels, ..self.clone() }.adjusted().ok()
    }

    /// Indices of the given cameras of a rig that contradict their own images:
    /// they are other cameras, or have changed since they were calibrated. Empty for a single
    /// camera.
    pub(crate) fn foreign_cameras(&self) -> Vec<usize> {
        let is_foreign = |&index: &usize| {
            let alone = self.alone(index, &self.panels);
            let is_known = matches!(self.cameras[index].intrinsics, Intrinsics::Known(_));
            let remedy = || alone.remedy(&alone.adjusted().ok()?);
            is_known && remedy().is_some_and(|remedy| remedy.alternative == Alternative::Camera)
        };
        match self.cameras.len() {
            1 => Vec::new(),
            count => (0..count).filter(is_foreign).collect(),
        }
    }

    /// The separate calibration of one camera, with the estimated panel poses, and its estimate.
    pub(super) fn and_alone(&self, camera: usize, found: &Estimate) -> Alone {
        if self.is_single() {
            return Some((self.clone(), found.clone()));
        }
        self.cameras.get(camera)?;
        let alone = self.alone(camera, &found.panels);
        let found = alone.adjusted().ok()?;
        Some((alone, found))
    }

    /// The smallest lens model, among those with a subset of the parameters, that fits camera
    /// `camera` as well as the model of `found`, according to an F test; `None` if all
    /// parameters are needed, or the intrinsics were given.
    pub fn sufficient_model(&self, camera: usize, found: &Estimate) -> Option<Model> {
        let (alone, found) = self.and_alone(camera, found)?;
        alone.sufficient(&found)
    }

    /// The same for a calibration of one camera.
    ///
    /// Without q parameters, the sum of squares grows by F q variances of a residual; with noise alone, F is about 1.
    pub(super) fn sufficient(&self, found: &Estimate) -> Option<Model> {
        let (trial, of_trial) = self.trial(found)?;
        let mut sufficient = None;
        let mut next = self.cameras[0].intrinsics.model()?.smaller();
        while let Some(model) = next {
            let smaller = trial.of_intrinsics(model).adjusted();
            if !smaller.is_ok_and(|smaller| fits_as_well(&smaller, &of_trial)) {
                break;
            }
            sufficient = Some(model);
            next = model.smaller();
        }
        sufficient
    }
}

/// Whether the residuals of a camera are so large that it cannot have taken the images.
pub(super) fn is_absurd(camera: &CameraEstimate) -> bool {
    camera.inlier_rms_px() > FOREIGN_PART * f64::from(camera.camera.width)
}

/// Whether the noise of detections explains the residuals.
pub(super) fn is_explained(found: &Estimate) -> bool {
    let of_noise = |common: f64| 1.0 - (common / found.inlier_rms_px()).powi(2);
    found.common_px.is_some_and(|common| of_noise(common) > EXPLAINED)
}

/// A remedy that residuals suggest if it concerns the lens, or else the one that excluded views suggest.
fn lens_first(
    of_residuals: Option<Remedy>,
    of_excluded: impl FnOnce() -> Option<Remedy>,
) -> Option<Remedy> {
    let is_of_lens = |remedy: &Remedy| {
        remedy.alternative.is_of_lens() || remedy.alternative == Alternative::Camera
    };
    of_residuals.filter(is_of_lens).or_else(of_excluded).or(of_residuals)
}

fn best(found: &Estimate, tried: impl Iterator<Item = (Alternative, Estimate)>) -> Option<Remedy> {
    let from_px = found.inlier_rms_px();
    let better = tried.filter_map(|(alternative, other)| {
        let gain = gain(found, &other, alternative)?;
        let to_px = other.inlier_rms_px();
        Some((gain, Remedy { alternative, from_px, to_px, excluded_views: 0 }))
    });
    let better: Vec<_> = better.collect();
    let most = better.iter().map(|(gain, _)| *gain).fold(0.0, f64::max);
    // Alternatives with fewer parameters come first.
    better.into_iter().find(|(gain, _)| *gain > AS_GOOD * most).map(|(_, remedy)| remedy)
}

/// The factor by which the mean square residual shrinks; `None` if the reduction is not significant
/// or does not matter. In both fits, outliers of the better fit count as residuals at the outlier
/// limit. So neither outliers nor a larger number of outliers count as a gain.
fn gain(found: &Estimate, other: &Estimate, alternative: Alternative) -> Option<f64> {
    let squares = |estimate: &Estimate| -> Vec<f64> {
        estimate.corners().map(|corner| corner.residual.length_squared()).collect()
    };
    let variance = median(squares(other)).unwrap_or(0.0) / MEDIAN_OF_CHI_SQUARED_2;
    let most = OUTLIER_SIGMA * OUTLIER_SIGMA * variance;
    let mean = |estimate: &Estimate| {
        let squares = squares(estimate);
        squares.iter().map(|square| square.min(most)).sum::<f64>() / squares.len() as f64
    };
    let of_panels = match alternative {
        Alternative::Panels => 6.0 * (panel_count(other) - 1.0),
        _ => 0.0,
    };
    let unknowns = |estimate: &Estimate| estimate.unknown_count() as f64;
    let frames = |estimate: &Estimate| estimate.frames.len();
    let gain = mean(found) / mean(other);
    let more = (unknowns(other) + of_panels - unknowns(found)).max(1.0);
    let freedom = (2 * other.corner_count()) as f64
        - unknowns(other)
        - of_panels
        - 6.0 * frames(other) as f64;
    let is_confirmed = deviate_of_f((gain - 1.0) * freedom / more, more, freedom) > SIGNIFICANT;
    let is_of_all = frames(other) >= frames(found);
    let is_smaller = other.inlier_rms_px() < found.inlier_rms_px();
    (is_of_all && is_confirmed && is_smaller && gain > 1.0 + MATTERS * MATTERS).then_some(gain)
}

/// Number of panels that were seen.
fn panel_count(estimate: &Estimate) -> f64 {
    estimate.corners().map(|corner| corner.panel.index()).collect::<BTreeSet<usize>>().len() as f64
}

fn fits_as_well(smaller: &Estimate, found: &Estimate) -> bool {
    let names = |estimate: &Estimate| -> Vec<String> {
        estimate.frames.iter().map(|frame| frame.name.clone()).collect()
    };
    if names(smaller) != names(found) {
        return false;
    }
    let (mut own, mut other, mut count) = (0.0, 0.0, 0.0);
    for (a, b) in found.corners().zip(smaller.corners()) {
        // An outlier of the smaller model may be due to its lack of fit.
        if !a.outlier {
            own += a.residual.length_squared();
            other += b.residual.length_squared();
            count += 2.0;
        }
    }
    let parameters = |estimate: &Estimate| estimate.cameras[0].unknown_count() as f64;
    let less = parameters(found) - parameters(smaller);
    let freedom = count - parameters(found) - 6.0 * found.frames.len() as f64;
    let f_ratio = (other - own).max(0.0) / less / (own / freedom);
    deviate_of_f(f_ratio, less, freedom) < SIGNIFICANT
}
