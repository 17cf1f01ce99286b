//! Grey values of colours.

use super::{Gray, measured};

/// Weights of red, green and blue (Rec. 709), in ten-thousandths.
const WEIGHTS: [u32; 3] = [2126, 7152, 722];

/// Sum of the weights.
const WHOLE: u32 = 10_000;

/// Converts colours to grey values: the [`measured`] ones of a Bayer sensor, else their luma. Each pixel has `BYTES` bytes; the first three are red, green
/// and blue, as in a video frame. The values equal those of a photograph with these colours, within
/// 1 of 256 levels. Returns
/// `None` if the number of bytes does not match the width and height.
///
/// ```
/// use deltille_core::raster::grey_of_colours;
///
/// let grey = grey_of_colours::<4>(2, 1, &[255, 255, 255, 0, 0, 255, 0, 255]).unwrap();
/// assert_eq!(grey.pixels(), [255, 182]);
/// assert!(grey_of_colours::<3>(2, 1, &[0; 5]).is_none());
/// ```
pub fn grey_of_colours<const BYTES: usize>(
    width: u32,
    height: u32,
    colours: &[u8],
) -> Option<Gray<u8>> {
    let (width, height) = (width as usize, height as usize);
    if let Some(grey) = measured::<u8, BYTES>(width, height, colours) {
        return Some(grey);
    }
    let grey = |pixel: &[u8; BYTES]| {
        let sum = WEIGHTS.iter().zip(pixel).map(|(weight, &value)| weight * u32::from(value));
        ((sum.sum::<u32>() + WHOLE / 2) / WHOLE) as u8
    };
    let (pixels, rest) = colours.as_chunks::<BYTES>();
    let is_whole = rest.is_empty() && width.checked_mul(height) == Some(pixels.len());
    is_whole.then(|| Gray::from_vec(width, height, pixels.iter().map(grey).collect())).flatten()
}
