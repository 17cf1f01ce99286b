//! Work on an image in bands of rows, which run side by side where there are threads.
//!
//! How an image is divided depends on its size alone, never on the number of threads, so results
//! are the same on any machine. Threads are those of the pool at hand (`rayon`).

use std::ops::Range;

use rayon::prelude::*;

/// Pixels of a band: milliseconds of work, against which handing it over is nothing. Pictures of up
/// to so many are left whole: there usually are many of them to share between threads.
const BAND_PX: usize = 1 << 22;

/// Rows of a band in an image of this width.
fn band_rows(width: usize) -> usize {
    BAND_PX.div_ceil(width.max(1))
}

/// What `work` finds in bands of some rows of an image, in their order.
pub fn bands<T: Send>(
    rows: Range<usize>,
    width: usize,
    work: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let height = band_rows(width);
    if rows.len() <= height {
        return work(rows);
    }
    let count = rows.len().div_ceil(height);
    let band = |i: usize| {
        let start = rows.start + i * height;
        start..(start + height).min(rows.end)
    };
    let found: Vec<Vec<T>> = (0..count).into_par_iter().map(|i| work(band(i))).collect();
    found.into_iter().flatten().collect()
}

/// Lets `work` fill bands of an image's pixels; it is told the first row of each.
pub fn fill_bands<T: Send>(pixels: &mut [T], width: usize, work: impl Fn(usize, &mut [T]) + Sync) {
    let height = band_rows(width);
    if pixels.len() <= height * width {
        return work(0, pixels);
    }
    let bands = pixels.par_chunks_mut(height * width).enumerate();
    bands.for_each(|(i, band)| work(i * height, band));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_hold_every_row_once_and_in_order() {
        for (rows, width) in [(3..3, 10), (0..5, 0), (2..2000, 1000), (0..5, 2 * BAND_PX)] {
            assert_eq!(bands(rows.clone(), width, |band| band.collect()), rows.collect::<Vec<_>>());
        }
        let width = 1000;
        let mut pixels = vec![0; 3000 * width];
        fill_bands(&mut pixels, width, |first, band| {
            for (y, row) in band.chunks_mut(width).enumerate() {
                row.fill(first + y);
            }
        });
        assert!(pixels.chunks(width).enumerate().all(|(y, row)| row.iter().all(|&v| v == y)));
    }
}
