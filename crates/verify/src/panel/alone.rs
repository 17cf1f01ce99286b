//! Detection of a single panel without tags, with everything else masked.

use glam::DVec2;

use crate::verifier::detector_config;
use deltille_core::detection::Detection;
use deltille_core::polygon;
use deltille_core::raster::{Gray, ImageView, Intensity};
use deltille_core::targets::Panel;
use deltille_detect::Detector;

/// Distance within which an unlabelled corner is matched to a stated one, in edges: less than half the way to the
/// next.
pub(crate) const MATCH_EDGES: f64 = 0.25;

/// Margin around the tiles of a panel that is detected alone, in edges: no corner lies this close to the outline.
const ALONE_EDGES: f64 = 0.05;

/// Returns the outline of the unmasked area of a panel without tags that is detected alone: its
/// tiles and a small margin, mm.
pub(crate) fn outline_alone(panel: &Panel) -> Vec<DVec2> {
    panel.outline_around_mm(ALONE_EDGES * panel.edge_mm)
}

/// Detects the corners of a panel without tags while its neighbours are masked: a grid may continue over a fold,
/// where nothing distinguishes the faces. `outline_px` is convex.
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
