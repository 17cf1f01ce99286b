//! Decodes photographs and draws detections over them.

#![allow(unreachable_pub, reason = "the page is the only user of this interface")]

use std::path::Path;

use deltille_core::raster::{AnyGray, Intensity};
use deltille_files::export::{detection, overlay};
use deltille_files::limits::Limits;
use deltille_files::photograph;
use wasm_bindgen::prelude::*;

use deltille_web::errors::Raise;

/// Maximum number of pixels of an image: the browser keeps several copies in memory.
const MAX_PIXELS: u64 = 64_000_000;

/// A photograph, decoded as in the programs.
#[wasm_bindgen]
pub struct Photograph {
    photograph: photograph::Photograph,
}

#[wasm_bindgen]
impl Photograph {
    /// Decodes the content of a file.
    ///
    /// # Errors
    /// Throws if the file cannot be decoded.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str, content: Vec<u8>) -> Result<Self, JsError> {
        let mut limits = Limits::default();
        limits.max_pixels = MAX_PIXELS;
        let photograph =
            photograph::read_bytes(Path::new(name), content, &limits, false).raise()?;
        Ok(Self { photograph })
    }

    /// Returns width and height, px.
    pub fn size(&self) -> Vec<u32> {
        vec![self.photograph.image.width() as u32, self.photograph.image.height() as u32]
    }

    /// Returns the EXIF orientation; 1 if the image is upright.
    pub fn orientation(&self) -> u8 {
        self.photograph.notes.exif_orientation.unwrap_or(1)
    }

    /// Returns whether grey values have 16 bits.
    pub fn is_deep(&self) -> bool {
        matches!(self.photograph.image, AnyGray::U16(_))
    }

    /// Returns the grey values, row by row; 16-bit values are little-endian.
    pub fn grey(&self) -> Vec<u8> {
        match &self.photograph.image {
            AnyGray::U8(image) => image.pixels().to_vec(),
            AnyGray::U16(image) => image.pixels().iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }

    /// Returns the image as 8-bit RGBA, row by row.
    pub fn shown(&self) -> Vec<u8> {
        fn shown<T: Intensity>(pixels: &[T]) -> Vec<u8> {
            let byte = |v: &T| (v.to_f32() * (255.0 / T::FULL_SCALE)) as u8;
            pixels.iter().flat_map(|v| [byte(v), byte(v), byte(v), 255]).collect()
        }
        match &self.photograph.image {
            AnyGray::U8(image) => shown(image.pixels()),
            AnyGray::U16(image) => shown(image.pixels()),
        }
    }

    /// Draws a detection over the image, as `deltille detect --overlay` does, and returns a JPEG file.
    ///
    /// # Errors
    /// Throws if `found` is not a valid detection, or if the image is too large to draw on.
    pub fn overlay(&self, found: &str) -> Result<Vec<u8>, JsError> {
        overlay::jpeg(&self.photograph.image, &detection::read(found).raise()?).raise()
    }
}
