//! The report of a calibration: a self-contained HTML page with plots, tables and advice.
//!
//! Input: an estimate, its diagnoses, photographs and compared models, as a [`Report`]. Output: one HTML file.
//! Data passes through the files and folders in this order:
//!
//! 1. `measures` computes statistics that are not part of the estimate: coverage, offsets of corners, distortion.
//! 2. `pictures` makes thumbnails and a sample of the photographs.
//! 3. `content` defines the contents of the page.
//! 4. `plots` draws SVG, and `advice` suggests how to improve the calibration.
//! 5. `sections` puts tables and plots under headlines, with the elements of `html`.
//! 6. `page` assembles the verdict, the advice and the sections of each camera.
//!
//! `certificate` is the page of an acceptance test, which has its own style and one plot.
//!
//! A module imports only from those above it in this list, or from `html`; no imports are circular.
//!
//! Limits: the tilt of a view is shown for planar targets only, because the faces of a solid have different tilts.

mod advice;
mod certificate;
mod content;
mod html;
mod measures;
mod page;
mod pictures;
mod plots;
mod sections;

pub use advice::{Advice, Weight, advice};
pub use certificate::Certificate;
pub use content::{Report, camera_notes};
pub use measures::survey::{Survey, SurveyedView};
pub use pictures::sample::Sample;
pub use pictures::thumbnail::thumbnail;
pub use plots::field::{comparison_svg, uncertainty_svg};
pub use plots::target_map::target_map_svg;
pub use sections::views::shown_views;
