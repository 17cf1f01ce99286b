//! Moves the edges of a printed page, as ink that spreads on paper or light that blooms on a sensor does.

use rayon::prelude::*;

use deltille::raster::Gray;

/// Returns an image whose dark areas have grown by `px` on every side, or shrunk if it is negative: all points that are
/// no farther than this from a dark area.
pub(super) fn with_moved_edges(image: &Gray<u8>, px: f64) -> Gray<u8> {
    let (width, height) = (image.width(), image.height());
    let reach = px.abs().ceil() as usize + 2;
    let still = if px > 0.0 { 255.0 } else { 0.0 };
    // The part of a pixel that has the colour that grows.
    let part = |x: usize, y: usize| (f32::from(image.at(x, y)) - still).abs() / 255.0;
    // The nearest column in each row whose pixel has mostly this colour.
    let nearest_columns: Vec<Vec<f32>> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut nearest = vec![f32::INFINITY; width];
            let mut sweep = |columns: &mut dyn Iterator<Item = usize>| {
                let mut last = f32::INFINITY;
                for x in columns {
                    last = if part(x, y) >= 0.5 { x as f32 } else { last };
                    if (last - x as f32).abs() < (nearest[x] - x as f32).abs() {
                        nearest[x] = last;
                    }
                }
            };
            sweep(&mut (0..width));
            sweep(&mut (0..width).rev());
            nearest
        })
        .collect();
    let row = |y: usize| {
        let (first, last) = (y.saturating_sub(reach), (y + reach).min(height - 1));
        let mut least = vec![f32::INFINITY; width];
        let mut rows = vec![y as u32; width];
        for (other, columns) in nearest_columns.iter().enumerate().take(last + 1).skip(first) {
            let off = (other.abs_diff(y) as f32).powi(2);
            for (x, column) in columns.iter().enumerate() {
                let far = (column - x as f32).powi(2) + off;
                (least[x], rows[x]) =
                    if far < least[x] { (far, other as u32) } else { (least[x], rows[x]) };
            }
        }
        let value = |x: usize| {
            let far = least[x].sqrt();
            if far > reach as f32 {
                return still as u8;
            }
            // The boundary lies within the nearest pixel, or within the next one on the way from there.
            let there = [nearest_columns[rows[x] as usize][x], rows[x] as f32];
            let way = [x as f32 - there[0], y as f32 - there[1]].map(|off| off / far.max(1.0));
            let next = [0, 1].map(|i| (there[i] + way[i]).round() as usize);
            let beyond = if far > 0.0 { part(next[0], next[1]) } else { 0.0 };
            let distance = far + 0.5 - part(there[0] as usize, there[1] as usize) - beyond;
            let covered = (px.abs() as f32 - distance + 0.5).clamp(0.0, 1.0);
            (still + covered * (255.0 - 2.0 * still)).round() as u8
        };
        (0..width).map(value).collect::<Vec<u8>>()
    };
    let rows: Vec<Vec<u8>> = (0..height).into_par_iter().map(row).collect();
    Gray::from_fn(width, height, |x, y| rows[y][x])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square grows into a square with round corners, and shrinks into a square. Its edges lie anywhere in a pixel.
    #[test]
    fn a_square_grows_on_every_side() {
        for end in [40.0, 40.3, 40.8] {
            let within = |i: usize| (end - i as f64).clamp(0.0, 1.0) * f64::from(u8::from(i >= 20));
            let square =
                Gray::from_fn(60, 60, |x, y| (255.0 * (1.0 - within(x) * within(y))).round() as u8);
            for (px, around) in [(4.5, std::f64::consts::PI - 4.0), (-3.25, 0.0)] {
                let moved = with_moved_edges(&square, px);
                let dark = moved.pixels().iter().map(|&v| 1.0 - f64::from(v) / 255.0).sum::<f64>();
                let expected = (end - 20.0 + 2.0 * px).powi(2) + around * px * px;
                assert!((dark - expected).abs() < 0.01 * expected, "{end} {px}: {dark} {expected}");
            }
        }
    }
}
