//! Anti-aliased rendering of black marks by supersampling, in blocks and bands to bound memory.

use rayon::prelude::*;

/// Samples per pixel along each axis. With the four levels of the renderer, an edge is located to 1/32 px.
pub const SUBPIXELS: usize = 4;

/// Maximum side of a block, px: its samples stay within the size that tiny-skia draws in one piece.
const BLOCK: usize = 1024;

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
    let stride = block.width * SUBPIXELS;
    let samples = (SUBPIXELS * SUBPIXELS) as u32;
    let pixel = |x: usize, y: usize| {
        let rows = (0..SUBPIXELS).map(|s| (y * SUBPIXELS + s) * stride + x * SUBPIXELS);
        let sum: u32 = rows
            .map(|start| {
                coverage[start..start + SUBPIXELS].iter().map(|&v| u32::from(v)).sum::<u32>()
            })
            .sum();
        255 - ((sum + samples / 2) / samples) as u8
    };
    (0..block.height).flat_map(|y| (0..block.width).map(move |x| pixel(x, y))).collect()
}
