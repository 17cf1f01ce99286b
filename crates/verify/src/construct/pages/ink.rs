//! Inspection of the constructs of a file against a list of those that every viewer shows alike.
//!
//! Rendering a file proves what one program shows. Scripts, animations, rules for print, layers,
//! blend modes, vertex colours or a second scene make other programs show something else. So each
//! format has a list of the constructs that its writer here uses and the reader interprets exactly;
//! anything else is named and refused, known as harmful or not. A refused file is not rendered.

use std::collections::HashSet;

use glam::DVec2;
use kurbo::{BezPath, PathEl, Shape};

/// Problem of marks outside the page: some viewers show more than the page, and then these as well.
pub(super) const OFF_PAGE: &str = "a mark that reaches over the edge of the page";

/// Most length of all contours per area of the page, 1/mm: tags in all tiles, with cells of 0.1 mm,
/// have less.
const MOST_PER_MM: f64 = 40.0;

/// Most area of the rectangles around filled paths, and of strokes, in areas of the page: those of
/// tiles and cells overlap each other little.
const MOST_PAGES: f64 = 40.0;

/// Least width of an area or a line, mm: thinner ones are drawn by some viewers as wide as a pixel,
/// and by others not at all. Cells and strokes of letters are wider.
const LEAST_WIDTH_MM: f64 = 0.01;

/// Problem of a mark that is thinner.
const THIN: &str = "a mark so thin that not all viewers draw it alike";

/// Problem of a mark on top of an equal one: where both cover a part of a pixel, some viewers draw
/// it darker.
const TWICE: &str = "a mark that is drawn twice";

/// The key by which equal marks are recognised, in units of [`LEAST_WIDTH_MM`]: its ends on each
/// side, the side of a square of its area, the diagonal along which its points lie, and the width
/// of its pen.
type Outline = [i64; 7];

/// The marks on a page so far, in units of the page.
pub(super) struct Ink {
    /// Area of the page.
    page: f64,
    /// Millimetres per unit of the page.
    mm: f64,
    /// Length of all contours so far.
    length: f64,
    /// Area of the rectangles around filled paths, and of strokes, so far.
    area: f64,
    /// The marks so far, to recognise equal ones.
    marks: HashSet<Outline>,
}

impl Ink {
    /// An empty page of this width and height, in units of `mm` millimetres.
    pub(super) fn new(size: DVec2, mm: f64) -> Self {
        Self { page: size.element_product(), mm, length: 0.0, area: 0.0, marks: HashSet::new() }
    }

    /// Adds a path that is filled by the even-odd rule, or stroked where the width of a pen is given,
    /// in units of the page; returns the problem if not all viewers draw it alike.
    pub(super) fn add(&mut self, path: &BezPath, pen: Option<f64>) -> Option<&'static str> {
        let (length, count) = length(path);
        let around = path.control_box();
        match pen {
            // Both sides of the line, and the ends or corners of each segment.
            Some(width) => {
                self.length += 2.0 * length + 4.0 * width * count;
                self.area += width * (length + width * count);
            }
            None => {
                self.length += length;
                self.area += around.area();
            }
        }
        let is_thick = self.is_thick(path, pen);
        let least = LEAST_WIDTH_MM / self.mm;
        let side = path.area().abs().sqrt();
        let middle = around.center();
        let products: Vec<f64> = path
            .elements()
            .iter()
            .filter_map(|element| element.end_point())
            .map(|point| (point.x - middle.x) * (point.y - middle.y))
            .collect();
        let product = products.iter().sum::<f64>() / products.len().max(1) as f64;
        let along = product / around.width().hypot(around.height());
        let pen = pen.unwrap_or(0.0);
        let outline = [around.x0, around.y0, around.x1, around.y1, side, along, pen];
        let is_new = self.marks.insert(outline.map(|value| (value / least).round() as i64));
        if !is_thick {
            return Some(THIN);
        }
        (!is_new).then_some(TWICE)
    }

    /// Whether the pen, or without one each contour of a filled path, is wide enough that all viewers
    /// draw it alike.
    fn is_thick(&self, path: &BezPath, pen: Option<f64>) -> bool {
        let least = LEAST_WIDTH_MM / self.mm;
        if let Some(width) = pen {
            return width >= least;
        }
        let elements = path.elements();
        let is_start = |element: &PathEl| matches!(element, PathEl::MoveTo(_));
        let contours = elements.chunk_by(|_, next| !is_start(next));
        contours.map(|contour| BezPath::from_vec(contour.to_vec())).all(|mut contour| {
            contour.close_path();
            // Twice the area over the perimeter is the width of a long rectangle.
            let width = 2.0 * contour.area().abs() / length(&contour).0;
            width >= least
        })
    }

    /// Whether the marks so far are within the bounds, so that rendering them takes little time.
    pub(super) fn is_drawable(&self) -> bool {
        // Written so that NaN is refused too.
        self.length <= MOST_PER_MM * self.mm * self.page && self.area <= MOST_PAGES * self.page
    }
}

/// The length of a path, and its number of segments. For a curve it is the length of its control
/// polygon, which is an upper bound and quick to compute.
fn length(path: &BezPath) -> (f64, f64) {
    let lengths = path.segments().map(|segment| {
        let points = segment.to_cubic();
        let [a, b, c, d] = [points.p0, points.p1, points.p2, points.p3];
        a.distance(b) + b.distance(c) + c.distance(d)
    });
    lengths.fold((0.0, 0.0), |(length, count), one| (length + one, count + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thin_marks_are_told_from_thick_ones() {
        let ink = Ink::new(DVec2::splat(100.0), 1.0);
        let is_thick = |path: &str| ink.is_thick(&BezPath::from_svg(path).unwrap(), None);
        assert!(is_thick("M0,0 L20,20 L20.1,20 L0.1,0 z"));
        assert!(!is_thick("M0,0 L20,20 L20.01,20 L0.01,0 z"));
        assert!(!is_thick("M0,0 L9,0 L0,9 z M0,0 L20,20 z"));
        assert!(!is_thick("M0,0 L20,20"));
        let line = BezPath::from_svg("M0,0 L20,20").unwrap();
        assert!(ink.is_thick(&line, Some(0.1)) && !ink.is_thick(&line, Some(1e-3)));
    }

    #[test]
    fn a_mark_is_drawn_once() {
        let mut ink = Ink::new(DVec2::splat(100.0), 1.0);
        let mut add = |path: &str, pen| ink.add(&BezPath::from_svg(path).unwrap(), pen);
        assert_eq!(add("M0,0 L20,0 L10,17 z", None), None);
        assert_eq!(add("M20,0 L40,0 L30,17 z", None), None);
        assert_eq!(add("M0,0 L20,0 L10,17 z", Some(0.1)), None);
        assert_eq!(add("M20,0 L10,17 L0,0.001 z", None), Some(TWICE));
        assert_eq!(add("M0,0 L20,20", Some(0.1)), None);
        assert_eq!(add("M0,20 L20,0", Some(0.1)), None);
        assert_eq!(add("M20,20 L0,0", Some(0.1)), Some(TWICE));
    }

    #[test]
    fn a_page_is_covered_some_times_and_not_often() {
        let page = kurbo::Shape::to_path(&kurbo::Rect::new(0.0, 0.0, 100.0, 100.0), 0.1);
        let mut ink = Ink::new(DVec2::splat(100.0), 1.0);
        (0..10).for_each(|_| _ = ink.add(&page, None));
        assert!(ink.is_drawable());
        (0..40).for_each(|_| _ = ink.add(&page, None));
        assert!(!ink.is_drawable());
        let mut ink = Ink::new(DVec2::splat(100.0), 1.0);
        ink.add(&page, Some(1e9));
        assert!(!ink.is_drawable());
    }
}
