//! Points that come one by one, by their neighbourhood: an image cut into squares, each with a list of
//! the points in it.

use glam::DVec2;

/// Side of a square, px: corners are a few to a square where there are many.
const SIDE_PX: f64 = 16.0;

/// The end of a list.
const NONE: u32 = u32::MAX;

/// Points in an image, to which more may be added.
#[derive(Clone, Debug)]
pub(crate) struct Buckets {
    /// The corner of the first square, and the side of all, px.
    origin: DVec2,
    side_px: f64,
    cols: usize,
    rows: usize,
    /// The last point of each square.
    last: Vec<u32>,
    /// The points, each with the one before it in its square.
    points: Vec<(DVec2, u32)>,
}

impl Buckets {
    /// No points yet, of an image of some size, px; what lies outside is found too, if less quickly.
    pub(crate) fn new(width: usize, height: usize) -> Self {
        let count = |px: usize| (px as f64 / SIDE_PX) as usize + 1;
        Self::squares(DVec2::ZERO, SIDE_PX, [count(width), count(height)])
    }

    /// These points, wherever they lie, numbered as they come.
    pub(crate) fn of(points: &[DVec2]) -> Self {
        let least = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let span = points.iter().copied().fold(least, DVec2::max) - least;
        let few = (span.element_product() / points.len() as f64).sqrt();
        // Points in a line span no area, and equal ones no length.
        let side = few.max(span.max_element() / points.len() as f64).max(1.0);
        let counts = (span / side).to_array().map(|count| count as usize + 1);
        let mut buckets = Self::squares(least, side, counts);
        points.iter().for_each(|&point| buckets.insert(point));
        buckets
    }

    fn squares(origin: DVec2, side_px: f64, [cols, rows]: [usize; 2]) -> Self {
        Self { origin, side_px, cols, rows, last: vec![NONE; cols * rows], points: Vec::new() }
    }

    /// Adds a point; they are numbered from 0 on.
    pub(crate) fn insert(&mut self, point: DVec2) {
        let [col, row] = self.square(point);
        let last = &mut self.last[row * self.cols + col];
        self.points.push((point, *last));
        *last = self.points.len() as u32 - 1;
    }

    fn square(&self, place: DVec2) -> [usize; 2] {
        // Conversions saturate, so points outside fall to the border.
        let DVec2 { x, y } = (place - self.origin) / self.side_px;
        [(x as usize).min(self.cols - 1), (y as usize).min(self.rows - 1)]
    }

    /// The number of the point nearest to a place; `None` where there are no points.
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

    /// The numbers of the points within a distance of a place, px, and their squared distances.
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
    fn what_is_within_reach_is_what_a_search_of_all_finds() {
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
