//! Processing of an image in bands of rows, in parallel if threads are available.
//!
//! The bands depend only on the size of the image, never on the number of threads, so results are the same on any
//! machine. The threads belong to the current `rayon` pool.

use std::ops::Range;

use rayon::prelude::*;

/// Pixels per band: a few milliseconds of work, so that the cost of scheduling is negligible.
/// Smaller images are not
/// divided; usually there are many of them to share between threads.
const BAND_PX: usize = 1 << 22;

/// Returns the number of rows of a band for an image of this width.
fn band_rows(width: usize) -> usize {
    BAND_PX.div_ceil(width.max(1))
}

/// Applies `work` to bands of rows and returns the results in order.
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

/// Fills bands of an image's pixels with `work`, which receives the first row of each band.
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
    fn bands_cover_every_row_once_in_order() {
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
