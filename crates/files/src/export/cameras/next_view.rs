//! The next view to take, as JSON (schema `deltille/next-view/1`) and as a drawing of the outline in which to hold the board.

#[cfg(feature = "print")]
use std::fmt::Write as _;

use glam::DVec2;
use serde::Serialize;

use super::motion::Motion;
#[cfg(feature = "print")]
use crate::export::detections::overlay::{self, Outlined, OverlayError};
#[cfg(feature = "print")]
use crate::export::pages::svg::HEAD;
use deltille_calibrate::NextView;
#[cfg(feature = "print")]
use deltille_core::raster::AnyGray;

/// Schema and version that this crate writes.
pub const SCHEMA: &str = "deltille/next-view/1";

/// Colour of the outline: bright on black and on white.
#[cfg(feature = "print")]
const COLOUR: [u8; 3] = [255, 150, 0];

#[derive(Serialize)]
struct File<'a> {
    schema: &'static str,
    target: &'a str,
    views: usize,
    sufficient: bool,
    uncertainty_px: Option<f64>,
    expected_px: Option<f64>,
    description: String,
    image_size_px: [u32; 2],
    camera_from_target: Motion,
    distance_mm: f64,
    tilt_rad: f64,
    tilt_direction_rad: f64,
    roll_rad: f64,
    centre_px: DVec2,
    outlines_px: &'a [Vec<DVec2>],
    up_px: Option<[DVec2; 2]>,
    corners: Vec<Corner>,
}

#[derive(Serialize)]
struct Corner {
    panel: u32,
    row: i32,
    col: i32,
    x: f64,
    y: f64,
}

/// The text of the file: the next view to take after `views` views of a target, and whether these are enough.
pub fn write(next: &NextView, target: &str, views: usize, enough: bool) -> String {
    let corners = next.corners.iter().map(|corner| Corner {
        panel: corner.panel.id(),
        row: corner.row,
        col: corner.col,
        x: corner.pixel.x,
        y: corner.pixel.y,
    });
    let size = [next.camera.width, next.camera.height];
    let file = File {
        schema: SCHEMA,
        target,
        views,
        sufficient: enough,
        uncertainty_px: next.now_px,
        expected_px: next.expected_px,
        description: next.to_string(),
        image_size_px: size,
        camera_from_target: Motion::new(&next.camera_from_target, None),
        distance_mm: next.distance_mm,
        tilt_rad: next.tilt_rad,
        tilt_direction_rad: next.tilt_direction_rad,
        roll_rad: next.roll_rad,
        centre_px: next.at * DVec2::from(size.map(f64::from)) - 0.5,
        outlines_px: &next.outlines,
        up_px: next.upwards,
        corners: corners.collect(),
    };
    serde_json::to_string_pretty(&file).expect("plain data has a JSON form") + "\n"
}

/// The outline, an arrow towards the board's upper side and the corners as an SVG of the image size, for overlay on a live
/// image; empty if the views are enough.
#[cfg(feature = "print")]
pub fn svg(next: &NextView, enough: bool) -> String {
    let [r, g, b] = COLOUR;
    let (width, height) = (next.camera.width, next.camera.height);
    let line = line_px(next);
    let label = if enough { "enough".to_owned() } else { next.to_string() };
    let mut text = format!(
        "{HEAD}<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-0.5 -0.5 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" role=\"img\" aria-label=\"{label}\">\n"
    );
    if enough {
        return text + "</svg>\n";
    }
    let colour = format!("rgb({r},{g},{b})");
    let listed = |points: &[DVec2]| {
        let points = points.iter().map(|p| format!("{:.1},{:.1}", p.x, p.y));
        points.collect::<Vec<_>>().join(" ")
    };
    for outline in &next.outlines {
        let points = listed(outline);
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "<polygon points=\"{points}\" fill=\"{colour}\" fill-opacity=\"0.15\" stroke=\"{colour}\" \
             stroke-width=\"{line:.1}\"/>"
        );
    }
    if let Some(arrow) = arrow(next) {
        let points = listed(&arrow);
        let _ = writeln!(
            text,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{:.1}\" \
             stroke-linejoin=\"round\"/>",
            2.0 * line
        );
    }
    for corner in &next.corners {
        let DVec2 { x, y } = corner.pixel;
        let _ = writeln!(
            text,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{line:.1}\" fill=\"{colour}\"/>"
        );
    }
    text + "</svg>\n"
}

/// Like [`svg()`], but as a PNG over the last photograph. The background is black if there is none or if its size differs. If the
/// views are enough, the PNG shows only the photograph.
///
/// # Errors
/// Returns an error if the image is too large to draw on, or if it cannot be encoded.
#[cfg(feature = "print")]
pub fn png(next: &NextView, enough: bool, last: Option<&AnyGray>) -> Result<Vec<u8>, OverlayError> {
    let size = [next.camera.width, next.camera.height];
    let last = last.filter(|last| [last.width() as u32, last.height() as u32] == size);
    let corners: Vec<DVec2> = next.corners.iter().map(|corner| corner.pixel).collect();
    let drawn = Outlined {
        polygons: &next.outlines,
        line: arrow(next).map_or(Vec::new(), Vec::from),
        dots: corners,
        line_px: line_px(next),
        colour: COLOUR,
    };
    overlay::outlined(last, size, (!enough).then_some(&drawn))
}

/// An arrow from the centre of the board towards its upper side, as one line, px.
#[cfg(feature = "print")]
fn arrow(next: &NextView) -> Option<[DVec2; 5]> {
    let [from, to] = next.upwards?;
    let back = 0.25 * (from - to);
    let [left, right] = [1.0, -1.0].map(|side| to + back + side * 0.6 * back.perp());
    Some([from, to, left, to, right])
}

/// Line width that remains visible if the image is displayed at a small size, px.
#[cfg(feature = "print")]
fn line_px(next: &NextView) -> f64 {
    f64::from(next.camera.width.max(next.camera.height)) / 400.0
}
