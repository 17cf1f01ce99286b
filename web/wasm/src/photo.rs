//! Photographs decoded, and detections drawn over them.

use std::path::Path;

use deltille_core::raster::{AnyGray, Intensity};
use deltille_files::export::{detection, overlay};
use deltille_files::limits::Limits;
use deltille_files::photograph;
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// Most pixels of a picture: what a browser holds in memory several times.
const MOST_PIXELS: u64 = 64_000_000;

/// A photograph, decoded as the programs do.
#[wasm_bindgen]
pub struct Photograph {
    photograph: photograph::Photograph,
}

#[wasm_bindgen]
impl Photograph {
    /// Decodes the content of a file.
    ///
    /// # Errors
    /// In words, where it cannot be read.
    #[wasm_bindgen(constructor)]
    pub fn new(name: &str, content: Vec<u8>) -> Result<Self, JsError> {
        let mut limits = Limits::default();
        limits.max_pixels = MOST_PIXELS;
        let photograph =
            photograph::read_bytes(Path::new(name), content, &limits, false).raise()?;
        Ok(Self { photograph })
    }

    /// Width and height, px.
    pub fn size(&self) -> Vec<u32> {
        vec![self.photograph.image.width() as u32, self.photograph.image.height() as u32]
    }

    /// How the file says that the pixels are to be turned for a viewer; 1 if not at all.
    pub fn orientation(&self) -> u8 {
        self.photograph.notes.exif_orientation.unwrap_or(1)
    }

    /// Whether grey values have 16 bits.
    pub fn is_deep(&self) -> bool {
        matches!(self.photograph.image, AnyGray::U16(_))
    }

    /// The grey values, row by row; of 16 bits the lower byte first.
    pub fn grey(&self) -> Vec<u8> {
        match &self.photograph.image {
            AnyGray::U8(image) => image.pixels().to_vec(),
            AnyGray::U16(image) => image.pixels().iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }

    /// Grey values of 8 bits as red, green, blue and alpha, row by row.
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

    /// The picture with a detection drawn in, as `deltille detect --overlay` writes it: the bytes of a PNG.
    ///
    /// # Errors
    /// In words, where the detection is none, or the picture is too large to draw on.
    pub fn overlay(&self, found: &str) -> Result<Vec<u8>, JsError> {
        overlay::png(&self.photograph.image, &detection::read(found).raise()?).raise()
    }
}
