//! A page as a PNG: decoded by the image crate, with its size on paper from the resolution.

use std::io::Cursor;

use glam::DVec2;
use image::ImageReader;

use crate::document::drawing::MAX_PIXELS;
use deltille_core::raster::Gray;
use deltille_files::limits::Limits;

/// A PNG with its resolution.
pub(super) struct Png {
    /// The pixels, or in a very large image the means of squares of pixels.
    image: Gray<u8>,
    /// Side of such a square, px; 1 if the pixels are those of the file.
    reduced: usize,
    /// Width and height of the file, px.
    size_px: [usize; 2],
    /// Resolution of the file.
    px_per_mm: f64,
}

impl Png {
    /// Decodes a PNG. Returns an error with the reason if it is damaged or too large, states no resolution in pixels
    /// per metre, or its pixels are not square.
    pub(super) fn parse(bytes: &[u8], limits: &Limits) -> Result<Self, String> {
        let broken = |error: &dyn std::fmt::Display| format!("not a readable PNG ({error})");
        let reader =
            png::Decoder::new(Cursor::new(bytes)).read_info().map_err(|error| broken(&error))?;
        let px_per_mm = match reader.info().pixel_dims {
            Some(dims) if dims.unit == png::Unit::Meter && dims.xppu == dims.yppu => {
                f64::from(dims.xppu) / 1000.0
            }
            Some(dims) if dims.unit == png::Unit::Meter => {
                let (x, y) = (dims.xppu, dims.yppu);
                return Err(format!("its pixels are not square: {x} × {y} per metre"));
            }
            _ => {
                return Err(
                    "it states no resolution in pixels per metre, so its physical size is unknown"
                        .into(),
                );
            }
        };
        let (width, height) = reader.info().size();
        limits.check_pixels(width, height).map_err(|exceeded| exceeded.to_string())?;
        let mut reader = ImageReader::new(Cursor::new(bytes));
        reader.set_format(image::ImageFormat::Png);
        reader.no_limits();
        let grey = reader.decode().map_err(|error| broken(&error))?.into_luma8();
        let (width, height) = (grey.width() as usize, grey.height() as usize);
        let image = Gray::from_vec(width, height, grey.into_raw());
        let mut image = image.ok_or("it has too few pixels")?;
        let reduced = ((width * height) as f64 / MAX_PIXELS).sqrt().ceil().max(1.0) as usize;
        if reduced > 1 {
            image = means(&image, reduced);
        }
        Ok(Self { image, reduced, size_px: [width, height], px_per_mm })
    }

    /// Returns width and height on paper, mm.
    pub(super) fn size_mm(&self) -> DVec2 {
        DVec2::from(self.size_px.map(|px| px as f64)) / self.px_per_mm
    }

    /// Returns the resolution of the file.
    pub(super) fn px_per_mm(&self) -> f64 {
        self.px_per_mm
    }

    /// Returns the resolution of the [`image`](Self::image).
    pub(super) fn image_px_per_mm(&self) -> f64 {
        self.px_per_mm / self.reduced as f64
    }

    /// Returns its grey values at the resolution [`image_px_per_mm`](Self::image_px_per_mm).
    pub(super) fn image(&self) -> &Gray<u8> {
        &self.image
    }
}

/// Returns the means of squares of `side` × `side` pixels; squares that extend beyond the right or
/// lower edge count as white there.
fn means(image: &Gray<u8>, side: usize) -> Gray<u8> {
    let [width, height] = [image.width(), image.height()];
    let paper = u64::from(u8::MAX);
    let mut rows: Vec<u8> = Vec::with_capacity(width.div_ceil(side) * height.div_ceil(side));
    for top in (0..height).step_by(side) {
        let mut missing = vec![0; width.div_ceil(side)];
        for y in top..(top + side).min(height) {
            for (missing, square) in missing.iter_mut().zip(image.row(y).chunks(side)) {
                *missing += square.iter().map(|&v| paper - u64::from(v)).sum::<u64>();
            }
        }
        let area = (side * side) as u64;
        rows.extend(missing.iter().map(|missing| (paper - (missing + area / 2) / area) as u8));
    }
    Gray::from_vec(width.div_ceil(side), height.div_ceil(side), rows).expect("all squares")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_keep_the_ink() {
        let image = Gray::from_vec(3, 3, vec![255, 255, 0, 255, 255, 0, 255, 255, 0]).unwrap();
        assert_eq!(means(&image, 2).pixels(), [255, 127, 255, 191]);
    }
}
