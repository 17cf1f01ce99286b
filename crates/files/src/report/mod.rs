//! What a calibration is worth, as one page to look at: a self-contained HTML file with plots,
//! tables and words on what would make it better.
//!
//! ```text
//!   solution ─ survey ─→ what the views cover and show ─┬─ plots ──→ SVG
//!       └───── causes ─→ why it does not fit ───────────├─ advice ─→ words
//!                                                       └─ page ───→ HTML
//! ```
//!
//! Limits: tilts are those of planar targets; a solid shows its faces at all of them.

mod advice;
mod axes;
mod causes;
mod findings;
mod page;
mod plots;
mod survey;
mod thumbnail;

use std::collections::BTreeMap;

use crate::export::calibration::Print;
use deltille_core::calibrate::{Model, Remedy, Solution};

pub use advice::{Advice, Weight, advice};
pub use causes::{Given, cannot_tell_apart, causes, causes_of_rig};
pub use findings::Named;
pub use survey::{Survey, SurveyedView};
pub use thumbnail::thumbnail;

/// What a page tells.
#[derive(Clone, Debug)]
pub struct Report<'a> {
    /// Its headline, such as the name of the camera.
    pub title: &'a str,
    /// Name of the camera model.
    pub model: &'a str,
    /// The calibration.
    pub solution: &'a Solution,
    /// The same camera on views that took no part in it.
    pub holdout: Option<&'a Solution>,
    /// What is known of the print.
    pub print: Print,
    /// A smaller model that holds the lens as well, where parameters cannot be told apart.
    pub sufficient: Option<Model>,
    /// What makes it fit where it does not.
    pub remedy: Option<Remedy>,
    /// Small pictures of the views, by name, as PNG; see [`thumbnail`].
    pub thumbnails: BTreeMap<String, Vec<u8>>,
}

impl Report<'_> {
    /// The page.
    pub fn html(&self) -> String {
        page::html(self)
    }
}
