//! What a calibration is worth, as one page to look at: a self-contained HTML file with plots,
//! tables and words on what would make it better.
//!
//! ```text
//!   estimate ─── survey ─→ what the views of a camera cover and show ─┬─ fit, distortion, board_residuals, scene ─→ SVG
//!   diagnoses ───────────→ why it does not fit ───────────────────────├─ advice ───────────────────→ words
//!   photographs ─────────→ thumbnails and a sample ───────────────────├─ models, parameters, views ─→ tables
//!   models that were tried ───────────────────────────────────────────┴─ page ─────────────────────→ HTML
//! ```
//!
//! Limits: tilts are those of planar targets; a solid shows its faces at all of them.

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
mod target_map;
mod thumbnail;
mod views;

use std::collections::BTreeMap;

use crate::export::calibration::Print;
use deltille_core::calibrate::{CameraEstimate, Candidate, Diagnosis, Estimate, PanelPlace, Words};

pub use advice::{Advice, Weight, advice};
pub use field::{comparison_svg, uncertainty_svg};
pub use sample::Sample;
pub use survey::{Survey, SurveyedView};
pub use target_map::target_map_svg;
pub use thumbnail::thumbnail;
pub use views::shown_views;

/// What the page about a calibration shows.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report<'a> {
    /// Its headline, such as the name of the camera.
    pub title: &'a str,
    /// The calibration.
    pub estimate: &'a Estimate,
    /// What is to be said about it.
    pub diagnoses: &'a [Diagnosis],
    /// Where the target's file has its panels.
    pub stated: &'a [PanelPlace],
    /// What is known of the print.
    pub print: Print,
    /// Small pictures of the views, by camera and name, as PNG; see [`thumbnail`].
    pub thumbnails: BTreeMap<(usize, String), Vec<u8>>,
    /// A photograph of each camera, with and without distortion, by camera; see [`Sample::of`].
    pub samples: BTreeMap<usize, Sample>,
    /// Models that were tried, by camera; see [`Calibration::compare_models`].
    ///
    /// [`Calibration::compare_models`]: deltille_core::calibrate::Calibration::compare_models
    pub models: &'a [Vec<Candidate>],
}

impl<'a> Report<'a> {
    /// A page of an estimate of which nothing else is known.
    pub fn new(title: &'a str, estimate: &'a Estimate) -> Self {
        let (diagnoses, stated, print) = (&[], &[], Print::default());
        let (thumbnails, samples, models) = (BTreeMap::new(), BTreeMap::new(), &[]);
        Self { title, estimate, diagnoses, stated, print, thumbnails, samples, models }
    }

    /// The page as HTML in one file, with its pictures within.
    pub fn html(&self) -> String {
        page::html(self)
    }

    /// Whether there are several cameras.
    fn is_rig(&self) -> bool {
        self.estimate.cameras.len() > 1
    }

    fn words(&self) -> Words<'_> {
        Words::new(self.estimate, self.print.scale)
    }

    /// A camera on views that were held out.
    fn held_out(&self, camera: usize) -> Option<&CameraEstimate> {
        self.estimate.held_out.as_ref()?.cameras.get(camera)
    }
}
