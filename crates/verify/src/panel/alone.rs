//! Detection of a single panel without tags, with all else left out.

use glam::DVec2;

use crate::verifier::detector_config;
use deltille_core::detection::Detection;
use deltille_core::polygon;
use deltille_core::raster::{Gray, ImageView, Intensity};
use deltille_core::targets::Panel;
use deltille_detect::Detector;

/// An unlabelled corner is taken for a stated one within this many edges of it: less than half the
/// way to the next.
pub(crate) const MATCH_EDGES: f64 = 0.25;

/// How much of what is around the tiles of a panel is looked at with it alone, in edges: less than any corner lies within.
const ALONE_EDGES: f64 = 0.05;

/// What is looked at of a panel without tags where it is looked at alone: its tiles and a little more, mm.
pub(crate) fn outline_alone(panel: &Panel) -> Vec<DVec2> {
    panel.outline_around_mm(ALONE_EDGES * panel.edge_mm)
}

/// Corners of a panel without tags whose neighbours are left out: a grid may go on over a fold, where nothing tells
/// faces apart. `outline_px` is convex.
pub(crate) fn detect_alone<T: Intensity>(
    panel: &Panel,
    mut image: Gray<T>,
    white: T,
    outline_px: &[DVec2],
) -> Detection
where
    for<'a> &'a Gray<T>: Into<ImageView<'a>>,
{
    let width = image.width();
    let turn = polygon::area(outline_px).signum();
    for (index, value) in image.pixels_mut().iter_mut().enumerate() {
        let place = DVec2::new((index % width) as f64, (index / width) as f64);
        let mut sides = outline_px.iter().zip(outline_px.iter().cycle().skip(1));
        if sides.any(|(p, q)| turn * (q - p).perp_dot(place - p) < 0.0) {
            *value = white;
        }
    }
    Detector::for_grid(panel.kind, None, detector_config()).detect(&image, "panel")
}
