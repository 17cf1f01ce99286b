//! The Bayer colour filters, and demosaicing.

use crate::photographs::scene::Mosaic;
use deltille::raster::Gray;

/// Transmission of the filters for a grey scene, relative to green. Gains compensate it afterwards, and amplify the
/// noise accordingly.
pub(crate) const RESPONSE: [f32; 3] = [0.55, 1.0, 0.65];

/// Returns the colour of a pixel (red, green, blue as 0, 1, 2), in rows RGRG… and GBGB….
pub(crate) fn colour(x: usize, y: usize) -> usize {
    match (x % 2, y % 2) {
        (0, 0) => 0,
        (1, 1) => 2,
        _ => 1,
    }
}

/// Interpolates three colours at every pixel from one; gains are already applied to `raw`.
pub(crate) fn interpolated(raw: &Gray<f32>, how: Mosaic) -> [Gray<f32>; 3] {
    let green = green(raw, how);
    let (width, height) = (raw.width(), raw.height());
    let other = |wanted: usize| {
        // Edge-aware: interpolates the difference to green.
        let value = |x: usize, y: usize| match how {
            Mosaic::Edges => raw.at(x, y) - green.at(x, y),
            _ => raw.at(x, y),
        };
        Gray::from_fn(width, height, |x, y| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for (u, v, weight) in around(x, y, width, height) {
                if colour(u, v) == wanted {
                    sum += weight * value(u, v);
                    weights += weight;
                }
            }
            let mean = sum / f32::max(weights, 1e-9);
            if how == Mosaic::Edges { mean + green.at(x, y) } else { mean }
        })
    };
    let (red, blue) = (other(0), other(2));
    [red, green, blue]
}

/// Iterates over the 3 × 3 neighbourhood of a pixel, with the weights of bilinear interpolation on every second pixel.
fn around(
    x: usize,
    y: usize,
    width: usize,
    height: usize,
) -> impl Iterator<Item = (usize, usize, f32)> {
    let near = |i: usize, size: usize| i.saturating_sub(1)..(i + 2).min(size);
    near(y, height).flat_map(move |v| {
        near(x, width).map(move |u| {
            let part = |a: usize, b: usize| if a == b { 1.0 } else { 0.5 };
            (u, v, part(u, x) * part(v, y))
        })
    })
}

fn green(raw: &Gray<f32>, how: Mosaic) -> Gray<f32> {
    let (width, height) = (raw.width(), raw.height());
    Gray::from_fn(width, height, |x, y| {
        if colour(x, y) == 1 {
            return raw.at(x, y);
        }
        // Pixels beyond the border are mirrored, which preserves their colour.
        let at = |dx: i64, dy: i64| {
            let mirrored = |i: usize, d: i64, size: usize| {
                let last = size as i64 - 1;
                let moved = (i as i64 + d).abs();
                (if moved > last { 2 * last - moved } else { moved }).clamp(0, last) as usize
            };
            raw.at(mirrored(x, dx, width), mirrored(y, dy, height))
        };
        let (left, right, up, down) = (at(-1, 0), at(1, 0), at(0, -1), at(0, 1));
        if how != Mosaic::Edges {
            return 0.25 * (left + right + up + down);
        }
        // Hamilton and Adams: interpolates along the direction of smaller change, corrected by the pixel's own colour.
        let here = raw.at(x, y);
        let (bend_x, bend_y) =
            (2.0 * here - at(-2, 0) - at(2, 0), 2.0 * here - at(0, -2) - at(0, 2));
        let change_x = (left - right).abs() + bend_x.abs();
        let change_y = (up - down).abs() + bend_y.abs();
        let (along_x, along_y) =
            (0.5 * (left + right) + 0.25 * bend_x, 0.5 * (up + down) + 0.25 * bend_y);
        match change_x.partial_cmp(&change_y) {
            Some(std::cmp::Ordering::Less) => along_x,
            Some(std::cmp::Ordering::Greater) => along_y,
            _ => 0.5 * (along_x + along_y),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear grey ramp is reproduced unchanged.
    #[test]
    fn a_ramp_stays_a_ramp() {
        let ramp = Gray::from_fn(16, 12, |x, y| 0.02 * x as f32 + 0.01 * y as f32);
        for how in [Mosaic::Bilinear, Mosaic::Edges] {
            for channel in interpolated(&ramp, how) {
                for (x, y) in [(5, 5), (6, 5), (5, 6), (6, 6)] {
                    assert!((channel.at(x, y) - ramp.at(x, y)).abs() < 1e-5, "{how:?}");
                }
            }
        }
    }
}
