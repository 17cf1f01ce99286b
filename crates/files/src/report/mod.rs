//! The report of a calibration: a self-contained HTML page with plots, tables and advice.
//!
//! Comes in: an estimate, its diagnoses, photographs and the models that were tried, as a [`Report`]. Goes out: one HTML file.
//! Data meets the files and folders in this order:
//!
//! 1. `measures` has what is shown beside the estimate itself: coverage, offsets of corners, distortion.
//! 2. `pictures` makes thumbnails and a sample of the photographs.
//! 3. `content` is all that the page is made of.
//! 4. `plots` draws SVG, `advice` says in words what would improve the calibration.
//! 5. `sections` puts tables and plots under headlines, with the elements of `html`.
//! 6. `page` puts the verdict, the advice and all sections of each camera together.
//!
//! A module imports from those above it in this list, or from `html`, never in a circle.
//!
//! Limits: the tilt of a view is shown for planar targets only, as a solid shows faces at all
//! tilts.

mod advice;
mod content;
mod html;
mod measures;
mod page;
mod pictures;
mod plots;
mod sections;

pub use advice::{Advice, Weight, advice};
pub use content::Report;
pub use measures::survey::{Survey, SurveyedView};
pub use pictures::sample::Sample;
pub use pictures::thumbnail::thumbnail;
pub use plots::field::{comparison_svg, uncertainty_svg};
pub use plots::target_map::target_map_svg;
pub use sections::views::shown_views;
