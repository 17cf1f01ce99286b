//! The content of a frame before it is decoded.

use std::path::{Path, PathBuf};

use deltille_core::raster::{AnyGray, FileNotes};
use deltille_files::limits::Limits;
use deltille_files::photograph::{self, Photograph};

#[cfg(any(feature = "mcap", feature = "rosbag1"))]
use crate::pixels::RawImage;
use crate::problem::FramesError;

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
