//! What is to be said about an estimate: what is wrong with it, what that comes from, and what helps.

use super::calibration::Calibration;
use super::estimate::{CameraEstimate, Estimate};
use super::finding::Finding;
use super::lack_of_fit::LackOfFit;
use super::lens_end::LensEnd;
use super::model::Model;
use super::model_selection::{Instead, Remedy, is_explained};

/// Corners are found to a few hundredths of a pixel; a camera that leaves more than this does not
/// have the lens of the model.
const POOR_RMS_PX: f64 = 1.0;

/// A known camera that leaves more than this part of the image's width did not take the pictures: poses
/// take up most of what focal lengths and principal point are off by, and so much is left by another
/// lens, zoom or crop only.
pub(super) const FOREIGN_PART: f64 = 0.005;

/// What is to be said about an estimate. Cameras are indices.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Diagnosis {
    /// A camera that was given did not take its pictures; nothing of the estimate is of use.
    ForeignCamera {
        /// The camera.
        camera: usize,
        /// What it leaves, outliers left out, px.
        rms_px: f64,
    },
    /// The lens turns back or runs away within the image.
    LensEnds {
        /// The camera.
        camera: usize,
        /// Where.
        end: LensEnd,
    },
    /// Corners are wrong together.
    GrossErrors(Finding),
    /// Something that was taken for given explains the residuals when it is found.
    Remedied {
        /// The camera by whose views that was found.
        camera: usize,
        /// What, and by how much.
        remedy: Remedy,
    },
    /// Residuals are not noise, and nothing that was tried explains them.
    LackOfFit(LackOfFit),
    /// Residuals are large.
    PoorFit {
        /// The camera.
        camera: usize,
        /// What is left, outliers left out, px.
        rms_px: f64,
    },
    /// Parameters that the views cannot tell apart.
    IllConditioned {
        /// The camera.
        camera: usize,
        /// Their names.
        parameters: Vec<String>,
        /// A smaller model that holds the lens as well, if there is one.
        sufficient: Option<Model>,
    },
}

impl Calibration {
    /// What is to be said about what [`solve`](Self::solve) found, what matters most first. Where residuals
    /// are not noise, other models, the shape of the board, and the places of panels are tried, on a part of
    /// the views.
    pub fn diagnose(&self, found: &Estimate) -> Vec<Diagnosis> {
        // What was solved was split before.
        let own = self.split().map_or_else(|_| self.clone(), |(own, _)| own);
        let alone = own.each_alone(found);
        said(found, &alone)
    }

    /// Every camera by itself, and what its views say; `None` where they say nothing, or where there is nothing
    /// to ask.
    fn each_alone(&self, found: &Estimate) -> Vec<Alone> {
        let is_good = is_explained(found);
        let alone = found.cameras.iter().enumerate().map(|(index, camera)| {
            let has_question = !is_good || !camera.ill_conditioned.is_empty();
            has_question.then(|| self.and_alone(index, found)).flatten()
        });
        alone.collect()
    }

    /// A camera by itself, with panels where they were found, and what its views say.
    pub(super) fn and_alone(&self, camera: usize, found: &Estimate) -> Alone {
        if self.is_single() {
            return Some((self.clone(), found.clone()));
        }
        self.cameras.get(camera)?;
        let alone = self.alone(camera, &found.panels);
        let found = alone.adjusted().ok()?;
        Some((alone, found))
    }
}

impl Estimate {
    /// What is to be said about it as far as it tells that by itself, without trying anything else; see
    /// [`Calibration::diagnose`].
    pub fn inspect(&self) -> Vec<Diagnosis> {
        said(self, &vec![None; self.cameras.len()])
    }
}

/// A camera by itself, and what its views say.
type Alone = Option<(Calibration, Estimate)>;

fn said(found: &Estimate, alone: &[Alone]) -> Vec<Diagnosis> {
    let cameras = || found.cameras.iter().enumerate();
    let foreign = cameras().filter(|(_, camera)| {
        let is_known = camera.model.is_none() && camera.found().next().is_none();
        is_known && camera.inlier_rms_px() > FOREIGN_PART * f64::from(camera.camera.width)
    });
    let foreign =
        foreign.map(|(camera, of)| Diagnosis::ForeignCamera { camera, rms_px: of.inlier_rms_px() });
    let ends = cameras()
        .filter_map(|(camera, of)| Some(Diagnosis::LensEnds { camera, end: of.lens_end()? }));
    let gross = found.findings.iter().cloned().map(Diagnosis::GrossErrors);
    let open = cameras().zip(alone).filter(|((_, of), _)| !of.ill_conditioned.is_empty());
    let open = open.map(|((camera, of), alone)| Diagnosis::IllConditioned {
        camera,
        parameters: of.ill_conditioned.clone(),
        sufficient: alone.as_ref().and_then(|(alone, found)| alone.sufficient(found)),
    });
    let causes = causes(found, alone);
    foreign.chain(ends).chain(gross).chain(causes).chain(open).collect()
}

/// Why residuals are not noise.
fn causes(found: &Estimate, alone: &[Alone]) -> Vec<Diagnosis> {
    let remedies = alone.iter().enumerate().filter_map(|(camera, alone)| {
        let (alone, found) = alone.as_ref()?;
        Some((camera, alone.remedy(found)?))
    });
    let mut remedies: Vec<(usize, Remedy)> = remedies.collect();
    let of = |instead: Instead| move |(_, remedy): &(usize, Remedy)| remedy.instead == instead;
    // A wrong camera moves everything else with it.
    if remedies.iter().any(of(Instead::Camera)) {
        remedies.retain(of(Instead::Camera));
    }
    // There is one board, and one target.
    let mut told = Vec::new();
    remedies.retain(|(_, Remedy { instead, .. })| {
        let is_shared = matches!(instead, Instead::Shape | Instead::Panels);
        let is_first = !told.contains(instead);
        told.push(*instead);
        is_first || !is_shared
    });
    let is_of_target = |misfit: &&LackOfFit| matches!(misfit, LackOfFit::Target { .. });
    let of_target: Vec<&LackOfFit> = found.lack_of_fit.iter().filter(is_of_target).collect();
    // Where panels are moved their corners tell most of it.
    let panels = remedies.iter().any(of(Instead::Panels)) && !of_target.is_empty();
    if panels {
        remedies.retain(|remedy| !of(Instead::Panels)(remedy));
    }
    let told: Vec<&LackOfFit> = match (panels, remedies.is_empty()) {
        (true, _) => of_target,
        (false, true) => found.lack_of_fit.iter().collect(),
        (false, false) => Vec::new(),
    };
    let is_named = |camera: usize| {
        let is_lens =
            |m: &&LackOfFit| matches!(m, LackOfFit::Lens { camera: c, .. } if *c == camera);
        // Of a single camera anything is.
        let is_single = found.cameras.len() == 1 && !(told.is_empty() && remedies.is_empty());
        is_single || remedies.iter().any(|(of, _)| *of == camera) || told.iter().any(is_lens)
    };
    let is_poor = |(index, camera): &(usize, &CameraEstimate)| {
        camera.inlier_rms_px() > POOR_RMS_PX && !is_named(*index)
    };
    let poor = found.cameras.iter().enumerate().filter(is_poor);
    let poor: Vec<Diagnosis> = poor
        .map(|(camera, of)| Diagnosis::PoorFit { camera, rms_px: of.inlier_rms_px() })
        .collect();
    let remedied = remedies.iter().map(|&(camera, remedy)| Diagnosis::Remedied { camera, remedy });
    let told = told.into_iter().copied().map(Diagnosis::LackOfFit);
    remedied.chain(told).chain(poor).collect()
}
