//! The PNG chunks and pixels that every viewer shows the same way: 8-bit grey without transparency, without a colour
//! space to interpret and without a second image.

use crate::syntax::findings::Findings;
use crate::syntax::words::is_creator;
use crate::syntax::zlib::unpack;
use deltille_files::export::kind::SOFTWARE;
use deltille_files::limits::{Exceeded, Limits};

/// The first bytes of every PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// The permitted chunks: head, resolution, writer, title, pixels and end.
const CHUNKS: [&[u8]; 6] = [b"IHDR", b"pHYs", b"tEXt", b"iTXt", b"IDAT", b"IEND"];

/// The bytes before the title: a keyword, and flags that state no compression and no language.
const TITLE: &[u8] = b"Title\0\0\0\0\0";

/// Bit depth, colour type, compression, filter and interlace method of 8-bit grey, row by row.
const GREY: [u8; 5] = [8, 0, 0, 0, 0];

/// Inspects a PNG chunk by chunk; its title must be `title`.
///
/// # Errors
///
/// Returns an error if the file is not a PNG, is truncated, or has more pixels than the limits allow.
pub(super) fn check(bytes: &[u8], title: &str, limits: &Limits) -> Result<Findings, String> {
    let mut rest = bytes.strip_prefix(&SIGNATURE).ok_or("not a readable PNG (wrong signature)")?;
    let mut found = Findings::default();
    let mut seen: Vec<&[u8]> = Vec::new();
    let (mut packed, mut first) = (Vec::new(), [].as_slice());
    while seen.last() != Some(&b"IEND".as_slice()) {
        let Chunk { kind, data, is_intact, after } =
            Chunk::first_of(rest).ok_or("not a readable PNG (truncated)")?;
        let name = String::from_utf8_lossy(kind).into_owned();
        let place = format!("byte {}", bytes.len() - rest.len());
        // Some readers refuse a wrong checksum, others ignore it.
        found.unless(is_intact, &place, format!("a wrong checksum of {name}"));
        if !CHUNKS.contains(&kind) {
            found.add(&place, format!("chunk {name}"));
        }
        let pixels = kind == b"IDAT";
        let twice = !pixels && seen.contains(&kind);
        found.unless(!twice, &place, format!("a second chunk {name}"));
        let in_row = !pixels || !seen.contains(&kind) || seen.last() == Some(&kind);
        found.unless(in_row, &place, "pixel data in two places");
        let is_title = kind != b"iTXt" || data.strip_prefix(TITLE) == Some(title.as_bytes());
        found.unseen_unless(is_title, &place, "a title other than the target's name");
        let is_software = kind != b"tEXt" || names_writer(data);
        found.unseen_unless(is_software, &place, "a Software entry other than deltille");
        found.unless(kind != b"IEND" || data.is_empty(), &place, "data in the chunk IEND");
        let head = kind == b"IHDR";
        found.unless(head == seen.is_empty(), &place, format!("misplaced chunk {name}"));
        if head {
            first = data;
        }
        // A damaged head is reported, and its pixels are not checked.
        if head && is_intact {
            check_size(data, limits).map_err(|exceeded| exceeded.to_string())?;
        }
        if pixels {
            packed.extend_from_slice(data);
        }
        if head && data.get(8..) != Some(&GREY) {
            found.add(&place, "pixels other than 8-bit grey without interlacing");
        }
        if kind == b"pHYs" && seen.contains(&b"IDAT".as_slice()) {
            found.add(&place, "the resolution after the pixels");
        }
        seen.push(kind);
        rest = after;
    }
    found.unseen_unless(seen.contains(&b"iTXt".as_slice()), "the file", "no title");
    found.unseen_unless(seen.contains(&b"tEXt".as_slice()), "the file", "no Software entry");
    let place = format!("byte {}", bytes.len() - rest.len());
    found.unless(rest.is_empty(), place, "data after the end");
    // Other pixel formats have already been reported.
    let is_whole = found.refuse() || is_whole(&packed, first);
    found.unless(is_whole, "the pixels", "a wrong checksum, or too much or too little data");
    Ok(found)
}

/// Whether the data of a `tEXt` chunk name this program as the software.
fn names_writer(words: &[u8]) -> bool {
    let name = words.strip_prefix(SOFTWARE.as_bytes()).and_then(|rest| rest.strip_prefix(b"\0"));
    name.and_then(|name| std::str::from_utf8(name).ok()).is_some_and(is_creator)
}

/// Checks the number of pixels in the data of an `IHDR` chunk against the limits.
fn check_size(head: &[u8], limits: &Limits) -> Result<(), Exceeded> {
    let (width, height) = size(head).unwrap_or_default();
    limits.check_pixels(width, height)
}

/// Checks the number of pixels of a PNG against the limits; [`check`] reports a damaged PNG.
pub(super) fn check_pixels(bytes: &[u8], limits: &Limits) -> Result<(), Exceeded> {
    let head = bytes.strip_prefix(&SIGNATURE).and_then(Chunk::first_of);
    head.map_or(Ok(()), |head| check_size(head.data, limits))
}

/// Returns width and height, px, from the data of an `IHDR` chunk.
fn size(head: &[u8]) -> Option<(u32, u32)> {
    let word = |at: usize| head.get(at..)?.first_chunk::<4>().map(|b| u32::from_be_bytes(*b));
    Some((word(0)?, word(4)?))
}

/// Whether the compressed pixels are complete, have the right checksum with nothing after it, and fill the image: one
/// filter byte and the pixels for each row. `head` is the data of `IHDR`.
fn is_whole(packed: &[u8], head: &[u8]) -> bool {
    let Some((width, height)) = size(head) else { return false };
    let length = (u64::from(width) + 1) * u64::from(height);
    unpack(packed, length, |_| ()) == Some(length)
}

/// A chunk: the length of its data, its name, the data, and a checksum of name and data.
struct Chunk<'a> {
    /// Name of the chunk.
    kind: &'a [u8],
    data: &'a [u8],
    /// Whether the checksum is that of name and data.
    is_intact: bool,
    /// The bytes after the chunk.
    after: &'a [u8],
}

impl<'a> Chunk<'a> {
    /// Returns the chunk at the beginning of these bytes.
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
