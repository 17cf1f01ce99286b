//! The squares of a checkerboard in an image.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::tiling::{CHECKER, step};
use deltille_core::detection::Grid;
use deltille_core::lattice::Vertex;
use deltille_core::raster::ImageView;
use deltille_core::statistics::median;

/// Offset of the samples from the centre of a square along rows and columns, in edges. The samples
/// fit even on a dot that is much smaller than its square.
const AROUND: f64 = 0.12;

/// Minimum number of whole squares, relative to a square board with as many corners. A grid with fewer consists of rows
/// rather than areas.
const COMPACT: f64 = 2.0 / 3.0;

/// A position in the image, px.
pub(crate) type Point = DVec2;

/// A square: its centre, and two of its edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Square {
    pub middle: Point,
    pub edges: [Point; 2],
}

/// A square with four known corners.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WholeSquare {
    /// Its lowest, leftmost vertex on the print.
    pub vertex: Vertex,
    /// The corner there, the one to the right, the one above, and the diagonal one.
    pub corners: [Point; 4],
}

impl WholeSquare {
    /// Returns the position at a fraction to the right and a fraction up.
    pub(crate) fn place(&self, right: f64, up: f64) -> Point {
        let [a, b, c, d] = self.corners;
        let (low, high) = (a + right * (b - a), c + right * (d - c));
        low + up * (high - low)
    }

    fn square(&self) -> Square {
        let [corner, right, above, _] = self.corners;
        Square { middle: self.place(0.5, 0.5), edges: [right - corner, above - corner] }
    }
}

/// Returns 0 for a square of one colour, 1 for one of the other.
pub(crate) fn parity(vertex: Vertex) -> usize {
    (vertex.row + vertex.col).rem_euclid(2) as usize
}

/// The corners of a grid in an image.
#[derive(Clone, Debug)]
pub(crate) struct CheckerTiles<'a> {
    pub image: ImageView<'a>,
    pub corners: BTreeMap<Vertex, Point>,
}

impl<'a> CheckerTiles<'a> {
    pub(crate) fn of(image: ImageView<'a>, grid: &Grid) -> Self {
        let corner =
            |c: &deltille_core::detection::GridCorner| (Vertex::new(c.row, c.col), c.position());
        Self { image, corners: grid.corners.iter().map(corner).collect() }
    }

    pub(crate) fn has(&self, vertex: Vertex) -> bool {
        self.corners.contains_key(&vertex)
    }

    pub(crate) fn at(&self, vertex: Vertex) -> Option<Point> {
        self.corners.get(&vertex).copied()
    }

    /// Returns the corners of whole squares.
    pub(crate) fn without_loose_corners(&self) -> Self {
        let is_in_one = |&(&v, _): &(&Vertex, &Point)| {
            (0..CHECKER).any(|k| {
                let [a, b] = [k, k + 1].map(step::<CHECKER>);
                self.has(v + a) && self.has(v + b) && self.has(v + a + b)
            })
        };
        let corners = self.corners.iter().filter(is_in_one).map(|(&v, &corner)| (v, corner));
        Self { image: self.image, corners: corners.collect() }
    }

    pub(crate) fn whole_squares(&self) -> impl Iterator<Item = WholeSquare> {
        self.corners.iter().filter_map(|(&vertex, &corner)| {
            let at = |row, col| self.at(vertex + Vertex::new(row, col));
            Some(WholeSquare { vertex, corners: [corner, at(0, 1)?, at(1, 0)?, at(1, 1)?] })
        })
    }

    /// Returns whether the number of whole squares is that of an area without holes; false for rows
    /// of corners.
    pub(crate) fn is_compact(&self) -> bool {
        let square = (self.corners.len() as f64).sqrt() - 1.0;
        self.whole_squares().count() as f64 >= COMPACT * square * square
    }

    /// Returns the brightness of the centres of the whole squares of either parity.
    pub(crate) fn levels(&self) -> Option<[f64; 2]> {
        let mut values = [Vec::new(), Vec::new()];
        for square in self.whole_squares() {
            values[parity(square.vertex)].extend(self.value(square.square()));
        }
        let [even, odd] = values.map(median);
        Some([even?, odd?])
    }

    /// Returns the brightness about the centre of a square; `None` outside the image.
    pub(crate) fn value(&self, Square { middle, edges }: Square) -> Option<f64> {
        /// In edges: the centre, and points next to it along rows and columns.
        const POSITIONS: [[f64; 2]; 5] =
            [[0.0, 0.0], [AROUND, 0.0], [-AROUND, 0.0], [0.0, AROUND], [0.0, -AROUND]];
        let values = POSITIONS.map(|place| self.brightness(moved(middle, edges, place.into())));
        Some(values.into_iter().sum::<Option<f64>>()? / POSITIONS.len() as f64)
    }

    /// Returns the brightness of a position in the image.
    pub(crate) fn brightness(&self, DVec2 { x, y }: Point) -> Option<f64> {
        let (width, height) = (self.image.width() as f64, self.image.height() as f64);
        let inside = x >= 0.0 && y >= 0.0 && x + 1.0 < width && y + 1.0 < height;
        inside.then(|| self.image.bilinear_inside(x, y))
    }
}

/// Returns a position moved by multiples of two edges.
pub(crate) fn moved(place: Point, edges: [Point; 2], by: DVec2) -> Point {
    place + by.x * edges[0] + by.y * edges[1]
}
