//! What a calibration is worth, as one page to look at: a self-contained HTML file with plots,
//! tables and words on what would make it better.
//!
//! ```text
//!   solution ─ survey ─→ what the views cover and show ─┬─ plots ──→ SVG
//!                                                       ├─ advice ─→ words
//!                                                       └─ page ───→ HTML
//! ```
//!
//! Limits: tilts are those of planar targets; a solid shows its faces at all of them.

mod advice;
mod axes;
mod page;
mod plots;
mod survey;
mod thumbnail;

use std::collections::BTreeMap;

use crate::calibrate::Solution;

pub use advice::{Advice, Weight, advice};
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
    /// Whether the scale of the print was measured.
    pub scale_measured: bool,
    /// Small pictures of the views, by name, as PNG; see [`thumbnail`].
    pub thumbnails: BTreeMap<String, Vec<u8>>,
}

impl Report<'_> {
    /// The page.
    pub fn html(&self) -> String {
        page::html(self)
    }
}
