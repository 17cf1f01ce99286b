//! Photographs and frames of a webcam to corners.

use std::path::Path;

use deltille_core::detect::{Detection, Detector, DetectorConfig};
use deltille_core::lattice::GridKind;
use deltille_core::raster::AnyGray;
use deltille_core::targets::Target;
use deltille_files::export::{csv, detection, orpc};
use deltille_files::limits::Limits;
use deltille_files::photograph;
use wasm_bindgen::prelude::*;

use crate::errors::Raise;

/// Most pixels of a picture: what a browser holds in memory several times.
const MOST_PIXELS: u64 = 64_000_000;

/// Looks for a target, or for untagged boards.
#[wasm_bindgen]
pub struct Finder {
    detector: Detector,
    target: Option<Target>,
    limits: Limits,
}

/// What was found in a picture, with its grey values.
#[wasm_bindgen]
pub struct Found {
    detection: Detection,
    image: AnyGray,
    target: Option<Target>,
}

#[wasm_bindgen]
impl Finder {
    /// Looks for the target of a description.
    ///
    /// # Errors
    /// In words, where it is no description, or the family of its tags is not shipped.
    pub fn of_target(json: &str) -> Result<Self, JsError> {
        let target = Target::from_json(json).raise()?;
        let family = target.family().raise()?;
        let detector = Detector::for_target(&target, family.as_ref(), DetectorConfig::default());
        Ok(Self { detector, target: Some(target), limits: limits() })
    }

    /// Looks for untagged boards of a tiling, `deltille` or `checker`. With rows and columns they are labelled where
    /// they are seen whole; 0 where these are not known.
    ///
    /// # Errors
    /// In words, where there is no such tiling.
    pub fn of_grid(kind: &str, rows: u32, cols: u32) -> Result<Self, JsError> {
        let kind = match kind {
            "deltille" => GridKind::Deltille,
            "checker" => GridKind::Checker,
            _ => return Err(JsError::new("the tiling is deltille or checker")),
        };
        let size = (rows > 0 && cols > 0).then_some((rows, cols));
        let detector = Detector::for_grid(kind, size, DetectorConfig::default());
        Ok(Self { detector, target: None, limits: limits() })
    }

    /// Looks at a photograph, which is decoded as the programs do.
    ///
    /// # Errors
    /// In words, where it cannot be read.
    pub fn photograph(&self, name: &str, content: Vec<u8>) -> Result<Found, JsError> {
        let photograph =
            photograph::read_bytes(Path::new(name), content, &self.limits, false).raise()?;
        let mut detection = self.detector.detect(&photograph.image, name);
        detection.file = photograph.notes;
        Ok(Found { detection, image: photograph.image, target: self.target.clone() })
    }

    /// Looks at pixels of red, green, blue and alpha, as of a frame of a video.
    ///
    /// # Errors
    /// In words, where these are not so many.
    pub fn pixels(
        &self,
        name: &str,
        width: u32,
        height: u32,
        rgba: &[u8],
    ) -> Result<Found, JsError> {
        let rgb: Vec<u8> =
            rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        let grey = photograph::grey_of_colours(width, height, rgb);
        let image =
            AnyGray::U8(grey.ok_or_else(|| {
                JsError::new("there are not as many pixels as width and height say")
            })?);
        let detection = self.detector.detect(&image, name);
        Ok(Found { detection, image, target: self.target.clone() })
    }
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_pixels = MOST_PIXELS;
    limits
}

#[wasm_bindgen]
impl Found {
    /// The detection as `deltille detect` writes it.
    pub fn json(&self) -> String {
        detection::write(&self.detection)
    }

    /// The same as a table.
    pub fn csv(&self) -> String {
        csv::write(&self.detection)
    }

    /// The same as the list that the reference detector writes.
    pub fn orpc(&self) -> String {
        orpc::write(&self.detection, self.target.as_ref())
    }

    /// Why nothing was found or labelled, in sentences, one a line.
    pub fn reasons(&self) -> String {
        let sentences = self.detection.reasons.iter().map(crate::errors::told);
        sentences.collect::<Vec<_>>().join("\n")
    }

    /// Sides of the picture, px.
    pub fn size(&self) -> Vec<u32> {
        vec![self.detection.width, self.detection.height]
    }

    /// Grey values from 0 to 255 of a part of the picture, as red, green, blue and alpha, row by row.
    pub fn part(&self, left: u32, top: u32, width: u32, height: u32) -> Vec<u8> {
        let [full_width, full_height] =
            [self.detection.width as usize, self.detection.height as usize];
        let value = |x: usize, y: usize| match &self.image {
            AnyGray::U8(image) => image.pixels()[y * full_width + x],
            AnyGray::U16(image) => (image.pixels()[y * full_width + x] >> 8) as u8,
        };
        let mut pixels = Vec::with_capacity(4 * (width * height) as usize);
        for y in top..top + height {
            for x in left..left + width {
                let (x, y) = (x as usize, y as usize);
                let grey = if x < full_width && y < full_height { value(x, y) } else { 0 };
                pixels.extend([grey, grey, grey, 255]);
            }
        }
        pixels
    }
}
