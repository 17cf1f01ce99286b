//! The samples of an image within a triangle, and their reduction to pixels.

use glam::DVec2;

use deltille_core::raster::Gray;

/// Samples per pixel along each axis.
pub(crate) const SAMPLES: usize = 2;

/// Part of a sample by which a triangle is extended, so that no sample falls between two triangles with a common side.
const OVERLAP: f64 = 1e-9;

/// Calls `visit` for each sample in a triangle, with its index, row by row, and values that are affine over the image.
///
/// `corners` are those of the triangle in samples, whose centres are at integers; `values` are those at the corners.
pub(crate) fn for_each_sample<const N: usize>(
    corners: [DVec2; 3],
    values: [[f64; N]; 3],
    [width, height]: [usize; 2],
    mut visit: impl FnMut(usize, [f64; N]),
) {
    let [a, b, c] = corners;
    let area = (b - a).perp_dot(c - a);
    if area == 0.0 {
        return;
    }
    let low = a.min(b).min(c);
    let high = a.max(b).max(c);
    let end = |high: f64, size: usize| ((high.floor() + 1.0).max(0.0) as usize).min(size);
    for y in low.y.ceil().max(0.0) as usize..end(high.y, height) {
        let first = DVec2::new(0.0, y as f64);
        // Barycentric coordinates at the beginning of the row, and their change from sample to sample.
        let [from, by] = [
            [
                (b - first).perp_dot(c - first),
                (c - first).perp_dot(a - first),
                (a - first).perp_dot(b - first),
            ],
            [b.y - c.y, c.y - a.y, a.y - b.y],
        ]
        .map(|weights| weights.map(|weight| weight / area));
        let mut range = [low.x, high.x];
        for (from, by) in from.into_iter().zip(by) {
            if by > 0.0 {
                range[0] = range[0].max(-from / by - OVERLAP);
            } else if by < 0.0 {
                range[1] = range[1].min(-from / by + OVERLAP);
            } else if from < 0.0 {
                range[1] = f64::NEG_INFINITY;
            }
        }
        let combined = |weights: [f64; 3]| -> [f64; N] {
            std::array::from_fn(|n| (0..3).map(|i| weights[i] * values[i][n]).sum())
        };
        let (from, by) = (combined(from), combined(by));
        for x in range[0].ceil().max(0.0) as usize..end(range[1], width) {
            visit(y * width + x, std::array::from_fn(|n| from[n] + x as f64 * by[n]));
        }
    }
}

/// Returns the image of which these are the samples, in rows of `width`: each pixel is the mean of its samples.
pub(crate) fn pixels(samples: &[u8], width: usize) -> Gray<u8> {
    let height = samples.len() / width;
    Gray::from_fn(width / SAMPLES, height / SAMPLES, |x, y| {
        let rows = (0..SAMPLES).map(|s| (y * SAMPLES + s) * width + x * SAMPLES);
        let sum: u32 = rows.flat_map(|at| &samples[at..at + SAMPLES]).map(|&v| u32::from(v)).sum();
        (sum / (SAMPLES * SAMPLES) as u32) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles cover a quadrilateral without gaps, and values are interpolated.
    #[test]
    fn triangles_with_a_common_side_leave_no_gap() {
        let quad = [(-3.2, 4.0), (31.0, 1.7), (40.5, 33.0), (6.0, 28.1)].map(DVec2::from);
        let size = [36, 30];
        let mut seen = vec![0; size[0] * size[1]];
        for [i, j, k] in [[0, 1, 2], [0, 2, 3]] {
            let corners = [quad[i], quad[j], quad[k]];
            for_each_sample(corners, corners.map(|at| at.to_array()), size, |index, value| {
                let at = DVec2::new((index % size[0]) as f64, (index / size[0]) as f64);
                assert!(at.distance(DVec2::from(value)) < 1e-9, "{at}: {value:?}");
                seen[index] += 1;
            });
        }
        for (index, count) in seen.into_iter().enumerate() {
            let at = DVec2::new((index % size[0]) as f64, (index / size[0]) as f64);
            let is_in = (0..4).all(|i| (quad[(i + 1) % 4] - quad[i]).perp_dot(at - quad[i]) >= 0.0);
            assert!((count > 0) == is_in, "{at}: {count}");
        }
    }
}
