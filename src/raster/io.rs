//! Reading photographs of any common format as grey images.

use std::path::{Path, PathBuf};

use image::{DynamicImage, ImageReader, Limits};

use super::Gray;

/// Largest allocation that a decoder may ask for: a 100-megapixel colour image of 16 bits takes
/// 600 MB, so 2 GiB leaves room and still stops a forged header.
const MAX_DECODER_BYTES: u64 = 2 << 30;

/// A grey image in the depth of its file.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyGray {
    /// 8 bits.
    U8(Gray<u8>),
    /// 16 bits.
    U16(Gray<u16>),
}

impl AnyGray {
    /// Width in pixels.
    pub fn width(&self) -> usize {
        match self {
            Self::U8(image) => image.width(),
            Self::U16(image) => image.width(),
        }
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        match self {
            Self::U8(image) => image.height(),
            Self::U16(image) => image.height(),
        }
    }
}

/// An image file that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be opened.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not an image that can be decoded.
    #[error(
        "{}: not a readable PNG, JPEG, TIFF, BMP, PGM or WebP image ({source})",
        path.display()
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// Why.
        source: image::ImageError,
    },
}

/// Reads a PNG, JPEG, TIFF, BMP, PGM/PPM or WebP file; colour becomes luma (Rec. 709 weights),
/// transparency is ignored, depth beyond 8 bits is kept as 16 bits.
///
/// The format is told from the content, not from the name.
pub fn read(path: &Path) -> Result<AnyGray, ImageError> {
    let io = |source| ImageError::Io { path: path.to_owned(), source };
    let decode = |source| ImageError::Decode { path: path.to_owned(), source };
    let mut reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    reader.limits(limits);
    Ok(from_dynamic(reader.decode().map_err(decode)?))
}

fn from_dynamic(image: DynamicImage) -> AnyGray {
    use DynamicImage::{
        ImageLuma16, ImageLumaA16, ImageRgb16, ImageRgb32F, ImageRgba16, ImageRgba32F,
    };
    let (width, height) = (image.width() as usize, image.height() as usize);
    let deep = matches!(
        image,
        ImageLuma16(_)
            | ImageLumaA16(_)
            | ImageRgb16(_)
            | ImageRgba16(_)
            | ImageRgb32F(_)
            | ImageRgba32F(_)
    );
    let wrong_size = "the decoder returns width · height pixels";
    if deep {
        AnyGray::U16(
            Gray::from_vec(width, height, image.into_luma16().into_raw()).expect(wrong_size),
        )
    } else {
        AnyGray::U8(Gray::from_vec(width, height, image.into_luma8().into_raw()).expect(wrong_size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_is_kept_and_colour_becomes_luma() {
        let dir = tempfile::tempdir().unwrap();
        let deep = dir.path().join("deep.png");
        image::ImageBuffer::from_pixel(3, 2, image::Luma([40_000u16])).save(&deep).unwrap();
        assert_eq!(
            read(&deep).unwrap(),
            AnyGray::U16(Gray::from_vec(3, 2, vec![40_000; 6]).unwrap())
        );

        let colour = dir.path().join("colour.bmp");
        image::ImageBuffer::from_pixel(2, 2, image::Rgb([90u8, 90, 90])).save(&colour).unwrap();
        assert_eq!(read(&colour).unwrap(), AnyGray::U8(Gray::from_vec(2, 2, vec![90; 4]).unwrap()));
    }

    #[test]
    fn other_files_are_named_in_the_error() {
        let dir = tempfile::tempdir().unwrap();
        let text = dir.path().join("notes.png");
        std::fs::write(&text, "no image").unwrap();
        let message = read(&text).unwrap_err().to_string();
        assert!(message.contains("notes.png") && message.contains("not a readable"), "{message}");
        assert!(read(&dir.path().join("absent.png")).is_err());
    }
}
