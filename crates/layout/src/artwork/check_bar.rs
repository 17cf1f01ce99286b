//! Outline of a check bar, which is measured with a ruler to determine the print scale.

use kurbo::{Affine, BezPath};

use crate::{CHECK_BAR_STROKE_MM, CheckBar};

/// Width of an end stroke along the bar, mm: slightly more than a ruler line.
pub const STROKE_WIDTH_MM: f64 = 0.3;

/// Thickness of the line that joins the end strokes, mm.
const LINE_MM: f64 = 0.2;

/// Returns the outline of a check bar in the frame of its page, mm: two end strokes, whose outer edges are at `from`
/// and `to`, joined by a thin line.
///
/// ```text
///   from ┃━━━━━━━━━━━━━━━━━━━━━━━━━━━━┃ to
/// ```
pub fn outline(bar: &CheckBar) -> BezPath {
    let (length, stroke, line) = (bar.length_mm(), CHECK_BAR_STROKE_MM / 2.0, LINE_MM / 2.0);
    let (inner, outer) = (STROKE_WIDTH_MM, length - STROKE_WIDTH_MM);
    let corners = [
        (0.0, -stroke),
        (inner, -stroke),
        (inner, -line),
        (outer, -line),
        (outer, -stroke),
        (length, -stroke),
        (length, stroke),
        (outer, stroke),
        (outer, line),
        (inner, line),
        (inner, stroke),
        (0.0, stroke),
    ];
    let mut path = BezPath::new();
    path.move_to(corners[0]);
    corners[1..].iter().for_each(|&corner| path.line_to(corner));
    path.close_path();
    let (start, along) = (bar.from_mm, (bar.to_mm - bar.from_mm) / length);
    Affine::new([along.x, along.y, -along.y, along.x, start.x, start.y]) * path
}
