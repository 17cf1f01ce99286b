//! The content of a frame before it is decoded.

use std::path::{Path, PathBuf};

use deltille_core::raster::{AnyGray, FileNotes};
use deltille_files::limits::Limits;
use deltille_files::photograph::{self, Photograph};
use image::{DynamicImage, GrayImage, ImageBuffer, Luma};

#[cfg(any(feature = "mcap", feature = "rosbag1"))]
use crate::pixels::RawImage;
use crate::problem::FramesError;

/// A frame of a recording.
pub(crate) struct Recorded {
    pub(crate) time_ns: Option<i64>,
    /// Fraction of the recording up to this frame, if it is known.
    pub(crate) part: Option<f64>,
    pub(crate) content: Content,
}

/// The content of a frame.
#[allow(dead_code, reason = "depends on the features")]
pub(crate) enum Content {
    /// A photograph in its file.
    File(PathBuf),
    /// A decoded image.
    Gray(AnyGray),
    /// The bytes of a photograph's file.
    Encoded(Vec<u8>),
    /// The pixels of a camera.
    #[cfg(any(feature = "mcap", feature = "rosbag1"))]
    Raw(RawImage),
}

impl Content {
    /// Returns the number of pixels, if it is known without decoding.
    pub(crate) fn pixels(&self, limits: &Limits) -> Option<u64> {
        match self {
            Self::File(path) => photograph::pixels(path, limits),
            Self::Gray(image) => Some(image.width() as u64 * image.height() as u64),
            Self::Encoded(bytes) => photograph::pixels_of(bytes),
            #[cfg(any(feature = "mcap", feature = "rosbag1"))]
            Self::Raw(image) => Some(image.pixels()),
        }
    }

    /// Decodes the image with its colours, if it is a photograph that is not HEIC.
    pub(crate) fn read_colours(
        self,
        path: &Path,
        limits: &Limits,
    ) -> Result<DynamicImage, FramesError> {
        if let Self::File(path) = &self
            && !crate::folder::is_heic(path)
        {
            return Ok(photograph::read_colours(path, limits)?);
        }
        const WHOLE: &str = "width · height samples";
        let photograph = self.read(path, limits, false)?;
        let size = [photograph.image.width(), photograph.image.height()];
        let [width, height] = size.map(|side| side as u32);
        Ok(match photograph.image {
            AnyGray::U8(image) => {
                GrayImage::from_raw(width, height, image.pixels().to_vec()).expect(WHOLE).into()
            }
            AnyGray::U16(image) => {
                let image =
                    ImageBuffer::<Luma<u16>, _>::from_raw(width, height, image.pixels().to_vec());
                image.expect(WHOLE).into()
            }
        })
    }

    /// Decodes the image; errors name `path`.
    pub(crate) fn read(
        self,
        path: &Path,
        limits: &Limits,
        accept_damaged: bool,
    ) -> Result<Photograph, FramesError> {
        let without_notes = |image| Photograph { image, notes: FileNotes::default() };
        match self {
            #[cfg(feature = "video")]
            Self::File(path) if crate::folder::is_heic(&path) => {
                let camera = photograph::camera_of_heic(&path, limits);
                let notes = FileNotes { camera, ..FileNotes::default() };
                let image = crate::heic::read(&path, limits);
                image
                    .map(|image| Photograph { image, notes })
                    .map_err(|problem| FramesError::Recording { path, problem })
            }
            Self::File(path) => Ok(photograph::read_with_notes(&path, limits, accept_damaged)?),
            Self::Gray(image) => Ok(without_notes(image)),
            Self::Encoded(bytes) => {
                Ok(photograph::read_bytes(path, bytes, limits, accept_damaged)?)
            }
            #[cfg(any(feature = "mcap", feature = "rosbag1"))]
            Self::Raw(image) => {
                let problem = |problem| FramesError::Recording { path: path.to_owned(), problem };
                image.grey().map(without_notes).map_err(problem)
            }
        }
    }
}
