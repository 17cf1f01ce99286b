//! The report of a calibration: a self-contained HTML page with plots, tables and advice.
//!
//! ```text
//!  estimate ─── survey ─→ coverage and mean residuals of a camera ───┬─ fit, distortion, board_residuals, scene ─→ SVG
//!  diagnoses ───────────→ reasons for lack of fit ───────────────────├─ advice ───────────────────→ words
//!  photographs ─────────→ thumbnails and a sample ───────────────────├─ models, parameters, views, rig ─→ tables
//!  models that were tried ───────────────────────────────────────────┴─ page ─────────────────────→ HTML
//! ```
//!
//! Limits: the tilt of a view is shown for planar targets only, as a solid shows faces at all
//! tilts.

mod advice;
mod axes;
mod board_residuals;
mod distortion;
mod field;
mod fit;
mod models;
mod page;
mod panels;
mod parameters;
mod plots;
mod rig;
mod sample;
mod scene;
mod survey;
mod table;
mod target_map;
mod thumbnail;
mod views;

use std::collections::BTreeMap;

use crate::export::calibration::Print;
use deltille_calibrate::{CameraEstimate, Candidate, Diagnosis, Estimate, PanelPlace, Words};

pub use advice::{Advice, Weight, advice};
pub use field::{comparison_svg, uncertainty_svg};
pub use sample::Sample;
pub use survey::{Survey, SurveyedView};
pub use target_map::target_map_svg;
pub use thumbnail::thumbnail;
pub use views::shown_views;

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
    /// [`thumbnail`].
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

    /// The page as one HTML file, with its pictures embedded.
    pub fn html(&self) -> String {
        page::html(self)
    }

    /// Whether there are several cameras.
    fn is_rig(&self) -> bool {
        self.estimate.cameras.len() > 1
    }

    /// What the target is called: a board has one panel, and solids and scenes have several.
    fn target_noun(&self) -> &'static str {
        if self.has_panels() { "target" } else { "board" }
    }

    /// Whether the target has several panels.
    fn has_panels(&self) -> bool {
        self.estimate.panels.len() > 1
    }

    fn words(&self) -> Words<'_> {
        Words::new(self.estimate, self.print.scale)
    }

    /// A camera on the held-out views.
    fn held_out(&self, camera: usize) -> Option<&CameraEstimate> {
        self.estimate.held_out.as_ref()?.cameras.get(camera)
    }
}
