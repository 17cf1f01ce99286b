//! The PNG chunks and pixels that every viewer shows alike: grey of 8 bits without transparency,
//! without a colour space to interpret and without a second picture.

use std::io::{self, Read};

use super::Findings;

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Pixels, their size on paper, and words.
const CHUNKS: [&[u8]; 6] = [b"IHDR", b"pHYs", b"iTXt", b"tEXt", b"IDAT", b"IEND"];

/// Depth, colour type, compression, filter and interlace of 8-bit grey.
const GREY: [u8; 5] = [8, 0, 0, 0, 0];

/// Goes through the chunks of a PNG.
pub(super) fn check(bytes: &[u8]) -> Result<Findings, String> {
    let mut rest = bytes.strip_prefix(&SIGNATURE).ok_or("not a readable PNG (its signature)")?;
    let mut found = Findings::default();
    let mut seen: Vec<&[u8]> = Vec::new();
    let (mut packed, mut first) = (Vec::new(), [].as_slice());
    while seen.last() != Some(&b"IEND".as_slice()) {
        let Chunk { kind, data, is_intact, after } =
            Chunk::first_of(rest).ok_or("not a readable PNG (it is cut off)")?;
        let name = String::from_utf8_lossy(kind).into_owned();
        let place = format!("byte {}", bytes.len() - rest.len());
        // Some readers refuse what others show.
        found.unless(is_intact, &place, format!("a check sum of {name} that is wrong"));
        if !CHUNKS.contains(&kind) {
            found.add(&place, format!("chunk {name}"));
        }
        let twice = [b"IHDR".as_slice(), b"pHYs"].contains(&kind) && seen.contains(&kind);
        found.unless(!twice, &place, format!("a second chunk {name}"));
        let head = kind == b"IHDR";
        found.unless(head == seen.is_empty(), &place, format!("chunk {name} in this place"));
        if head {
            first = data;
        }
        if kind == b"IDAT" {
            packed.extend_from_slice(data);
        }
        if head && data.get(8..) != Some(&GREY) {
            found.add(&place, "pixels other than grey of 8 bits, line by line");
        }
        if kind == b"pHYs" && seen.contains(&b"IDAT".as_slice()) {
            found.add(&place, "the resolution after the pixels");
        }
        seen.push(kind);
        rest = after;
    }
    let place = format!("byte {}", bytes.len() - rest.len());
    found.unless(rest.is_empty(), place, "data after the end");
    // What is not grey of 8 bits is told already.
    let is_whole = !found.0.is_empty() || is_whole(&packed, first);
    found.unless(
        is_whole,
        "the pixels",
        "a check sum that is wrong, or more or less data than of the picture",
    );
    Ok(found)
}

/// Whether the packed pixels are whole, with their check sum and nothing behind it, and fill the picture: a byte and
/// the pixels of each row.
fn is_whole(packed: &[u8], head: &[u8]) -> bool {
    let word = |at: usize| {
        head.get(at..)?.first_chunk::<4>().map(|bytes| u64::from(u32::from_be_bytes(*bytes)))
    };
    let (Some(width), Some(height)) = (word(0), word(4)) else { return false };
    let mut pixels = flate2::bufread::ZlibDecoder::new(packed);
    let most = (width + 1) * height;
    let unpacked = io::copy(&mut (&mut pixels).take(most + 1), &mut io::sink());
    unpacked.is_ok_and(|length| length == most) && pixels.total_in() == packed.len() as u64
}

/// A chunk, which begins with the length of its content and ends with a check sum.
struct Chunk<'a> {
    /// Its name.
    kind: &'a [u8],
    data: &'a [u8],
    /// Whether the check sum is that of name and content.
    is_intact: bool,
    /// What follows the chunk.
    after: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// The chunk that these bytes begin with.
    fn first_of(bytes: &'a [u8]) -> Option<Self> {
        let (length, rest) = bytes.split_first_chunk::<4>()?;
        let (kind, rest) = rest.split_at_checked(4)?;
        let (data, rest) = rest.split_at_checked(u32::from_be_bytes(*length) as usize)?;
        let (stated, after) = rest.split_first_chunk::<4>()?;
        let mut sum = flate2::Crc::new();
        sum.update(kind);
        sum.update(data);
        Some(Self { kind, data, is_intact: sum.sum() == u32::from_be_bytes(*stated), after })
    }
}
