//! The marks on a page: each wide enough and drawn once, all together few enough to be rendered quickly.

use std::collections::HashSet;

use glam::DVec2;
use kurbo::{BezPath, PathEl, Shape};

/// Problem of marks outside the page: some viewers show more than the page, including these marks.
pub(super) const OFF_PAGE: &str = "a mark that extends beyond the page";

/// Maximum length of all contours per area of the page, 1/mm: even a page with tags in all tiles
/// and cells of 0.1 mm has less.
const MAX_PER_MM: f64 = 40.0;

/// Maximum total area of strokes and of the rectangles around filled paths, in page areas: those of tiles and cells
/// overlap little.
const MAX_PAGES: f64 = 40.0;

/// Minimum width of an area or line, mm: some viewers draw thinner ones one pixel wide, others not at all. Cells and
/// letter strokes are wider.
const MIN_WIDTH_MM: f64 = 0.01;

/// Problem of a mark below [`MIN_WIDTH_MM`].
const THIN: &str = "a mark that is thinner than 0.01 mm";

/// Problem of a mark on top of an identical one: some viewers draw pixels that both partly cover darker.
const TWICE: &str = "a mark that is drawn twice";

/// Key that identifies equal marks, in units of [`MIN_WIDTH_MM`]: the bounds on each side, the side of a square of
/// equal area, the diagonal along which the points lie, and the pen width.
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
    /// The marks so far, to detect duplicates.
    marks: HashSet<Outline>,
}

impl Ink {
    /// Creates an empty page of this width and height, in units of `mm` millimetres.
    pub(super) fn new(size: DVec2, mm: f64) -> Self {
        Self { page: size.element_product(), mm, length: 0.0, area: 0.0, marks: HashSet::new() }
    }

    /// Adds a path, filled by the even-odd rule or stroked with a pen of the given width, in units of the page.
    /// Returns the problem if viewers may draw it differently.
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
        let least = MIN_WIDTH_MM / self.mm;
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

    /// Whether the pen, or without one each contour of a filled path, is wide enough to be drawn the same way by all
    /// viewers.
    fn is_thick(&self, path: &BezPath, pen: Option<f64>) -> bool {
        let least = MIN_WIDTH_MM / self.mm;
        if let Some(width) = pen {
            return width >= least;
        }
        let elements = path.elements();
        let is_start = |element: &PathEl| matches!(element, PathEl::MoveTo(_));
        let contours = elements.chunk_by(|_, next| !is_start(next));
        contours.map(|contour| BezPath::from_vec(contour.to_vec())).all(|mut contour| {
            contour.close_path();
            // The width of a long rectangle is twice its area divided by its perimeter.
            let width = 2.0 * contour.area().abs() / length(&contour).0;
            width >= least
        })
    }

    /// Whether the marks so far are within the bounds that keep rendering fast.
    pub(super) fn is_drawable(&self) -> bool {
        // Written so that NaN is rejected, too.
        self.length <= MAX_PER_MM * self.mm * self.page && self.area <= MAX_PAGES * self.page
    }
}

/// Returns the length of a path and its number of segments. The length of a curve is that of its control polygon, an
/// upper bound that is quick to compute.
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
    fn thin_marks_are_distinguished_from_thick_ones() {
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
    fn duplicate_marks_are_detected() {
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
    fn a_page_may_be_covered_ten_times_but_not_fifty() {
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
