//! Processing of an image in bands of rows, in parallel if threads are available.
//!
//! The bands depend only on the size of the image, never on the number of threads, so results are the same on any
//! machine. The threads belong to the current `rayon` pool.

use std::ops::Range;

use rayon::prelude::*;

use super::{Gray, Intensity};

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
pub(super) fn fill_bands<T: Send>(
    pixels: &mut [T],
    width: usize,
    work: impl Fn(usize, &mut [T]) + Sync,
) {
    let height = band_rows(width);
    if pixels.len() <= height * width {
        return work(0, pixels);
    }
    let bands = pixels.par_chunks_mut(height * width).enumerate();
    bands.for_each(|(i, band)| work(i * height, band));
}

/// Creates an image whose rows `fill` writes, given their numbers and the memory of their band.
pub(super) fn image_of_rows<T: Intensity, M>(
    width: usize,
    height: usize,
    memory: impl Fn() -> M + Sync,
    fill: impl Fn(&mut M, usize, &mut [T]) + Sync,
) -> Gray<T> {
    if height <= band_rows(width) {
        // Appending rows takes less time than filling the image with zeros first.
        let (mut memory, mut row) = (memory(), vec![T::default(); width]);
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            fill(&mut memory, y, &mut row);
            pixels.extend_from_slice(&row);
        }
        return Gray { width, height, data: pixels };
    }
    let mut image = Gray::new(width, height);
    fill_bands(image.pixels_mut(), width, |first, band| {
        let mut memory = memory();
        for (y, row) in (first..).zip(band.chunks_exact_mut(width)) {
            fill(&mut memory, y, row);
        }
    });
    image
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_every_row_once_in_order() {
        for (rows, width) in [(3..3, 10), (0..5, 0), (2..2000, 1000), (0..5, 2 * BAND_PX)] {
            assert_eq!(bands(rows.clone(), width, |band| band.collect()), rows.collect::<Vec<_>>());
        }
        for (width, height) in [(1000, 5000), (1000, 3), (0, 3), (3, 0)] {
            let image = image_of_rows(width, height, || (), |(), y, row| row.fill(y as u16));
            assert_eq!([image.width(), image.height()], [width, height]);
            assert_eq!(image.pixels().len(), width * height);
            assert!((0..height).all(|y| image.row(y).iter().all(|&v| usize::from(v) == y)));
        }
    }
}
