//! Clipping of shapes to a rectangle, for sheets that are larger than the paper.

use kurbo::{BezPath, PathEl, Point, Rect, Shape as _};

use super::{Paint, Shape};

/// Maximum deviation of the line segments that replace curves across the border of a window, mm.
const FLATNESS_MM: f64 = 0.001;

/// Minimum width of a clipped area, mm; narrower remnants are omitted. Some viewers draw a mark this thin one pixel
/// wide, others not at all, and the adjacent page shows the whole area.
const SLIVER_MM: f64 = 0.02;

/// Returns the part of a shape inside a window, mm; `None` if the shape is outside. Shapes entirely inside keep their
/// curves.
pub(super) fn clip(shape: Shape, window: Rect) -> Option<Shape> {
    let bounds = shape.path.bounding_box();
    if window.union(bounds) == window {
        return Some(shape);
    }
    let outside = bounds.x0 > window.x1
        || bounds.x1 < window.x0
        || bounds.y0 > window.y1
        || bounds.y1 < window.y0;
    if outside {
        return None;
    }
    let closed = shape.paint == Paint::Fill;
    let mut path = BezPath::new();
    for line in polylines(&shape.path) {
        if closed {
            let part = clip_polygon(line, window);
            if width(&part) >= SLIVER_MM {
                append(&mut path, &part, true);
            }
        } else {
            let segments =
                line.windows(2).filter_map(|ends| clip_segment([ends[0], ends[1]], window));
            segments.for_each(|segment| append(&mut path, &segment, false));
        }
    }
    (!path.is_empty()).then_some(Shape { path, ..shape })
}

/// Returns twice the area of a polygon divided by its perimeter: the width of a long shape.
fn width(polygon: &[Point]) -> f64 {
    let sides = || polygon.iter().zip(polygon.iter().cycle().skip(1));
    let area: f64 = sides().map(|(a, b)| 0.5 * a.to_vec2().cross(b.to_vec2())).sum();
    let perimeter: f64 = sides().map(|(a, b)| a.distance(*b)).sum();
    2.0 * area.abs() / perimeter.max(f64::MIN_POSITIVE)
}

fn append(path: &mut BezPath, points: &[Point], close: bool) {
    let [first, rest @ ..] = points else { return };
    path.move_to(*first);
    rest.iter().for_each(|&point| path.line_to(point));
    if close {
        path.close_path();
    }
}

/// Converts the contours of a path to polylines.
fn polylines(path: &BezPath) -> Vec<Vec<Point>> {
    let mut lines = Vec::<Vec<Point>>::new();
    kurbo::flatten(path, FLATNESS_MM, |element| match element {
        PathEl::MoveTo(p) => lines.push(vec![p]),
        PathEl::LineTo(p) => lines.last_mut().into_iter().for_each(|line| line.push(p)),
        _ => {}
    });
    lines
}

/// Returns the distances of a point from the four sides of a rectangle, positive inside.
fn depths(p: Point, window: Rect) -> [f64; 4] {
    [p.x - window.x0, window.x1 - p.x, p.y - window.y0, window.y1 - p.y]
}

/// Clips a polygon to a rectangle, one side after the other (Sutherland and Hodgman 1974). If several parts result,
/// coincident lines along the border join them; they enclose no area.
fn clip_polygon(mut polygon: Vec<Point>, window: Rect) -> Vec<Point> {
    for side in 0..4 {
        let depth = |p: Point| depths(p, window)[side];
        let mut inside = Vec::with_capacity(polygon.len() + 4);
        let Some(&last) = polygon.last() else {
            return polygon;
        };
        let mut from = last;
        for &to in &polygon {
            let (a, b) = (depth(from), depth(to));
            if (a < 0.0) != (b < 0.0) {
                inside.push(from.lerp(to, a / (a - b)));
            }
            if b >= 0.0 {
                inside.push(to);
            }
            from = to;
        }
        polygon = inside;
    }
    polygon
}

/// Returns the part of a line segment inside a rectangle; `None` if it is outside.
fn clip_segment([from, to]: [Point; 2], window: Rect) -> Option<[Point; 2]> {
    let (mut start, mut end) = (0.0f64, 1.0f64);
    for (a, b) in depths(from, window).into_iter().zip(depths(to, window)) {
        if a < 0.0 && b < 0.0 {
            return None;
        }
        let at = a / (a - b);
        if a < 0.0 {
            start = start.max(at);
        } else if b < 0.0 {
            end = end.min(at);
        }
    }
    (start < end).then(|| [from.lerp(to, start), from.lerp(to, end)])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::artwork::Part;

    proptest! {
        /// Clipping preserves the winding number of every point inside the window.
        #[test]
        fn clipping_keeps_the_winding_of_every_point(
            points in prop::collection::vec((-3e4f64..3e4, -3e4f64..3e4), 3..9),
            x in -0.99e4f64..0.99e4, y in -0.99e4f64..0.99e4,
        ) {
            let mut path = BezPath::new();
            append(&mut path, &points.iter().map(|&p| Point::from(p)).collect::<Vec<_>>(), true);
            let window = Rect::new(-1e4, -1e4, 1e4, 1e4);
            let whole = Shape { part: Part::Label { index: 0 }, paint: Paint::Fill, path };
            let at = Point::new(x, y);
            let clipped = clip(whole.clone(), window);
            let winding = clipped.as_ref().map_or(0, |shape| shape.path.winding(at));
            prop_assert_eq!(winding, whole.path.winding(at));
            if let Some(shape) = clipped {
                let bounds = shape.path.bounding_box();
                prop_assert_eq!(window.inflate(1e-6, 1e-6).union(bounds), window.inflate(1e-6, 1e-6));
            }
        }
    }

    #[test]
    fn strokes_end_at_the_border() {
        let mut path = BezPath::new();
        append(&mut path, &[Point::new(-2.0, 0.5), Point::new(2.0, 0.5)], false);
        let paint = Paint::Stroke { width_mm: 0.1 };
        let shape = Shape { part: Part::Label { index: 0 }, paint, path };
        let clipped = clip(shape.clone(), Rect::new(-1.0, -1.0, 1.0, 1.0)).unwrap();
        assert_eq!(clipped.path.bounding_box(), Rect::new(-1.0, 0.5, 1.0, 0.5));
        assert!(clip(shape, Rect::new(-1.0, 0.6, 1.0, 1.0)).is_none());
    }
}
