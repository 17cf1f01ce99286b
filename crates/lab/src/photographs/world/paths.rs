//! Vertices of the paths of a PDF page, from the operators of its content stream.
//!
//! The parser supports only the operators that filled paths need: the matrix of the graphics state,
//! moves, lines, curves, rectangles and closing of contours. It ignores text, images and nested
//! forms.

use glam::DVec2;
use lopdf::content::Content;
use lopdf::{Document, Object};
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

use crate::photographs::PhotographError;

const MM_PER_PT: f64 = 25.4 / 72.0;

/// A matrix of the content stream, a b c d e f: x' = a x + c y + e, y' = b x + d y + f.
type Matrix = [f64; 6];

const IDENTITY: Matrix = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

/// The vertices of all contours of a page, mm from its lower left corner, y up.
pub(crate) struct Vertices(RTree<GeomWithData<[f64; 2], usize>>);

impl Vertices {
    /// Reads the first page of a PDF.
    pub(super) fn of_first_page(pdf: &[u8]) -> Result<Self, PhotographError> {
        let unreadable = |error: lopdf::Error| PhotographError::Paths(error.to_string());
        let document = Document::load_mem(pdf).map_err(unreadable)?;
        let page = document.page_iter().next();
        let page =
            page.ok_or_else(|| PhotographError::Paths("the document has no page".to_owned()))?;
        let stream = document.get_page_content(page);
        let content = Content::decode(&stream).map_err(unreadable)?;
        Ok(Self::of(&content))
    }

    fn of(content: &Content) -> Self {
        let mut contours =
            Contours { matrix: IDENTITY, saved: Vec::new(), found: Vec::new(), count: 0 };
        for operation in &content.operations {
            let numbers: Vec<f64> = operation.operands.iter().filter_map(number).collect();
            contours.follow(&operation.operator, &numbers);
        }
        Self(RTree::bulk_load(contours.found))
    }

    /// Returns the mean of the vertices within `radius_mm` of a position, and the number of contours to which they
    /// belong.
    pub(super) fn meeting(&self, place: DVec2, radius_mm: f64) -> Option<(DVec2, usize)> {
        let [least, most] = [place - radius_mm, place + radius_mm];
        let around = AABB::from_corners(least.to_array(), most.to_array());
        let near: Vec<_> = self.0.locate_in_envelope(around).collect();
        let mut contours: Vec<usize> = near.iter().map(|vertex| vertex.data).collect();
        contours.sort_unstable();
        contours.dedup();
        let sum: DVec2 = near.iter().map(|vertex| DVec2::from(*vertex.geom())).sum();
        (!near.is_empty()).then(|| (sum / near.len() as f64, contours.len()))
    }
}

fn number(object: &Object) -> Option<f64> {
    match object {
        Object::Integer(value) => Some(*value as f64),
        Object::Real(value) => Some(f64::from(*value)),
        _ => None,
    }
}

struct Contours {
    matrix: Matrix,
    saved: Vec<Matrix>,
    found: Vec<GeomWithData<[f64; 2], usize>>,
    count: usize,
}

impl Contours {
    fn follow(&mut self, operator: &str, numbers: &[f64]) {
        match (operator, numbers) {
            ("q", _) => self.saved.push(self.matrix),
            ("Q", _) => self.matrix = self.saved.pop().unwrap_or(IDENTITY),
            ("cm", &[a, b, c, d, e, f]) => self.matrix = product([a, b, c, d, e, f], self.matrix),
            ("m", &[x, y]) => {
                self.count += 1;
                self.vertex([x, y]);
            }
            ("l", &[x, y]) | ("c", &[_, _, _, _, x, y]) | ("v" | "y", &[_, _, x, y]) => {
                self.vertex([x, y]);
            }
            ("re", &[x, y, width, height]) => {
                self.count += 1;
                for [u, v] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                    self.vertex([x + u * width, y + v * height]);
                }
            }
            _ => {}
        }
    }

    fn vertex(&mut self, [x, y]: [f64; 2]) {
        let [a, b, c, d, e, f] = self.matrix;
        let place = [a * x + c * y + e, b * x + d * y + f].map(|v| v * MM_PER_PT);
        self.found.push(GeomWithData::new(place, self.count));
    }
}

/// Returns the composition: `first`, followed by `then`.
fn product(first: Matrix, then: Matrix) -> Matrix {
    let [a, b, c, d, e, f] = first;
    let [p, q, r, s, t, u] = then;
    [
        a * p + b * r,
        a * q + b * s,
        c * p + d * r,
        c * q + d * s,
        e * p + f * r + t,
        e * q + f * s + u,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_applied_and_contours_counted() {
        let stream = b"q 2 0 0 2 72 0 cm 0 0 m 36 0 l 36 36 l h f Q 72 0 m 144 72 l 72 72 l f";
        let vertices = Vertices::of(&Content::decode(stream).unwrap());
        let meeting = |x: f64, y: f64| vertices.meeting(DVec2::new(x, y), 0.01);
        let (place, contours) = meeting(25.4, 0.0).unwrap();
        assert!(place.abs_diff_eq(DVec2::new(25.4, 0.0), 1e-9), "{place:?}");
        assert_eq!(contours, 2);
        assert_eq!(meeting(50.8, 25.4).unwrap().1, 2);
        assert_eq!(meeting(50.8, 0.0).unwrap().1, 1);
        assert!(meeting(40.0, 0.0).is_none());
    }
}
