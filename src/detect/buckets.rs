//! Points that come one by one, by their neighbourhood: an image cut into squares, each with a list of
//! the points in it.

/// Side of a square, px: corners are a few to a square where there are many.
const SIDE_PX: f64 = 16.0;

/// The end of a list.
const NONE: u32 = u32::MAX;

/// Points in an image, to which more may be added.
#[derive(Clone, Debug)]
pub struct Buckets {
    cols: usize,
    rows: usize,
    /// The last point of each square.
    last: Vec<u32>,
    /// The points, each with the one before it in its square.
    points: Vec<([f64; 2], u32)>,
}

impl Buckets {
    /// No points yet, of an image of some size, px; what lies outside is found too, if less quickly.
    pub fn new(width: usize, height: usize) -> Self {
        let count = |px: usize| (px as f64 / SIDE_PX) as usize + 1;
        let (cols, rows) = (count(width), count(height));
        Self { cols, rows, last: vec![NONE; cols * rows], points: Vec::new() }
    }

    /// Adds a point; they are numbered from 0 on.
    pub fn insert(&mut self, point: [f64; 2]) {
        let [col, row] = self.square(point);
        let last = &mut self.last[row * self.cols + col];
        self.points.push((point, *last));
        *last = self.points.len() as u32 - 1;
    }

    fn square(&self, [x, y]: [f64; 2]) -> [usize; 2] {
        // Conversions saturate, so points outside fall to the border.
        let along = |c: f64, count: usize| ((c / SIDE_PX) as usize).min(count - 1);
        [along(x, self.cols), along(y, self.rows)]
    }

    /// The numbers of the points within a distance of a place, px, and their squared distances.
    pub fn within(&self, [x, y]: [f64; 2], reach: f64) -> impl Iterator<Item = (usize, f64)> {
        let [left, top] = self.square([x - reach, y - reach]);
        let [right, bottom] = self.square([x + reach, y + reach]);
        let squares = (top..=bottom)
            .flat_map(move |row| (left..=right).map(move |col| row * self.cols + col));
        squares.flat_map(move |square| {
            let first = self.last[square];
            let list = std::iter::successors((first != NONE).then_some(first), |&i| {
                let before = self.points[i as usize].1;
                (before != NONE).then_some(before)
            });
            list.filter_map(move |i| {
                let [u, v] = self.points[i as usize].0;
                let d2 = (u - x).powi(2) + (v - y).powi(2);
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
        let mut points: Vec<[f64; 2]> = Vec::new();
        for reach in (0..200).map(|i| 0.3 * f64::from(i)) {
            // Some lie outside.
            let point = [random.random_range(-20.0..330.0), random.random_range(-20.0..130.0)];
            let mut found: Vec<usize> = buckets.within(point, reach).map(|(i, _)| i).collect();
            found.sort_unstable();
            let distance = |p: &[f64; 2]| (p[0] - point[0]).hypot(p[1] - point[1]);
            let near = (0..points.len()).filter(|&i| distance(&points[i]) <= reach);
            assert_eq!(found, near.collect::<Vec<_>>());
            points.push(point);
            buckets.insert(point);
        }
    }
}
