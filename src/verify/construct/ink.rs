//! How much there is to draw on a page. Lines that cross it a thousand times, or a thousand areas
//! on top of each other, keep a renderer busy for hours, and no target has them.

use kurbo::BezPath;

/// Length of all contours over the area of the page, 1/mm: tags in all tiles, with cells of
/// 0.1 mm, have less.
const MOST_PER_MM: f64 = 40.0;

/// Area around all contours in pages: tiles and cells have one each, and do not overlap.
const MOST_PAGES: f64 = 40.0;

/// What is on a page so far, in its own units.
pub(super) struct Ink {
    /// Area of the page.
    page: f64,
    /// Millimetres in a unit.
    mm: f64,
    length: f64,
    area: f64,
}

impl Ink {
    /// An empty page of this width and height, with so many millimetres in a unit.
    pub fn new([width, height]: [f64; 2], mm: f64) -> Self {
        Self { page: width * height, mm, length: 0.0, area: 0.0 }
    }

    /// Adds a filled path, or one that is drawn by a pen of some width.
    pub fn add(&mut self, path: &BezPath, pen: Option<f64>) {
        let segments = path.segments();
        // Control points lie no nearer than the curve.
        let lengths = segments.map(|segment| {
            let points = segment.to_cubic();
            let [a, b, c, d] = [points.p0, points.p1, points.p2, points.p3];
            a.distance(b) + b.distance(c) + c.distance(d)
        });
        let (mut length, mut count) = (0.0, 0.0);
        for one in lengths {
            (length, count) = (length + one, count + 1.0);
        }
        match pen {
            // Either side of the line, and the ends or corners.
            Some(width) => {
                self.length += 2.0 * length + 4.0 * width * count;
                self.area += width * (length + width * count);
            }
            None => {
                self.length += length;
                self.area += path.control_box().area();
            }
        }
    }

    /// Whether a target may have so much.
    pub fn is_drawable(&self) -> bool {
        // Negations, so that what is no number is refused too.
        self.length <= MOST_PER_MM * self.mm * self.page && self.area <= MOST_PAGES * self.page
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_covered_some_times_and_not_often() {
        let page = kurbo::Shape::to_path(&kurbo::Rect::new(0.0, 0.0, 100.0, 100.0), 0.1);
        let mut ink = Ink::new([100.0, 100.0], 1.0);
        (0..10).for_each(|_| ink.add(&page, None));
        assert!(ink.is_drawable());
        (0..40).for_each(|_| ink.add(&page, None));
        assert!(!ink.is_drawable());
        let mut ink = Ink::new([100.0, 100.0], 1.0);
        ink.add(&page, Some(1e9));
        assert!(!ink.is_drawable());
    }
}
