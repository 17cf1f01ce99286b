//! An incremental spatial index: the image is divided into squares, each with a list of the points in it.

use glam::DVec2;

/// Side of a square, px. Where corners are dense, a square contains a few.
const SIDE_PX: f64 = 16.0;

/// Marks the end of a list.
const NONE: u32 = u32::MAX;

/// Points in an image, to which more can be added.
#[derive(Clone, Debug)]
pub(crate) struct Buckets {
    /// Corner of the first square, and the side of all squares, px.
    origin: DVec2,
    side_px: f64,
    cols: usize,
    rows: usize,
    /// Last point of each square.
    last: Vec<u32>,
    /// The points, each with the previous one in its square.
    points: Vec<(DVec2, u32)>,
}

impl Buckets {
    /// Creates an empty index for an image of the given size, px. Points outside are found too, but more slowly.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let count = |px: usize| (px as f64 / SIDE_PX) as usize + 1;
        Self::squares(DVec2::ZERO, SIDE_PX, [count(width), count(height)])
    }

    /// Creates an index of points anywhere in the plane, numbered in order.
    pub(crate) fn of(points: &[DVec2]) -> Self {
        let least = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let span = points.iter().copied().fold(least, DVec2::max) - least;
        let few = (span.element_product() / points.len() as f64).sqrt();
        // Collinear points span no area, and equal points no length.
        let side = few.max(span.max_element() / points.len() as f64).max(1.0);
        let counts = (span / side).to_array().map(|count| count as usize + 1);
        let mut buckets = Self::squares(least, side, counts);
        points.iter().for_each(|&point| buckets.insert(point));
        buckets
    }

    fn squares(origin: DVec2, side_px: f64, [cols, rows]: [usize; 2]) -> Self {
        Self { origin, side_px, cols, rows, last: vec![NONE; cols * rows], points: Vec::new() }
    }

    /// Adds a point. Points are numbered from 0.
    pub(crate) fn insert(&mut self, point: DVec2) {
        let [col, row] = self.square(point);
        let last = &mut self.last[row * self.cols + col];
        self.points.push((point, *last));
        *last = self.points.len() as u32 - 1;
    }

    fn square(&self, place: DVec2) -> [usize; 2] {
        // Conversions saturate, so points outside are assigned to the border.
        let DVec2 { x, y } = (place - self.origin) / self.side_px;
        [(x as usize).min(self.cols - 1), (y as usize).min(self.rows - 1)]
    }

    /// Returns the number of the point nearest to a position; `None` if there are no points.
    pub(crate) fn nearest(&self, place: DVec2) -> Option<usize> {
        let mut reach = self.side_px;
        while reach.is_finite() && !self.points.is_empty() {
            let near = self.within(place, reach).min_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((index, _)) = near {
                return Some(index);
            }
            reach *= 2.0;
        }
        None
    }

    /// Returns the numbers of the points within a distance of a position, px, and their squared distances.
    pub(crate) fn within(&self, place: DVec2, reach: f64) -> impl Iterator<Item = (usize, f64)> {
        let [left, top] = self.square(place - reach);
        let [right, bottom] = self.square(place + reach);
        let squares = (top..=bottom)
            .flat_map(move |row| (left..=right).map(move |col| row * self.cols + col));
        squares.flat_map(move |square| {
            let first = self.last[square];
            let list = std::iter::successors((first != NONE).then_some(first), |&i| {
                let before = self.points[i as usize].1;
                (before != NONE).then_some(before)
            });
            list.filter_map(move |i| {
                let d2 = self.points[i as usize].0.distance_squared(place);
                (d2 <= reach * reach).then_some((i as usize, d2))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn points_within_reach_match_a_full_search() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut buckets = Buckets::new(300, 100);
        let mut points: Vec<DVec2> = Vec::new();
        for reach in (0..200).map(|i| 0.3 * f64::from(i)) {
            // Some lie outside.
            let point =
                DVec2::new(random.random_range(-20.0..330.0), random.random_range(-20.0..130.0));
            let mut found: Vec<usize> = buckets.within(point, reach).map(|(i, _)| i).collect();
            found.sort_unstable();
            let distance = |p: &DVec2| p.distance(point);
            let near = (0..points.len()).filter(|&i| distance(&points[i]) <= reach);
            assert_eq!(found, near.collect::<Vec<_>>());
            let nearest =
                |(&a, &b): (&usize, &usize)| distance(&points[a]).total_cmp(&distance(&points[b]));
            let all: Vec<usize> = (0..points.len()).collect();
            assert_eq!(buckets.nearest(point), all.iter().copied().min_by(|a, b| nearest((a, b))));
            assert_eq!(Buckets::of(&points).nearest(point), buckets.nearest(point));
            points.push(point);
            buckets.insert(point);
        }
    }
}
