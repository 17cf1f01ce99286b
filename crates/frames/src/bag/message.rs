//! Messages of cameras: `sensor_msgs/Image` and `sensor_msgs/CompressedImage`.
//!
//! ```text
//! Header            ROS 1: sequence u32; then seconds u32, nanoseconds u32, frame id
//! Image             Header, height u32, width u32, encoding, is big-endian u8, step u32, data
//! CompressedImage   Header, format, data
//! ```
//!
//! ROS 1 has little-endian numbers without gaps. ROS 2 (CDR) states the byte order in the second of four bytes, after
//! which numbers are aligned to their size, and texts end with NUL. Texts and data follow their length.
//!
//! Sources: <https://docs.ros.org/en/api/sensor_msgs/html/msg/Image.html>; DDS-XTypes 1.3, section 7.6.3.

use deltille_files::limits::Limits;

use super::fields::Fields;
use crate::content::Content;
use crate::pixels::RawImage;
use crate::problem::Problem;

/// The bytes of a message.
pub(crate) struct Message {
    /// Time of the recording, ns.
    pub(crate) time_ns: Option<i64>,
    /// Fraction of the file up to this message.
    pub(crate) part: f64,
    pub(crate) data: Vec<u8>,
}

/// How messages are serialised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Dialect {
    Ros1,
    Cdr,
}

/// The type of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Image,
    CompressedImage,
}

/// Returns the time stamp, ns, if it is set, and the image.
pub(crate) fn image(
    mut data: Vec<u8>,
    kind: Kind,
    dialect: Dialect,
    limits: &Limits,
) -> Result<(Option<i64>, Content), Problem> {
    let mut reader = Reader::new(&data, dialect)?;
    let stamp = reader.header()?;
    if kind == Kind::CompressedImage {
        let _format = reader.text()?;
        let bytes = reader.data()?;
        data.drain(..bytes.start);
        data.truncate(bytes.len());
        return Ok((stamp, Content::Encoded(data)));
    }
    let [height, width] = [reader.u32()?, reader.u32()?];
    let encoding = reader.text()?;
    let is_big_endian = reader.fields.u8()? != 0;
    let step = reader.u32()?;
    let bytes = reader.data()?;
    data.drain(..bytes.start);
    data.truncate(bytes.len());
    let image = RawImage::new([width, height], &encoding, is_big_endian, step, data, limits)?;
    Ok((stamp, Content::Raw(image)))
}

/// Reads the fields of a message.
struct Reader<'a> {
    fields: Fields<'a>,
    dialect: Dialect,
    /// Number of bytes before the first field.
    start: usize,
}

impl<'a> Reader<'a> {
    fn new(data: &'a [u8], dialect: Dialect) -> Result<Self, Problem> {
        if dialect == Dialect::Ros1 {
            return Ok(Self { fields: Fields::new(data), dialect, start: 0 });
        }
        let (head, body) = data.split_first_chunk::<4>().ok_or_else(Problem::cut_off)?;
        let fields = if head[1] & 1 == 1 { Fields::new(body) } else { Fields::big_endian(body) };
        Ok(Self { fields, dialect, start: head.len() })
    }

    /// Reads a header and returns its time stamp, ns; `None` if it is 0.
    fn header(&mut self) -> Result<Option<i64>, Problem> {
        if self.dialect == Dialect::Ros1 {
            let _sequence = self.u32()?;
        }
        let [seconds, ns] = [self.u32()?, self.u32()?];
        let _frame = self.text()?;
        let seconds = match self.dialect {
            Dialect::Ros1 => i64::from(seconds),
            Dialect::Cdr => i64::from(seconds.cast_signed()),
        };
        Ok(Some(seconds * 1_000_000_000 + i64::from(ns)).filter(|time| *time != 0))
    }

    fn u32(&mut self) -> Result<u32, Problem> {
        self.align();
        self.fields.u32()
    }

    fn text(&mut self) -> Result<String, Problem> {
        self.align();
        self.fields.text()
    }

    /// Returns the range of the data in the message.
    fn data(&mut self) -> Result<std::ops::Range<usize>, Problem> {
        self.align();
        let count = self.fields.counted()?.len();
        let end = self.start + self.fields.position();
        Ok(end - count..end)
    }

    fn align(&mut self) {
        if self.dialect == Dialect::Cdr {
            self.fields.align(4);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a CDR message of 1 × 2 pixels.
    fn cdr(is_big_endian: bool) -> Vec<u8> {
        let number = |value: u32| {
            if is_big_endian { value.to_be_bytes() } else { value.to_le_bytes() }
        };
        let mut bytes = vec![0, u8::from(!is_big_endian), 0, 0];
        let text = |bytes: &mut Vec<u8>, text: &str| {
            bytes.extend(number(text.len() as u32 + 1));
            bytes.extend(text.as_bytes());
            bytes.push(0);
        };
        let pad = |bytes: &mut Vec<u8>| bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes.extend([number(7), number(5)].concat());
        text(&mut bytes, "camera");
        pad(&mut bytes);
        bytes.extend([number(2), number(1)].concat());
        text(&mut bytes, "mono8");
        bytes.push(0);
        pad(&mut bytes);
        bytes.extend([number(1), number(2)].concat());
        bytes.extend([3, 4]);
        bytes
    }

    #[test]
    fn both_byte_orders_are_read() {
        for is_big_endian in [false, true] {
            let limits = Limits::default();
            let found = image(cdr(is_big_endian), Kind::Image, Dialect::Cdr, &limits).unwrap();
            assert_eq!(found.0, Some(7_000_000_005));
            assert_eq!(found.1.pixels(&limits), Some(2));
        }
    }

    #[test]
    fn every_cut_off_message_is_refused() {
        let whole = cdr(false);
        for length in 0..whole.len() {
            let cut = whole[..length].to_vec();
            assert!(image(cut, Kind::Image, Dialect::Cdr, &Limits::default()).is_err(), "{length}");
        }
    }
}
