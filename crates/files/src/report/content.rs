//! What the page is made of.

use std::collections::BTreeMap;

use crate::export::calibration::Print;
use crate::report::pictures::sample::Sample;
use deltille_calibrate::{CameraEstimate, Candidate, Diagnosis, Estimate, PanelPlace, Words};

/// The contents of the page about a calibration.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report<'a> {
    /// Headline, such as the name of the camera.
    pub title: &'a str,
    /// The calibration.
    pub estimate: &'a Estimate,
    /// Diagnoses of the calibration.
    pub diagnoses: &'a [Diagnosis],
    /// Poses of the panels as the target file states them.
    pub stated: &'a [PanelPlace],
    /// What is known of the print.
    pub print: Print,
    /// Thumbnails of the views as PNG, by index of the camera and name of the view; see
    /// [`thumbnail`](super::thumbnail()).
    pub thumbnails: BTreeMap<(usize, String), Vec<u8>>,
    /// A photograph of each camera with and without distortion, by index of the camera; see
    /// [`Sample::of`].
    pub samples: BTreeMap<usize, Sample>,
    /// Lens models that were tried, for each camera; see [`Calibration::compare_models`].
    ///
    /// [`Calibration::compare_models`]: deltille_calibrate::Calibration::compare_models
    pub models: &'a [Vec<Candidate>],
}

impl<'a> Report<'a> {
    /// A page of an estimate without any of the optional contents.
    pub fn new(title: &'a str, estimate: &'a Estimate) -> Self {
        let (diagnoses, stated, print) = (&[], &[], Print::default());
        let (thumbnails, samples, models) = (BTreeMap::new(), BTreeMap::new(), &[]);
        Self { title, estimate, diagnoses, stated, print, thumbnails, samples, models }
    }

    /// Whether there are several cameras.
    pub(super) fn is_rig(&self) -> bool {
        self.estimate.cameras.len() > 1
    }

    /// What the target is called: a board has one panel, and solids and scenes have several.
    pub(super) fn target_noun(&self) -> &'static str {
        if self.has_panels() { "target" } else { "board" }
    }

    /// Whether the target has several panels.
    pub(super) fn has_panels(&self) -> bool {
        self.estimate.panels.len() > 1
    }

    pub(super) fn words(&self) -> Words<'_> {
        Words::new(self.estimate, self.print.scale)
    }

    /// A camera on the held-out views.
    pub(super) fn held_out(&self, camera: usize) -> Option<&CameraEstimate> {
        self.estimate.held_out.as_ref()?.cameras.get(camera)
    }
}
