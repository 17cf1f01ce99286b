//! Thumbnails of photographs.

use image::GrayImage;

use deltille_core::raster::Gray;

/// Longest side of a thumbnail, px.
const SIDE: usize = 240;

/// Returns the thumbnail of an image as PNG, at most 240 px on its longer side. Each pixel is the mean of the pixels that it
/// covers. `None` if the PNG cannot be encoded.
pub fn thumbnail(image: &Gray<u8>) -> Option<Vec<u8>> {
    png(&reduced(image, SIDE))
}

/// The image reduced to at most `side` pixels on its longer side.
pub(super) fn reduced(image: &Gray<u8>, side: usize) -> GrayImage {
    let (width, height) = (image.width(), image.height());
    let scale = (width.max(height) as f64 / side as f64).max(1.0);
    let size = [width, height].map(|side| ((side as f64 / scale) as usize).max(1));
    let span = |index: usize, of: usize, side: usize| {
        let at = |i: usize| i * side / of;
        at(index)..at(index + 1).max(at(index) + 1).min(side)
    };
    GrayImage::from_fn(size[0] as u32, size[1] as u32, |x, y| {
        let (xs, ys) = (span(x as usize, size[0], width), span(y as usize, size[1], height));
        let count = (xs.len() * ys.len()).max(1) as u32;
        let sum: u32 = ys.flat_map(|y| xs.clone().map(move |x| u32::from(image.at(x, y)))).sum();
        image::Luma([(sum / count) as u8])
    })
}

/// An image as PNG.
pub(super) fn png(image: &GrayImage) -> Option<Vec<u8>> {
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).ok()?;
    Some(png.into_inner())
}
