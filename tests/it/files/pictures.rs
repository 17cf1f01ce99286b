//! Photographs with damaged files or with metadata.

use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

use crate::common::png::chunk;
use deltille::limits::Limits;
use deltille::photograph::{self, ImageError, Photograph};
use deltille::raster::{AnyGray, FileNotes, Gray};
use image::{DynamicImage, GrayImage, ImageFormat};
use tempfile::TempDir;
use tiff::encoder::colortype::Gray8;
use tiff::encoder::{ImageEncoder, TiffEncoder, TiffKind};
use tiff::tags::Tag;

const WIDTH: u32 = 160;
const HEIGHT: u32 = 120;

/// An image with detail everywhere.
fn picture() -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| image::Luma([(x * x / 7 + y * 3 + (x ^ y) * 5) as u8]))
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    // WebP and JPEG have colours, like files of cameras.
    let image = DynamicImage::ImageLuma8(picture()).to_rgb8();
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    fn read(&self, bytes: &[u8], accept_damaged: bool) -> Result<Photograph, ImageError> {
        photograph::read_with_notes(
            &self.file("picture", bytes),
            &Limits::default(),
            accept_damaged,
        )
    }
}

fn gray(photograph: Photograph) -> Gray<u8> {
    match photograph.image {
        AnyGray::U8(image) => image,
        AnyGray::U16(_) => panic!("8 bits were written"),
    }
}

#[test]
fn truncated_jpegs_are_refused_unless_damage_is_accepted() {
    let (folder, whole) = (Folder::new(), encoded(ImageFormat::Jpeg));
    assert_eq!(folder.read(&whole, false).unwrap().notes, FileNotes::default());
    let scan = whole.windows(2).position(|marker| marker == [0xFF, 0xDA]).unwrap() + 14;
    let cut = |end: usize| whole[..end].to_vec();
    let hole = |at: usize| [&whole[..at], &whole[at + 200..]].concat();
    let places = (scan..whole.len() - 2).step_by((whole.len() - scan) / 40);
    let holes = (scan..whole.len() - whole.len() / 4).step_by((whole.len() - scan) / 10).map(hole);
    // Some programs and cameras end incomplete files like this.
    let ended = |end: usize| [&whole[..end], &[0xFF, 0xD9]].concat();
    let ended = (scan..whole.len() - 40).step_by((whole.len() - scan) / 10).map(ended);
    for damaged in places.map(cut).chain(holes).chain(ended) {
        let of = format!("{} of {} bytes", damaged.len(), whole.len());
        let error = folder.read(&damaged, false).expect_err(&of);
        assert!(matches!(error, ImageError::Damaged { .. }), "{of}: {error}");
        assert!(!error.to_string().contains(['\n', '"']), "{of}: {error}");
        let accepted = folder.read(&damaged, true).expect(&of);
        assert!(accepted.notes.damage.is_some(), "{of}");
        assert_eq!(gray(accepted).width(), WIDTH as usize, "{of}");
    }
    // Without its last marker, it still has all pixels.
    let unended = folder.read(&cut(whole.len() - 2), false).unwrap();
    assert_eq!(unended, folder.read(&whole, false).unwrap());
}

#[test]
fn jpegs_with_surplus_data_are_damaged() {
    let (folder, whole) = (Folder::new(), encoded(ImageFormat::Jpeg));
    let pixels = folder.read(&whole, false).unwrap();
    let end = whole.len() - 2;
    let with = |more: &[u8]| [&whole[..end], more, &whole[end..]].concat();
    let scan = whole.windows(2).position(|marker| marker == [0xFF, 0xDA]).unwrap() + 14;
    let twice = [&whole[..scan + 900], &whole[scan + 600..]].concat();
    let frame = whole.windows(2).position(|marker| marker == [0xFF, 0xC0]).unwrap();
    let mut too_low = whole.clone();
    let height = u16::from_be_bytes([whole[frame + 5], whole[frame + 6]]) - 16;
    too_low[frame + 5..frame + 7].copy_from_slice(&height.to_be_bytes());
    for damaged in [with(&whole[scan..scan + 100]), twice, too_low] {
        let error = folder.read(&damaged, false).unwrap_err();
        assert!(matches!(error, ImageError::Damaged { .. }), "{error}");
        assert!(folder.read(&damaged, true).unwrap().notes.damage.is_some());
    }
    // Cameras pad their data to whole words.
    for fill in [&[0; 7][..], &[0xFF; 3], &[0; 500]] {
        assert_eq!(folder.read(&with(fill), false).unwrap(), pixels, "{fill:?}");
    }
}

/// Some programs leave unused bytes between the parts of a header.
#[test]
fn padding_between_headers_does_not_hide_damage() {
    let (folder, whole) = (Folder::new(), encoded(ImageFormat::Jpeg));
    let table = whole.windows(2).position(|marker| marker == [0xFF, 0xDB]).unwrap();
    let padded =
        |end: usize| [&whole[..table], &[0; 4], &whole[table..end], &[0xFF, 0xD9]].concat();
    let pixels = folder.read(&whole, false).unwrap();
    assert_eq!(folder.read(&padded(whole.len() - 2), false).unwrap(), pixels);
    assert!(folder.read(&padded(whole.len() / 2), false).is_err());
}

#[test]
fn other_formats_are_read_completely_or_not_at_all() {
    let folder = Folder::new();
    let formats = [
        ImageFormat::Png,
        ImageFormat::Tiff,
        ImageFormat::Bmp,
        ImageFormat::Pnm,
        ImageFormat::WebP,
    ];
    for format in formats {
        let whole = encoded(format);
        let pixels = gray(folder.read(&whole, false).unwrap());
        assert_eq!(pixels.pixels(), picture().as_raw(), "{format:?}");
        for end in (1..whole.len()).step_by(whole.len() / 40) {
            // The missing part may be metadata after the pixels.
            if let Ok(read) = folder.read(&whole[..end], false) {
                assert_eq!(gray(read), pixels, "{format:?}, {end} of {} bytes", whole.len());
            }
        }
    }
}

/// A JPEG with an EXIF block that asks viewers to rotate it.
fn turned_jpeg(orientation: u8) -> Vec<u8> {
    let whole = encoded(ImageFormat::Jpeg);
    let mut exif = b"Exif\0\0II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0, 0]);
    let length = (exif.len() + 2) as u16;
    [&whole[..2], &[0xFF, 0xE1], &length.to_be_bytes(), &exif, &whole[2..]].concat()
}

#[test]
fn pixels_stay_in_sensor_orientation() {
    let folder = Folder::new();
    let plain = folder.read(&encoded(ImageFormat::Jpeg), false).unwrap();
    for orientation in 1..=8 {
        let turned = folder.read(&turned_jpeg(orientation), false).unwrap();
        assert_eq!(turned.image, plain.image);
        assert_eq!(turned.notes.exif_orientation, (orientation > 1).then_some(orientation));
    }
}

/// EXIF of a camera, lens and focal length, as piexif 1.1.3 writes them.
const EXIF_OF_CAMERA: &[u8] = b"Exif\0\0MM\0*\0\0\0\x08\0\x03\x01\x0f\0\x02\0\0\0\x06\0\0\x002\x01\x10\0\x02\0\0\0\r\0\0\08\x87i\0\x04\0\0\0\x01\0\0\0E\0\0\0\0Canon\0Canon EOS R6\0\0\x04\x92\n\0\x05\0\0\0\x01\0\0\0w\xa4\x05\0\x03\0\0\0\x01\0\x18\0\0\xa41\0\x02\0\0\0\r\0\0\0\x7f\xa44\0\x02\0\0\0\x17\0\0\0\x8c\0\0\0\x18\0\0\0\x01012345678901\0RF24-105mm F4 L IS USM\0";

/// The camera is read from a JPEG, and from a PNG with the same metadata.
#[test]
fn the_camera_of_a_photograph_is_noted() {
    let folder = Folder::new();
    let (jpeg, png) = (encoded(ImageFormat::Jpeg), encoded(ImageFormat::Png));
    let length = (EXIF_OF_CAMERA.len() + 2) as u16;
    let jpeg =
        [&jpeg[..2], &[0xFF, 0xE1], &length.to_be_bytes(), EXIF_OF_CAMERA, &jpeg[2..]].concat();
    let head = 8 + 25;
    let png = [&png[..head], &chunk(b"eXIf", &EXIF_OF_CAMERA[6..]), &png[head..]].concat();
    for whole in [jpeg, png] {
        let notes = folder.read(&whole, false).unwrap().notes;
        assert_eq!(
            serde_json::to_value(notes).unwrap(),
            serde_json::json!({"camera": {
                "make": "Canon", "model": "Canon EOS R6", "serial": "012345678901",
                "lens": "RF24-105mm F4 L IS USM", "focal_mm": 24.0, "focal_35mm_mm": 24.0,
            }})
        );
    }
}

#[test]
fn colour_profiles_and_gamma_do_not_change_pixels() {
    let (folder, whole) = (Folder::new(), encoded(ImageFormat::Png));
    let plain = folder.read(&whole, false).unwrap();
    let head = 8 + 25;
    for chunk in [
        chunk(b"gAMA", &100_000u32.to_be_bytes()),
        chunk(b"gAMA", &45_455u32.to_be_bytes()),
        chunk(b"sRGB", &[0]),
        chunk(b"iCCP", b"profile\0\0x\x9c\x03\0\0\0\0\x01"),
    ] {
        let profiled = [&whole[..head], &chunk, &whole[head..]].concat();
        assert_eq!(folder.read(&profiled, false).unwrap(), plain);
    }
}

/// A TIFF of these pages, each of a kind: 0, or 1 for a reduced copy of another.
fn tiff_of(pages: &[u32]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut file = TiffEncoder::new(&mut bytes).unwrap();
    for &kind in pages {
        let mut page = file.new_image::<Gray8>(WIDTH, HEIGHT).unwrap();
        say_kind(&mut page, kind);
        page.write_data(picture().as_raw()).unwrap();
    }
    bytes.into_inner()
}

fn say_kind<K: TiffKind>(page: &mut ImageEncoder<'_, &mut Cursor<Vec<u8>>, Gray8, K>, kind: u32) {
    page.encoder().write_tag(Tag::NewSubfileType, kind).unwrap();
}

#[test]
fn a_tiff_has_one_page() {
    let folder = Folder::new();
    for pages in [&[0][..], &[0, 1], &[0, 1, 1]] {
        let read = folder.read(&tiff_of(pages), false).unwrap();
        assert_eq!(gray(read).pixels(), picture().as_raw());
    }
    let error = folder.read(&tiff_of(&[0, 0, 1, 0]), false).unwrap_err();
    assert!(matches!(error, ImageError::Pages { pages: 3, .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn pipes_are_read_like_files() {
    let folder = Folder::new();
    for format in [ImageFormat::Jpeg, ImageFormat::Png, ImageFormat::Tiff] {
        let (bytes, pipe) = (encoded(format), folder.0.path().join(format!("{format:?}")));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.is_ok_and(|status| status.success()));
        let expected = folder.read(&bytes, false).unwrap();
        let writer = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::write(pipe, bytes)
        });
        let found = photograph::read_with_notes(&pipe, &Limits::default(), false).unwrap();
        writer.join().unwrap().unwrap();
        assert_eq!(found, expected, "{format:?}");
    }
}
