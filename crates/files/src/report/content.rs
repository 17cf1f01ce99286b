//! Contents of the page.

use std::collections::BTreeMap;

use crate::export::calibration::Print;
use crate::report::pictures::sample::Sample;
use deltille_calibrate::{
    CameraEstimate, Candidate, Diagnosis, Estimate, Messages, PanelPrior, PoseUncertainty,
};
use deltille_core::detection::Detection;
use deltille_core::raster::CameraNotes;

/// The contents of the report of a calibration.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report<'a> {
    /// Headline, for example the name of the camera.
    pub title: &'a str,
    /// The calibration.
    pub estimate: &'a Estimate,
    /// Diagnoses of the calibration.
    pub diagnoses: &'a [Diagnosis],
    /// Poses of the panels as the target file states them.
    pub stated: &'a [PanelPrior],
    /// Measurements of the print.
    pub print: Print,
    /// Thumbnails of the views as PNG, by index of the camera and name of the view; see
    /// [`thumbnail`](super::thumbnail()).
    pub thumbnails: BTreeMap<(usize, String), Vec<u8>>,
    /// A photograph of each camera with and without distortion, by index of the camera; see
    /// [`Sample::of`].
    pub samples: BTreeMap<usize, Sample>,
    /// Metadata of the photographs of each camera, by index of the camera.
    pub notes: BTreeMap<usize, CameraNotes>,
    /// Lens models compared for each camera; see [`Calibration::compare_models`].
    ///
    /// [`Calibration::compare_models`]: deltille_calibrate::Calibration::compare_models
    pub models: &'a [Vec<Candidate>],
    /// Uncertainties of poses of the targets; see [`Estimate::pose_uncertainties`].
    pub poses: &'a [PoseUncertainty],
}

/// Returns the metadata of the photographs of a camera that state its focal length; `None` if there are none.
pub fn camera_notes<'a>(
    detections: impl IntoIterator<Item = &'a Detection>,
) -> Option<CameraNotes> {
    let mut notes = detections.into_iter().filter_map(|found| found.file.camera.as_ref());
    notes.find(|notes| notes.focal_mm.is_some() && notes.focal_35mm_mm.is_some()).cloned()
}

impl<'a> Report<'a> {
    /// Creates a report of an estimate without optional contents.
    pub fn new(title: &'a str, estimate: &'a Estimate) -> Self {
        let (diagnoses, stated, print) = (&[], &[], Print::default());
        let (thumbnails, samples, notes) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        let (models, poses) = (&[], &[]);
        Self {
            title,
            estimate,
            diagnoses,
            stated,
            print,
            thumbnails,
            samples,
            notes,
            models,
            poses,
        }
    }

    /// Whether there are several cameras.
    pub(super) fn is_rig(&self) -> bool {
        self.estimate.cameras.len() > 1
    }

    /// Returns the noun for the target: a board has one panel, solids and scenes have several.
    pub(super) fn target_noun(&self) -> &'static str {
        if self.has_panels() { "target" } else { "board" }
    }

    /// Whether the target has several panels.
    pub(super) fn has_panels(&self) -> bool {
        self.estimate.panels.len() > 1
    }

    pub(super) fn words(&self) -> Messages<'_> {
        Messages::new(self.estimate, self.print.scale)
    }

    /// The camera with the given index, evaluated on the held-out views.
    pub(super) fn held_out(&self, camera: usize) -> Option<&CameraEstimate> {
        self.estimate.held_out.as_ref()?.cameras.get(camera)
    }
}
