//! Moves the edges of a printed page, as ink that spreads on paper or light that blooms on a sensor does.

use rayon::prelude::*;

use deltille::raster::Gray;

/// Grey value between ink and paper.
const MIDDLE: u8 = 128;

/// Returns an image whose dark areas have grown by `px` on every side, or shrunk if it is negative: all points that are
/// no farther than this from a dark area.
pub(super) fn with_moved_edges(image: &Gray<u8>, px: f64) -> Gray<u8> {
    let (width, height) = (image.width(), image.height());
    let reach = px.abs().ceil() as usize + 1;
    let grows = |value: u8| (value < MIDDLE) == (px > 0.0);
    let still = if px > 0.0 { 255.0 } else { 0.0 };
    // The squared distance in the row to the nearest pixel whose colour grows.
    let in_rows: Vec<Vec<f32>> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut far = vec![f32::INFINITY; width];
            let mut sweep = |columns: &mut dyn Iterator<Item = usize>| {
                let mut since = f32::INFINITY;
                for x in columns {
                    since = if grows(image.at(x, y)) { 0.0 } else { since + 1.0 };
                    far[x] = far[x].min(since * since);
                }
            };
            sweep(&mut (0..width));
            sweep(&mut (0..width).rev());
            far
        })
        .collect();
    let rows = (0..height).into_par_iter().map(|y| {
        let (first, last) = (y.saturating_sub(reach), (y + reach).min(height - 1));
        let mut nearest = vec![f32::INFINITY; width];
        for (other, in_row) in in_rows.iter().enumerate().take(last + 1).skip(first) {
            let off = (other.abs_diff(y) as f32).powi(2);
            let row = in_row.iter().map(|far| far + off);
            nearest.iter_mut().zip(row).for_each(|(least, far)| *least = least.min(far));
        }
        // A pixel is covered as far as the boundary has moved into it.
        let covered = |far: f32| (px.abs() as f32 + 1.0 - far.sqrt()).clamp(0.0, 1.0);
        let value = |far: f32| (still + covered(far) * (255.0 - 2.0 * still)).round() as u8;
        nearest.into_iter().map(value).collect::<Vec<u8>>()
    });
    let rows: Vec<Vec<u8>> = rows.collect();
    Gray::from_fn(width, height, |x, y| rows[y][x])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square grows into a square with round corners, and shrinks into a square.
    #[test]
    fn a_square_grows_on_every_side() {
        let square = Gray::from_fn(60, 60, |x, y| {
            if (20..40).contains(&x) && (20..40).contains(&y) { 0 } else { 255 }
        });
        for (px, around) in [(4.5, std::f64::consts::PI - 4.0), (-3.25, 0.0)] {
            let moved = with_moved_edges(&square, px);
            let dark = moved.pixels().iter().map(|&v| 1.0 - f64::from(v) / 255.0).sum::<f64>();
            let expected = (20.0 + 2.0 * px).powi(2) + around * px * px;
            assert!((dark - expected).abs() < 0.01 * expected, "{px}: {dark}, not {expected}");
        }
    }
}
