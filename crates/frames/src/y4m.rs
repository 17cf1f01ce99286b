//! Y4M, uncompressed video: a line of text, then for each frame another line and the planes.
//!
//! ```text
//! YUV4MPEG2 W640 H480 F30:1 Ip A1:1 C420jpeg
//! FRAME
//! <640·480 bytes of luma, 2·320·240 bytes of colour>
//! ```
//!
//! Luma is the grey value. Samples of more than 8 bits are little-endian; they are shifted to the full scale of 16 bits.
//!
//! Source: `yuv4mpeg(5)` of mjpegtools; ffmpeg, `libavformat/yuv4mpegdec.c`, for the names of formats with more bits.

use std::io::{self, BufRead, Read};

use deltille_core::raster::{AnyGray, Gray};
use deltille_core::words::quoted;
use deltille_files::limits::Limits;

use crate::problem::Problem;

/// Maximum length of a line, bytes: headers have fewer than 200, and comments may follow.
const LINE_BYTES: u64 = 1 << 16;

/// First word of the file.
pub(crate) const MAGIC: &str = "YUV4MPEG2";

/// The frames of a Y4M stream.
pub(crate) struct Y4m<R> {
    source: R,
    size: [usize; 2],
    /// Significant bits of a sample.
    bits: u32,
    /// Bytes of the planes beside luma.
    colour_bytes: u64,
    /// Numerator and denominator of the frame rate, 1/s, if it is constant and known.
    rate: Option<[u64; 2]>,
}

impl<R: BufRead> Y4m<R> {
    /// Reads the header; `None` if the stream is empty.
    pub(crate) fn open(mut source: R, limits: &Limits) -> Result<Option<Self>, Problem> {
        let damaged = |what: &str| Problem::Damaged(format!("not a Y4M file: {what}"));
        let line = line(&mut source)?;
        if line.is_empty() {
            return Ok(None);
        }
        let mut words = line.split(' ');
        if words.next() != Some(MAGIC) {
            return Err(damaged("it does not begin with YUV4MPEG2"));
        }
        let (mut size, mut rate, mut format) = ([None; 2], None, "420");
        for word in words {
            match word.split_at_checked(1) {
                Some(("W", value)) => size[0] = value.parse::<u32>().ok(),
                Some(("H", value)) => size[1] = value.parse::<u32>().ok(),
                Some(("F", value)) => rate = ratio(value),
                Some(("C", value)) => format = value,
                _ => {}
            }
        }
        let [Some(width), Some(height)] = size.map(|side| side.filter(|side| *side > 0)) else {
            return Err(damaged("it has no width and height"));
        };
        limits.check_pixels(width, height)?;
        let (bits, colour_bytes) = planes(format, [width, height].map(u64::from))
            .ok_or_else(|| Problem::Unsupported(format!("Y4M format {}", quoted(format))))?;
        let size = [width, height].map(|side| side as usize);
        Ok(Some(Self { source, size, bits, colour_bytes, rate }))
    }

    /// Reads the next frame; `None` at the end.
    pub(crate) fn next_frame(&mut self) -> Result<Option<AnyGray>, Problem> {
        let line = line(&mut self.source)?;
        if line.is_empty() {
            return Ok(None);
        }
        if line.split(' ').next() != Some("FRAME") {
            return Err(Problem::Damaged("a frame does not begin with FRAME".to_owned()));
        }
        let [width, height] = self.size;
        let mut bytes = vec![0; width * height * if self.bits > 8 { 2 } else { 1 }];
        self.source.read_exact(&mut bytes)?;
        let skipped = io::copy(&mut (&mut self.source).take(self.colour_bytes), &mut io::sink())?;
        if skipped < self.colour_bytes {
            return Err(Problem::cut_off());
        }
        const WHOLE: &str = "width · height samples";
        Ok(Some(match self.bits {
            8 => AnyGray::U8(Gray::from_vec(width, height, bytes).expect(WHOLE)),
            bits => {
                let samples = bytes.as_chunks::<2>().0.iter();
                let samples = samples.map(|pair| u16::from_le_bytes(*pair) << (16 - bits));
                AnyGray::U16(Gray::from_vec(width, height, samples.collect()).expect(WHOLE))
            }
        }))
    }

    /// Returns the number of frames in a file of this size, bytes.
    pub(crate) fn frames_in(&self, bytes: u64) -> u64 {
        let luma = self.size.iter().product::<usize>() as u64 * if self.bits > 8 { 2 } else { 1 };
        bytes / (luma + self.colour_bytes).max(1)
    }

    /// Returns the time of a frame from the frame rate, ns.
    pub(crate) fn time_ns(&self, frame: u64) -> Option<i64> {
        let [number, seconds] = self.rate?.map(u128::from);
        i64::try_from(u128::from(frame) * 1_000_000_000 * seconds / number).ok()
    }
}

/// Reads a line without its end; empty at the end of the stream.
fn line(source: &mut impl BufRead) -> Result<String, Problem> {
    let mut line = Vec::new();
    source.take(LINE_BYTES).read_until(b'\n', &mut line)?;
    match line.pop() {
        None => Ok(String::new()),
        Some(b'\n') => Ok(String::from_utf8_lossy(&line).into_owned()),
        Some(_) => Err(Problem::cut_off()),
    }
}

/// Parses a frame rate such as `30000:1001`; `None` if it is unknown (`0:0`).
fn ratio(text: &str) -> Option<[u64; 2]> {
    let (number, seconds) = text.split_once(':')?;
    let ratio = [number, seconds].map(|part| part.parse::<u32>().ok().filter(|part| *part > 0));
    Some([ratio[0]?.into(), ratio[1]?.into()])
}

/// Returns the bits of a sample, and the bytes of all planes but the first.
fn planes(format: &str, [width, height]: [u64; 2]) -> Option<(u32, u64)> {
    let digits = format.strip_prefix("mono").map(|bits| ("mono", bits));
    let (name, bits) = digits.or_else(|| format.split_once('p')).unwrap_or((format, ""));
    // The names of chroma positions, such as 420paldv, have no number of bits.
    let bits = bits.parse().unwrap_or(8);
    let samples = match name {
        "mono" => 0,
        name if name.starts_with("420") => 2 * width.div_ceil(2) * height.div_ceil(2),
        "411" => 2 * width.div_ceil(4) * height,
        "422" => 2 * width.div_ceil(2) * height,
        "444" => 2 * width * height,
        "444alpha" => 3 * width * height,
        _ => return None,
    };
    (8..=16).contains(&bits).then_some((bits, samples * if bits > 8 { 2 } else { 1 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(bytes: &[u8]) -> Result<Option<Y4m<&[u8]>>, Problem> {
        Y4m::open(bytes, &Limits::default())
    }

    #[test]
    fn luma_is_read_and_colours_are_skipped() {
        let mut video = open(b"YUV4MPEG2 W3 H1 F25:2 C420paldv\nFRAME\nabcUUVVFRAME Ip\ndefUUVV")
            .unwrap()
            .unwrap();
        for (row, time_ns) in [(b"abc", 0), (b"def", 80_000_000)] {
            let expected = Gray::from_vec(3, 1, row.to_vec()).unwrap();
            assert_eq!(video.next_frame().unwrap(), Some(AnyGray::U8(expected)));
            assert_eq!(video.time_ns(time_ns / 80_000_000), Some(time_ns as i64));
        }
        assert_eq!(video.next_frame().unwrap(), None);
    }

    #[test]
    fn deep_samples_have_full_scale() {
        let mut video = open(b"YUV4MPEG2 W1 H1 Cmono10\nFRAME\n\xFF\x03").unwrap().unwrap();
        let expected = Gray::from_vec(1, 1, vec![0xFFC0]).unwrap();
        assert_eq!(video.next_frame().unwrap(), Some(AnyGray::U16(expected)));
        assert_eq!(video.time_ns(1), None);
    }

    #[test]
    fn damage_is_reported() {
        assert!(open(b"").unwrap().is_none());
        for bytes in ["GIF89a\n", "YUV4MPEG2 W3\n", "YUV4MPEG2 W3 H1 C77\n", "YUV4MPEG2 W3 H1"] {
            assert!(open(bytes.as_bytes()).is_err(), "{bytes}");
        }
        let mut video = open(b"YUV4MPEG2 W3 H1 C444\nFRAME\nabcUUUVV").unwrap().unwrap();
        assert!(video.next_frame().is_err());
    }
}
