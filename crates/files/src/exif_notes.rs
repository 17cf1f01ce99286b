//! The camera that the EXIF metadata of a photograph name.
//!
//! EXIF is not needed to read the pixels, so metadata that are damaged or beyond the limits are ignored.

use std::io::{BufRead, Seek};

use deltille_core::quantity::nominal_focal_mm;
use deltille_core::raster::CameraNotes;
use exif::{Exif, In, Reader, Tag, Value};

use crate::limits;

/// Largest metadata that are read, bytes. A JPEG has at most 64 KiB.
const MAX_BYTES: usize = 256 << 10;

/// Number of characters at which texts are cut; names of lenses have up to about 60.
const MAX_CHARS: usize = 100;

/// Returns the camera in the EXIF metadata of a file; `None` if they do not name any.
pub(crate) fn camera(exif: Vec<u8>) -> Option<CameraNotes> {
    if exif.len() > MAX_BYTES {
        return None;
    }
    parsed(|reader| reader.read_raw(exif))
}

/// Returns the camera that a HEIC or TIFF file names; `None` if it does not name any.
pub(crate) fn camera_in(mut file: impl BufRead + Seek) -> Option<CameraNotes> {
    parsed(|reader| reader.read_from_container(&mut file))
}

fn parsed(read: impl FnOnce(&Reader) -> Result<Exif, exif::Error>) -> Option<CameraNotes> {
    let camera = limits::caught(|| {
        // One wrong entry, as of some editors, does not affect the others.
        let mut reader = Reader::new();
        let read = read(reader.continue_on_error(true));
        let exif = read.or_else(|error| error.distill_partial_result(|_| ())).ok()?;
        Some(CameraNotes {
            make: text(&exif, Tag::Make),
            model: text(&exif, Tag::Model),
            serial: text(&exif, Tag::BodySerialNumber),
            lens: text(&exif, Tag::LensModel),
            focal_mm: focal_mm(&exif, Tag::FocalLength),
            focal_35mm_mm: focal_mm(&exif, Tag::FocalLengthIn35mmFilm),
        })
    });
    camera.ok().flatten().filter(|camera| !camera.is_empty())
}

/// Returns a text in one line without control characters; `None` if nothing is left.
fn text(exif: &Exif, tag: Tag) -> Option<String> {
    let Value::Ascii(parts) = &exif.get_field(tag, In::PRIMARY)?.value else { return None };
    let text = String::from_utf8_lossy(parts.first()?);
    let words: Vec<&str> = text.split(|c: char| c.is_whitespace() || c.is_control()).collect();
    let words = words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ");
    let cut: String = words.chars().take(MAX_CHARS).collect();
    Some(cut).filter(|text| !text.is_empty())
}

/// Returns a focal length, mm; `None` if it is not known, which cameras write as 0.
fn focal_mm(exif: &Exif, tag: Tag) -> Option<f64> {
    let mm = match &exif.get_field(tag, In::PRIMARY)?.value {
        Value::Rational(values) => values.first()?.to_f64(),
        Value::Double(values) => *values.first()?,
        Value::Short(values) => f64::from(*values.first()?),
        _ => return None,
    };
    nominal_focal_mm::RANGE.check(mm).ok()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// EXIF of piexif 1.1.3: `piexif.dump` of make, model, focal lengths, serial number and lens.
    const PIEXIF: &[u8] = b"MM\0*\0\0\0\x08\0\x03\x01\x0f\0\x02\0\0\0\x06\0\0\x002\x01\x10\0\x02\0\0\0\r\0\0\08\x87i\0\x04\0\0\0\x01\0\0\0E\0\0\0\0Canon\0Canon EOS R6\0\0\x04\x92\n\0\x05\0\0\0\x01\0\0\0w\xa4\x05\0\x03\0\0\0\x01\0\x18\0\0\xa41\0\x02\0\0\0\r\0\0\0\x7f\xa44\0\x02\0\0\0\x17\0\0\0\x8c\0\0\0\x18\0\0\0\x01012345678901\0RF24-105mm F4 L IS USM\0";

    /// EXIF of Pillow 13.0.0, which writes the focal length as a double.
    const PILLOW: &[u8] = b"MM\0*\0\0\0\x08\0\x03\x01\x0f\0\x02\0\0\0\x06\0\0\x002\x01\x10\0\x02\0\0\0\x0e\0\0\08\x87i\0\x04\0\0\0\x01\0\0\0F\0\0\0\0Apple\0iPhone 15 Pro\0\0\x03\x92\n\0\x0c\0\0\0\x01\0\0\0p\xa4\x05\0\x03\0\0\0\x01\0\x18\0\0\xa44\0\x02\0\0\x000\0\0\0x\0\0\0\0@\x1b\x0f\\\x1f\xf7\xa8TiPhone 15 Pro back triple camera 6.765mm f/1.78\0";

    /// A photograph of 16 × 16 px by pillow-heif 1.8.1 with make and model.
    const HEIC: &[u8] = include_bytes!("../../../tests/recordings/camera.heic");

    #[test]
    fn metadata_of_other_writers_are_read() {
        let text = |text: &str| Some(text.to_owned());
        let expected = CameraNotes {
            make: text("Canon"),
            model: text("Canon EOS R6"),
            serial: text("012345678901"),
            lens: text("RF24-105mm F4 L IS USM"),
            focal_mm: Some(24.0),
            focal_35mm_mm: Some(24.0),
        };
        assert_eq!(camera(PIEXIF.to_vec()), Some(expected));
        let phone = camera(PILLOW.to_vec()).unwrap();
        assert_eq!(phone.lens, text("iPhone 15 Pro back triple camera 6.765mm f/1.78"));
        assert_eq!(phone.focal_mm, Some(6.764_999_866));
        assert_eq!((phone.focal_35mm_mm, phone.serial.clone()), (Some(24.0), None));
        let photograph = camera_in(Cursor::new(HEIC)).unwrap();
        assert_eq!(photograph.model, text("iPhone 15 Pro"));
        assert_eq!(camera_in(Cursor::new(&HEIC[..400])), None);
        // Without its pixels, a TIFF has the same form.
        assert_eq!(camera_in(Cursor::new(PILLOW)), Some(phone));
    }

    /// Truncated and changed metadata, and those with a huge count, are read in part or ignored.
    #[test]
    fn damaged_metadata_are_harmless() {
        for whole in [PIEXIF, PILLOW] {
            for at in 0..whole.len() {
                camera(whole[..at].to_vec());
                for value in [0, 0x7F, 0xFF] {
                    let mut changed = whole.to_vec();
                    changed[at] = value;
                    if let Some(camera) = camera(changed) {
                        let json = serde_json::to_string(&camera).unwrap();
                        assert_eq!(serde_json::from_str::<CameraNotes>(&json).unwrap(), camera);
                    }
                }
            }
        }
        let large = [PIEXIF, &vec![0; MAX_BYTES]].concat();
        assert_eq!(camera(large), None);
    }

    #[test]
    fn texts_are_one_line_and_unknown_numbers_are_left_out() {
        let mut odd = PIEXIF.to_vec();
        let at = |part: &[u8]| PIEXIF.windows(part.len()).position(|bytes| bytes == part).unwrap();
        odd[at(b"Canon\0")..][..5].copy_from_slice(b" A\x1B\nB");
        odd[at(b"RF24")] = 0xFF;
        // A focal length of 24/0 mm.
        odd[at(b"\0\0\0\x01012345") + 3] = 0;
        let camera = camera(odd).unwrap();
        assert_eq!(camera.make.as_deref(), Some("A B"));
        assert_eq!(camera.lens.as_deref(), Some("\u{FFFD}F24-105mm F4 L IS USM"));
        assert_eq!(camera.focal_mm, None);
    }
}
