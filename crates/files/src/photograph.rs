//! Reading photographs in common formats as grey images.
//!
//! Colours become the grey values that their sensor measured, if the file still contains them, else luma. Metadata does
//! not change the pixels:
//!
//! - pixels stay in sensor orientation; the EXIF orientation is recorded but not applied, as in COLMAP and in
//!   OpenCV with `IMREAD_IGNORE_ORIENTATION`;
//! - colour profiles and gamma chunks are not applied, because the detector estimates the tone curve;
//! - a TIFF must have one page, not counting thumbnails (reduced images); of an animation, the first frame is read;
//! - a JPEG with fewer or more pixels than its header states is damaged, and refused unless damage is
//!   accepted; all other formats are read completely or not at all. JPEG and WebP have no checksums:
//!   changed bytes that decode to the stated number of pixels are not detected. In a WebP, bytes that
//!   decode to more pixels are not detected either.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use image::ImageError::Decoding;
use image::error::DecodingError;
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, RgbImage};
use tiff::tags::Tag;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::exif_notes;
use crate::limits::{self, Exceeded, Limits};
use deltille_core::raster::{AnyGray, CameraNotes, Colours, FileNotes, Gray, Intensity};
use deltille_core::setting::Setting::{LimitsMaxPixels, PhotographReadWithNotes};

/// Maximum size of decompressed metadata in a PNG (profiles and texts), bytes.
const MAX_BESIDE_BYTES: u64 = 32 << 20;

/// Number of pages of a TIFF at which counting stops.
const MAX_PAGES: usize = 1000;

/// Number of first bytes from which the format is recognised.
const HEAD_BYTES: u64 = 64;

/// Message of the strict JPEG decoder about bytes that do not affect any pixel.
const PADDING: &str = "Extra bytes between headers";

/// The marker that ends a JPEG.
const END_OF_IMAGE: &[u8] = &[0xFF, 0xD9];

/// Number of noise bytes that replace the end of the data: more than any block of pixels takes.
const NOISE_BYTES: u32 = 1000;

/// Multipliers that generate noise, with different leading bits.
const NOISES: [u32; 3] = [0x9E37_79B9, 0x45EB_CA6B, 0xF1BB_CDCB];

/// Number of trailing bytes: replacing them with noise must change the pixels. The last byte alone
/// may contain a single bit of the image, which noise may match.
const SURPLUS_BYTES: usize = 3;

/// A photograph with the relevant metadata.
#[derive(Clone, Debug, PartialEq)]
pub struct Photograph {
    /// The grey values, in sensor orientation.
    pub image: AnyGray,
    /// EXIF orientation, camera, and damage of the file.
    pub notes: FileNotes,
}

/// Error of reading an image file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file cannot be opened.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file has no content.
    #[error("{}: an empty file (0 bytes): copy it again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is not an image in a format that can be decoded.
    #[error(
        "{}: not a readable PNG, JPEG, TIFF, BMP, PGM or WebP image ({source})",
        path.display()
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: image::ImageError,
    },
    /// The image exceeds a limit.
    #[error("{}: {exceeded}", path.display())]
    Exceeded {
        /// The file.
        path: PathBuf,
        /// The limit.
        exceeded: Exceeded,
    },
    /// The JPEG does not contain exactly its stated pixels.
    #[error("{}: damaged JPEG ({problem}): replace it, or accept it with {PhotographReadWithNotes}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: String,
    },
    /// The TIFF has several pages.
    #[error("{}: TIFF with {pages} pages: save each page as a separate file", path.display())]
    Pages {
        /// The file.
        path: PathBuf,
        /// Number of pages.
        pages: usize,
    },
    /// The image, or its file, takes more memory than the limits allow, although its number of
    /// pixels does not exceed them.
    #[error(
        "{}: needs more than {bytes} bytes of memory, which is 4 for each pixel of the limit: raise {LimitsMaxPixels}",
        path.display()
    )]
    Memory {
        /// The file.
        path: PathBuf,
        /// The maximum number of bytes.
        bytes: u64,
    },
    /// The decoder panicked.
    #[error("{}: {source}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// The failure.
        source: limits::Broken,
    },
}

/// Reads a PNG, JPEG, TIFF, BMP, PGM/PPM or WebP file as a grey image in sensor orientation. Colour
/// becomes the values that a Bayer sensor [measured](Colours::measured), or luma (Rec. 709 weights). Transparency is ignored, and a depth beyond 8 bits is kept as
/// 16 bits.
///
/// The format is recognised by the content, not by the name.
///
/// # Errors
/// Returns an error if the file cannot be read, is not an image, is damaged, or exceeds the default [`Limits`].
pub fn read(path: impl AsRef<Path>) -> Result<AnyGray, ImageError> {
    read_within(path.as_ref(), &Limits::default())
}

/// Reads a photograph like [`read`], with limits other than the default.
///
/// # Errors
/// Returns an error if the file cannot be read, is not an image, is damaged, or exceeds the limits.
pub fn read_within(path: &Path, limits: &Limits) -> Result<AnyGray, ImageError> {
    Ok(read_with_notes(path, limits, false)?.image)
}

/// Reads a photograph with its metadata. A damaged JPEG is refused unless `accept_damaged` is set; its missing pixels are then
/// grey.
///
/// # Errors
/// Returns an error if the file cannot be read, is not an image, exceeds the limits, or is damaged and damage is
/// not accepted.
pub fn read_with_notes(
    path: &Path,
    limits: &Limits,
    accept_damaged: bool,
) -> Result<Photograph, ImageError> {
    let (image, notes) = decoded(path, None, limits, accept_damaged)?;
    Ok(Photograph { image: from_dynamic(image), notes })
}

/// Like [`read_with_notes`], from the bytes of a file; errors use `name`.
///
/// # Errors
/// Returns an error if the bytes are not an image, exceed the limits, or are damaged and damage is not accepted.
pub fn read_bytes(
    name: &Path,
    bytes: Vec<u8>,
    limits: &Limits,
    accept_damaged: bool,
) -> Result<Photograph, ImageError> {
    let (image, notes) = decoded(name, Some(bytes), limits, accept_damaged)?;
    Ok(Photograph { image: from_dynamic(image), notes })
}

/// Reads a photograph with its colours, within limits, in sensor orientation.
///
/// # Errors
/// Returns an error if the file cannot be read, is not an image, is damaged, or exceeds the limits.
pub fn read_colours(path: &Path, limits: &Limits) -> Result<DynamicImage, ImageError> {
    Ok(decoded(path, None, limits, false)?.0)
}

/// Returns the camera in the metadata of a HEIC file, whose pixels are not decoded here; `None` if they name none.
pub fn camera_of_heic(path: &Path, limits: &Limits) -> Option<CameraNotes> {
    exif_notes::camera_in(Cursor::new(limits.read(path).ok()?))
}

/// Decodes a file, or the bytes of a file that was read before.
fn decoded(
    path: &Path,
    bytes: Option<Vec<u8>>,
    limits: &Limits,
    accept_damaged: bool,
) -> Result<(DynamicImage, FileNotes), ImageError> {
    let broken = |source| ImageError::Broken { path: path.to_owned(), source };
    limits::caught(|| {
        let decode = |source| ImageError::Decode { path: path.to_owned(), source };
        let file = match bytes {
            Some(bytes) => ImageFile::of_bytes(path, bytes, limits)?,
            None => ImageFile::open(path, limits)?,
        };
        file.check_pages()?;
        let mut decoder = file.decoder(limits)?;
        let orientation = decoder.orientation().map_or(1, Orientation::to_exif);
        let camera = match file.format {
            Some(ImageFormat::Tiff) => exif_notes::camera_in(file.source()?),
            _ => decoder.exif_metadata().ok().flatten().and_then(exif_notes::camera),
        };
        let (image, damage) = match file.jpeg() {
            Ok(Some(image)) => (image, None),
            Ok(None) => (DynamicImage::from_decoder(decoder).map_err(decode)?, None),
            Err(problem) if !accept_damaged => {
                return Err(ImageError::Damaged { path: path.to_owned(), problem });
            }
            Err(problem) => (DynamicImage::from_decoder(decoder).map_err(decode)?, Some(problem)),
        };
        let exif_orientation = (orientation != 1).then_some(orientation);
        Ok((image, FileNotes { exif_orientation, camera, damage }))
    })
    .map_err(broken)?
}

/// Returns the number of pixels that the header of an image states; `None` if it cannot be read, and for
/// pipes, which can be read only once.
pub fn pixels(path: &Path, limits: &Limits) -> Option<u64> {
    limits::check_file(path).ok()?;
    let dimensions =
        || Some(ImageFile::open(path, limits).ok()?.decoder(limits).ok()?.dimensions());
    let (width, height) = limits::caught(dimensions).ok()??;
    Some(u64::from(width) * u64::from(height))
}

/// Returns the number of pixels that the header of a file's content states; `None` if it cannot be read.
pub fn pixels_of(bytes: &[u8]) -> Option<u64> {
    let dimensions = || {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?;
        reader.into_dimensions().ok()
    };
    let (width, height) = limits::caught(dimensions).ok()??;
    Some(u64::from(width) * u64::from(height))
}

/// An input of decoders.
trait Source: BufRead + Seek {}

impl<T: BufRead + Seek> Source for T {}

fn check_not_empty(path: &Path, length: u64) -> Result<(), ImageError> {
    match length {
        0 => Err(ImageError::Empty { path: path.to_owned() }),
        _ => Ok(()),
    }
}

/// An open image file.
struct ImageFile<'a> {
    path: &'a Path,
    /// The whole content if it is read at once: for a JPEG, because its decoders require it, and for a
    /// pipe.
    bytes: Option<Vec<u8>>,
    /// Size of the file, bytes.
    length: u64,
    format: Option<ImageFormat>,
}

impl<'a> ImageFile<'a> {
    fn open(path: &'a Path, limits: &Limits) -> Result<Self, ImageError> {
        let most = limits.picture_bytes();
        let too_many = || ImageError::Memory { path: path.to_owned(), bytes: most };
        let io = |source| ImageError::Io { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(io)?;
        let metadata = file.metadata().map_err(io)?;
        if metadata.is_file() && metadata.len() > most {
            return Err(too_many());
        }
        let mut bytes = Vec::new();
        (&mut file).take(HEAD_BYTES).read_to_end(&mut bytes).map_err(io)?;
        let format = image::guess_format(&bytes).ok();
        let is_whole = format == Some(ImageFormat::Jpeg) || !metadata.is_file();
        // A pipe without an image is not read further, because it may never end.
        if is_whole && format.is_some() {
            file.take(most).read_to_end(&mut bytes).map_err(io)?;
            if bytes.len() as u64 > most {
                return Err(too_many());
            }
        }
        let length = if metadata.is_file() { metadata.len() } else { bytes.len() as u64 };
        check_not_empty(path, length)?;
        check_webp(path, format, &bytes, length)?;
        Ok(Self { path, bytes: is_whole.then_some(bytes), length, format })
    }

    /// An image file from bytes that were read before.
    fn of_bytes(path: &'a Path, bytes: Vec<u8>, limits: &Limits) -> Result<Self, ImageError> {
        let (most, length) = (limits.picture_bytes(), bytes.len() as u64);
        if length > most {
            return Err(ImageError::Memory { path: path.to_owned(), bytes: most });
        }
        check_not_empty(path, length)?;
        let format = image::guess_format(&bytes).ok();
        check_webp(path, format, &bytes, length)?;
        Ok(Self { path, bytes: Some(bytes), length, format })
    }

    fn source(&self) -> Result<Box<dyn Source + '_>, ImageError> {
        let io = |source| ImageError::Io { path: self.path.to_owned(), source };
        Ok(match &self.bytes {
            Some(bytes) => Box::new(Cursor::new(bytes)),
            None => Box::new(BufReader::new(File::open(self.path).map_err(io)?)),
        })
    }

    /// Returns a decoder that has read the header, if the image is within the limits.
    fn decoder(&self, limits: &Limits) -> Result<impl ImageDecoder, ImageError> {
        let path = || self.path.to_owned();
        let decode = |source| ImageError::Decode { path: path(), source };
        let exceeded = |exceeded| ImageError::Exceeded { path: path(), exceeded };
        let mut reader = ImageReader::new(self.source()?);
        if let Some(format) = self.format {
            reader.set_format(format);
        }
        let mut most = image::Limits::no_limits();
        most.max_alloc = Some(match self.format {
            Some(ImageFormat::Png) => MAX_BESIDE_BYTES,
            _ => limits.picture_bytes(),
        });
        reader.limits(most);
        let decoder = reader.into_decoder().map_err(decode)?;
        let (width, height) = decoder.dimensions();
        limits.check_photograph(width, height, self.length).map_err(exceeded)?;
        let bytes = limits.picture_bytes();
        if decoder.total_bytes() > bytes {
            return Err(ImageError::Memory { path: path(), bytes });
        }
        Ok(decoder)
    }

    /// Refuses a TIFF with several pages, because it is not known which one is meant.
    fn check_pages(&self) -> Result<(), ImageError> {
        if self.format != Some(ImageFormat::Tiff) {
            return Ok(());
        }
        match pages(self.source()?) {
            // The decoder reports the problem.
            Ok(0 | 1) | Err(_) => Ok(()),
            Ok(pages) => Err(ImageError::Pages { path: self.path.to_owned(), pages }),
        }
    }

    /// Returns the pixels of an undamaged JPEG, or the problem; `None` for other files, and for colour
    /// spaces that need their profile.
    fn jpeg(&self) -> Result<Option<DynamicImage>, String> {
        let (Some(ImageFormat::Jpeg), Some(bytes)) = (self.format, &self.bytes) else {
            return Ok(None);
        };
        let problem = |error: DecodeErrors| one_line(&error.to_string());
        let mut decoder = jpeg_decoder(bytes, true);
        let mut pixels = decoder.decode().map_err(problem);
        if pixels.as_ref().is_err_and(|problem| problem.contains(PADDING)) {
            decoder = jpeg_decoder(bytes, false);
            pixels = decoder.decode().map_err(problem);
        }
        let pixels = pixels?;
        check_scans(bytes, &pixels)?;
        let (width, height) = decoder.dimensions().unwrap_or_default();
        let as_seen = matches!(
            decoder.input_colorspace(),
            Some(ColorSpace::Luma | ColorSpace::RGB | ColorSpace::YCbCr)
        );
        let image = RgbImage::from_raw(width as u32, height as u32, pixels);
        Ok(image.filter(|_| as_seen).map(DynamicImage::ImageRgb8))
    }
}

/// Refuses a WebP that is shorter than its header states.
fn check_webp(
    path: &Path,
    format: Option<ImageFormat>,
    head: &[u8],
    length: u64,
) -> Result<(), ImageError> {
    if format == Some(ImageFormat::WebP) && riff_bytes(head).is_none_or(|whole| length < whole) {
        let source = DecodingError::new(ImageFormat::WebP.into(), "the file is truncated");
        return Err(ImageError::Decode { path: path.to_owned(), source: Decoding(source) });
    }
    Ok(())
}

fn jpeg_decoder(bytes: &[u8], strict: bool) -> JpegDecoder<ZCursor<&[u8]>> {
    let options = DecoderOptions::default()
        .set_strict_mode(strict)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    JpegDecoder::new_with_options(ZCursor::new(bytes), options)
}

/// Refuses a JPEG with missing pixels, or with data beyond its last pixel. The decoder reports
/// neither, so it is run again on modified data: noise after the last byte must not change a pixel,
/// and noise in place of the last bytes must.
fn check_scans(bytes: &[u8], pixels: &[u8]) -> Result<(), String> {
    let Scans { end, is_one_run } = Scans::of(bytes);
    // Without a trailing 0xFF: it begins markers, and within a scan it is followed by 0.
    let scans = trimmed(&bytes[..end.unwrap_or(bytes.len())], |byte| byte == 0xFF);
    let noises = NOISES.map(|factor: u32| -> Vec<u8> {
        (1..NOISE_BYTES).map(|i| (i.wrapping_mul(factor) >> 24) as u8 & 0xFE).collect()
    });
    let is_shown_by = |scans: &[u8], noise: &Vec<u8>, strict: bool| {
        let found = jpeg_decoder(&[scans, noise, END_OF_IMAGE].concat(), strict).decode();
        found.is_ok_and(|found| found == pixels)
    };
    if !is_shown_by(scans, &noises[0], false) {
        return Err("pixels are missing".to_owned());
    }
    // Some cameras pad the last words.
    let used = trimmed(scans, |byte| matches!(byte, 0 | 0xFF));
    let used = &used[..used.len().saturating_sub(SURPLUS_BYTES)];
    if is_one_run && noises.iter().all(|noise| is_shown_by(used, noise, true)) {
        return Err("there are data after the last pixel".to_owned());
    }
    Ok(())
}

/// The bytes without trailing ones that satisfy `of`.
fn trimmed(bytes: &[u8], of: impl Fn(u8) -> bool) -> &[u8] {
    let end = bytes.iter().rposition(|&byte| !of(byte)).map_or(0, |last| last + 1);
    &bytes[..end]
}

/// The length that the header of a RIFF file states, bytes.
fn riff_bytes(head: &[u8]) -> Option<u64> {
    let beyond = head.get(4..)?.first_chunk::<4>()?;
    Some(8 + u64::from(u32::from_le_bytes(*beyond)))
}

/// Position and kind of the entropy-coded data of a JPEG.
struct Scans {
    /// Offset of the marker that ends the image, if there is one.
    end: Option<usize>,
    /// Whether the data are one contiguous run of codes, neither progressive nor with restarts.
    is_one_run: bool,
}

impl Scans {
    fn of(bytes: &[u8]) -> Self {
        let (mut at, mut is_one_run) = (2, true);
        // Within a scan, 0xFF is followed by 0 or a restart.
        let is_marker =
            |pair: &[u8]| pair[0] == 0xFF && !matches!(pair[1], 0 | 1 | 0xD0..=0xD8 | 0xFF);
        while let Some(next) = bytes.get(at..).and_then(|rest| rest.windows(2).position(is_marker))
        {
            at += next;
            if bytes[at..].starts_with(END_OF_IMAGE) {
                return Self { end: Some(at), is_one_run };
            }
            // Progressive frames of both kinds, and restarts.
            is_one_run &= !matches!(bytes[at + 1], 0xC2 | 0xCA | 0xDD);
            let length = bytes.get(at + 2..).and_then(|rest| rest.first_chunk::<2>());
            at += 2 + length.map_or(0, |length| usize::from(u16::from_be_bytes(*length)));
        }
        Self { end: None, is_one_run }
    }
}

/// The message of the decoder in one line, without quotation marks.
fn one_line(problem: &str) -> String {
    let words: Vec<&str> = problem.trim_matches('"').split_whitespace().collect();
    words.join(" ")
}

/// Number of pages of a TIFF, without reduced copies of others.
fn pages(source: impl BufRead + Seek) -> tiff::TiffResult<usize> {
    let mut file = tiff::decoder::Decoder::new(source)?;
    let mut pages = 0;
    for _ in 0..MAX_PAGES {
        let kind: u32 = file.find_tag_unsigned(Tag::NewSubfileType)?.unwrap_or(0);
        pages += usize::from(kind & 1 == 0);
        if !file.more_images() {
            break;
        }
        file.next_image()?;
    }
    Ok(pages)
}

fn from_dynamic(image: DynamicImage) -> AnyGray {
    use DynamicImage::{
        ImageLuma16, ImageLumaA16, ImageRgb8, ImageRgb16, ImageRgb32F, ImageRgba8, ImageRgba16,
        ImageRgba32F,
    };
    const WRONG_SIZE: &str = "the decoder returns width · height pixels";
    fn colours<T: Intensity>(
        (width, height): (u32, u32),
        channels: usize,
        values: &[T],
    ) -> Colours<'_, T> {
        Colours::new(width as usize, height as usize, channels, values).expect(WRONG_SIZE)
    }
    let size = (image.width(), image.height());
    let of_sensor = match &image {
        ImageRgb8(image) => return AnyGray::U8(colours(size, 3, image.as_raw()).grey()),
        ImageRgba8(image) => return AnyGray::U8(colours(size, 4, image.as_raw()).grey()),
        ImageRgb16(image) => colours(size, 3, image.as_raw()).measured(),
        ImageRgba16(image) => colours(size, 4, image.as_raw()).measured(),
        _ => None,
    };
    if let Some(grey) = of_sensor {
        return AnyGray::U16(grey);
    }
    let (width, height) = (size.0 as usize, size.1 as usize);
    match image {
        ImageLuma16(_) | ImageLumaA16(_) | ImageRgb16(_) | ImageRgba16(_) | ImageRgb32F(_)
        | ImageRgba32F(_) => AnyGray::U16(
            Gray::from_vec(width, height, image.into_luma16().into_raw()).expect(WRONG_SIZE),
        ),
        _ => AnyGray::U8(
            Gray::from_vec(width, height, image.into_luma8().into_raw()).expect(WRONG_SIZE),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every colour has the luma that the `image` crate computes.
    #[test]
    fn colours_have_the_luma_of_the_image_crate() {
        let pair = |pair: u32| [(pair >> 8) as u8, pair as u8];
        for red in 0..=u8::MAX {
            let colours = (0..1 << 16).map(pair).flat_map(|[green, blue]| [red, green, blue]);
            let image = RgbImage::from_raw(256, 256, colours.collect()).unwrap();
            let grey = from_dynamic(image.clone().into());
            let expected = DynamicImage::from(image).into_luma8().into_raw();
            assert!(grey == AnyGray::U8(Gray::from_vec(256, 256, expected).unwrap()), "{red}");
        }
    }

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
    fn errors_name_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let text = dir.path().join("notes.png");
        std::fs::write(&text, "no image").unwrap();
        let message = read(&text).unwrap_err().to_string();
        assert!(message.contains("notes.png") && message.contains("not a readable"), "{message}");
        assert!(read(dir.path().join("absent.png")).is_err());
    }
}
