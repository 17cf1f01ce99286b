//! Anti-aliased rendering of black marks by supersampling, in blocks and bands to bound memory.

use rayon::prelude::*;

/// Samples per pixel along each axis. With the four levels of the renderer, an edge is located to 1/32 px.
pub const SUBPIXELS: usize = 4;

/// Maximum side of a block, px. Its samples are far within the size that tiny-skia draws in one piece, and in colour they take
/// 16 MB, memory which the allocator reuses for the next block.
const BLOCK: usize = 512;

/// A rectangle of an image, px.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Left edge.
    pub x: usize,
    /// Upper edge.
    pub y: usize,
    /// Width.
    pub width: usize,
    /// Height.
    pub height: usize,
}

/// Renders a grey image of black marks on white, band by band from the top.
///
/// `coverage` draws one block at [`SUBPIXELS`] samples per pixel and axis, row-major; 255 is fully
/// inked. `sink` receives the grey pixels of each full-width band, in order.
///
/// # Errors
/// Returns the first error of `sink`.
pub fn render<E>(
    width: usize,
    height: usize,
    coverage: impl Fn(Block) -> Vec<u8> + Sync,
    mut sink: impl FnMut(&[u8]) -> Result<(), E>,
) -> Result<(), E> {
    for y in (0..height).step_by(BLOCK) {
        let band_height = BLOCK.min(height - y);
        let xs: Vec<usize> = (0..width).step_by(BLOCK).collect();
        let blocks: Vec<(Block, Vec<u8>)> = xs
            .into_par_iter()
            .map(|x| {
                let block = Block { x, y, width: BLOCK.min(width - x), height: band_height };
                (block, gray(block, &coverage(block)))
            })
            .collect();
        let mut band = vec![255; width * band_height];
        for (block, pixels) in blocks {
            for (row, line) in pixels.chunks_exact(block.width).enumerate() {
                band[row * width + block.x..][..block.width].copy_from_slice(line);
            }
        }
        sink(&band)?;
    }
    Ok(())
}

/// The grey pixels of a block: white minus the mean coverage.
fn gray(block: Block, coverage: &[u8]) -> Vec<u8> {
    const SAMPLES: u32 = (SUBPIXELS * SUBPIXELS) as u32;
    let mut pixels = Vec::with_capacity(block.width * block.height);
    let mut sums = vec![0; block.width];
    for rows in coverage.chunks_exact(SUBPIXELS * SUBPIXELS * block.width) {
        sums.fill(SAMPLES / 2);
        for row in rows.chunks_exact(SUBPIXELS * block.width) {
            for (sum, samples) in sums.iter_mut().zip(row.as_chunks::<SUBPIXELS>().0) {
                *sum += samples.iter().map(|&sample| u32::from(sample)).sum::<u32>();
            }
        }
        pixels.extend(sums.iter().map(|sum| 255 - (sum / SAMPLES) as u8));
    }
    pixels
}
