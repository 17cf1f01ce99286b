use std::io::Cursor;

use image::ImageReader;

use super::stretch;
use crate::limits::Limits;
use crate::raster::Gray;

/// A PNG with its resolution.
pub(super) struct Png {
    image: Gray<u8>,
    px_per_mm: f64,
}

impl Png {
    pub fn parse(bytes: &[u8], limits: &Limits) -> Result<Self, String> {
        let broken = |error: &dyn std::fmt::Display| format!("not a readable PNG ({error})");
        let reader =
            png::Decoder::new(Cursor::new(bytes)).read_info().map_err(|error| broken(&error))?;
        let px_per_mm = match reader.info().pixel_dims {
            Some(dims) if dims.unit == png::Unit::Meter && dims.xppu == dims.yppu => {
                f64::from(dims.xppu) / 1000.0
            }
            _ => {
                return Err(
                    "it states no resolution in pixels per metre: its size is unknown".into()
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
        let image = stretch(image.ok_or("its pixels do not fill it")?);
        Ok(Self { image, px_per_mm })
    }

    pub fn size_mm(&self) -> [f64; 2] {
        [self.image.width(), self.image.height()].map(|px| px as f64 / self.px_per_mm)
    }

    pub fn px_per_mm(&self) -> f64 {
        self.px_per_mm
    }

    pub fn image(&self) -> &Gray<u8> {
        &self.image
    }
}
