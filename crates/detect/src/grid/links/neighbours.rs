//! A spatial index of points: a square of buckets over all of them.

use glam::DVec2;

/// Points in buckets. There are about as many buckets as points, so a bucket contains few.
#[derive(Clone, Debug)]
pub(crate) struct Places<'a> {
    points: &'a [DVec2],
    origin: DVec2,
    side_px: f64,
    cols: usize,
    rows: usize,
    /// Start of the points of each bucket in `order`; one more entry than buckets.
    starts: Vec<u32>,
    /// Indices of points, bucket by bucket.
    order: Vec<u32>,
}

impl<'a> Places<'a> {
    /// Creates an index of finite points.
    pub(crate) fn new(points: &'a [DVec2]) -> Self {
        let bound = |pick: fn(DVec2, DVec2) -> DVec2| points.iter().copied().reduce(pick);
        let low = bound(DVec2::min).unwrap_or_default();
        let DVec2 { x: width, y: height } = bound(DVec2::max).unwrap_or_default() - low;
        let count = points.len().max(1) as f64;
        // For collinear points there are as many buckets as points.
        let side_px = (width * height / count).sqrt().max(width.max(height) / count).max(1.0);
        let cells = |length: f64| (length / side_px) as usize + 1;
        let mut found = Self {
            points,
            origin: low,
            side_px,
            cols: cells(width),
            rows: cells(height),
            starts: Vec::new(),
            order: vec![0; points.len()],
        };
        let buckets: Vec<usize> = points.iter().map(|&p| found.bucket(p)).collect();
        let mut starts = vec![0u32; found.cols * found.rows + 1];
        buckets.iter().for_each(|&bucket| starts[bucket + 1] += 1);
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        for (i, &bucket) in buckets.iter().enumerate() {
            found.order[next[bucket] as usize] = i as u32;
            next[bucket] += 1;
        }
        found.starts = starts;
        found
    }

    fn cell(&self, point: DVec2) -> [usize; 2] {
        // Conversions saturate, so points outside are assigned to the border.
        let DVec2 { x, y } = (point - self.origin) / self.side_px;
        [(x as usize).min(self.cols - 1), (y as usize).min(self.rows - 1)]
    }

    fn bucket(&self, point: DVec2) -> usize {
        let [col, row] = self.cell(point);
        row * self.cols + col
    }

    /// Returns the `count` points nearest to one of them, nearest first, without itself, among those that are `wanted`.
    pub(crate) fn nearest(
        &self,
        index: usize,
        count: usize,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<usize> {
        let here = self.points[index];
        let [col, row] = self.cell(here).map(|c| c as isize);
        // Rings contain more points than needed; a longer list would grow.
        let mut near: Vec<(f64, usize)> = Vec::with_capacity(4 * count);
        let reach = self.cols.max(self.rows) as isize;
        for ring in 0..=reach {
            // Points beyond the rings so far are farther away than this.
            let complete_px = (ring - 1).max(0) as f64 * self.side_px;
            if near.iter().filter(|(d2, _)| *d2 <= complete_px * complete_px).count() >= count {
                break;
            }
            for y in (row - ring).max(0)..=(row + ring).min(self.rows as isize - 1) {
                let whole = (y - row).abs() == ring;
                let step = if whole { 1 } else { (2 * ring).max(1) as usize };
                for x in (col - ring..=col + ring).step_by(step) {
                    if x < 0 || x >= self.cols as isize {
                        continue;
                    }
                    let bucket = y as usize * self.cols + x as usize;
                    let places = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
                    near.extend(self.order[places].iter().map(|&i| i as usize).filter_map(|i| {
                        let d2 = self.points[i].distance_squared(here);
                        (i != index && wanted(i)).then_some((d2, i))
                    }));
                }
            }
        }
        let by_distance =
            |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if near.len() > count {
            near.select_nth_unstable_by(count, by_distance);
            near.truncate(count);
        }
        near.sort_unstable_by(by_distance);
        near.into_iter().map(|(_, i)| i).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};

    use super::*;

    #[test]
    fn nearest_points_match_a_full_search() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for (count, [width, height]) in
            [(1, [5.0, 5.0]), (7, [900.0, 0.0]), (40, [3.0, 700.0]), (300, [640.0, 480.0])]
        {
            let mut point =
                || DVec2::new(random.random::<f64>() * width, random.random::<f64>() * height);
            // Some of them crowded, and two in one position.
            let mut points: Vec<_> = (0..count).map(|_| point()).collect();
            points.extend((0..count / 2).map(|_| 0.05 * point()));
            points.push(points[0]);
            let places = Places::new(&points);
            for i in 0..points.len() {
                let distance = |j: usize| points[i].distance(points[j]);
                let wanted = |j: usize| j % 3 != i % 3;
                let mut all: Vec<usize> =
                    (0..points.len()).filter(|&j| j != i && wanted(j)).collect();
                all.sort_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
                let found = places.nearest(i, 12, wanted);
                let expected: Vec<f64> = all.iter().take(12).map(|&j| distance(j)).collect();
                assert_eq!(found.iter().map(|&j| distance(j)).collect::<Vec<_>>(), expected);
            }
        }
    }
}
