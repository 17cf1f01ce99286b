//! Recognises the kind of a file by its content, so no file replaces one of another kind or of another writer.
//!
//! Many formats name their writer: the schema of a JSON, the creator of a PDF, the software of a PNG, the generator of a glTF, the
//! first part of a 3MF, the header of an STL, and a comment in the first lines of a text. Other files are recognised by their
//! beginning, for example the header of a CSV, or by the keys of a JSON.

use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use crate::export::detections::dsc;
use deltille_core::json;
use deltille_core::words::cut;

/// Number of first lines of a text that may contain the comment.
const HEAD_LINES: usize = 3;

/// Number of first bytes of a text that contain its first lines.
const HEAD: usize = 4096;

/// The creator entry of a PDF of this program.
const PDF_CREATOR: &[u8] = b"/Creator(deltille ";

/// The first bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";

/// Description of a list of corners for other detectors; the format does not name its writer.
const DSC: &str = "a .dsc";

/// The kind of a file. Two files of one kind have the same format and, if it is stated, the same writer.
#[derive(Clone, Debug)]
pub struct Kind(Is);

#[derive(Clone, Debug)]
enum Is {
    /// A JSON file with this schema.
    Schema(String),
    /// A kind described by these words.
    Words(String),
}

impl PartialEq for Kind {
    /// Versions of one schema are the same kind.
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Is::Schema(one), Is::Schema(other)) => json::kind(one) == json::kind(other),
            (Is::Words(one), Is::Words(other)) => one == other,
            _ => false,
        }
    }
}

impl Kind {
    /// The kind of a file with this content.
    pub fn of(content: &[u8]) -> Self {
        let signed = |format: &str, is_own: bool| {
            Self::words(if is_own {
                format!("a {format} written by deltille")
            } else {
                format!("a {format}")
            })
        };
        if content.starts_with(b"%PDF-") {
            signed("PDF", contains(content, PDF_CREATOR))
        } else if content.starts_with(PNG_SIGNATURE) {
            let Png { software, is_to_scale } = Png::of(content);
            let is_own = software.is_some_and(|by| by.starts_with(b"deltille "));
            signed(if is_to_scale && is_own { "PNG to scale" } else { "PNG" }, is_own)
        } else if content.starts_with(JPEG_START) {
            signed("JPEG", comment(content).is_some_and(|by| by.starts_with(b"deltille ")))
        } else if content.starts_with(crate::export::detections::npy::MAGIC) {
            Self::words("an array of NumPy")
        } else if content.starts_with(PARQUET) {
            // The file ends with its metadata, which end with the name of the writer.
            let end = &content[content.len().saturating_sub(HEAD)..];
            signed("Parquet", contains(end, b"deltille "))
        } else if content.starts_with(b"glTF") {
            signed("glTF", contains(glb_json(content), b"\"generator\":\"deltille "))
        } else if content.starts_with(b"PK\x03\x04") {
            // The first part of a 3MF of this program is not compressed.
            let head = &content[..content.len().min(HEAD)];
            match contains(head, b"3dmanufacturing") || contains(content, b"3D/3dmodel.model") {
                true => signed("3MF", contains(head, b"<!-- deltille ")),
                false if contains(head, b"names.npy") => Self::words("named arrays of NumPy"),
                false => Self::words("a ZIP"),
            }
        } else if content.starts_with(b"deltille ") && content.get(80..84).is_some() {
            signed("STL", true)
        } else {
            Self::of_json(content).unwrap_or_else(|| Self::of_text(content))
        }
    }

    /// The kind of a JSON file with this schema, in any version.
    pub fn of_schema(schema: &str) -> Self {
        Self(Is::Schema(schema.to_owned()))
    }

    fn words(words: impl Into<String>) -> Self {
        Self(Is::Words(words.into()))
    }

    /// The kind of a file that is too large to be read completely, if its first and last bytes identify it.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read.
    pub fn of_large(path: &Path) -> io::Result<Option<Self>> {
        let mut file = File::open(path)?;
        let mut content = vec![0; PARQUET.len()];
        file.read_exact(&mut content)?;
        if content != PARQUET {
            return Ok(None);
        }
        file.seek(SeekFrom::End(-(HEAD as i64)))?;
        file.read_to_end(&mut content)?;
        Ok(Some(Self::of(&content)))
    }

    /// The kind of the Parquet files that this program writes.
    pub fn own_parquet() -> Self {
        Self::words("a Parquet written by deltille")
    }

    /// The kind of the PDF files that this program writes.
    pub fn own_pdf() -> Self {
        Self::of(&[b"%PDF-", PDF_CREATOR].concat())
    }

    /// The kind of the HTML pages that this program writes.
    pub fn own_page() -> Self {
        Self::of(b"<!DOCTYPE html>\n<!-- deltille 0 -->")
    }

    /// The kind of the PNG files that this program writes for viewing: overlays, renderings, plots.
    pub fn own_png() -> Self {
        Self::words("a PNG written by deltille")
    }

    /// The kind of the JPEG files that this program writes: overlays.
    pub fn own_jpeg() -> Self {
        Self::words("a JPEG written by deltille")
    }

    /// The kind of the PNG files that this program writes for printing.
    pub fn own_printed_png() -> Self {
        Self::words("a PNG to scale written by deltille")
    }

    /// Whether the file is known to be written by this program.
    pub fn is_own(&self) -> bool {
        let (Is::Schema(words) | Is::Words(words)) = &self.0;
        words.contains("deltille") || words.contains("DelTag") || words == DSC
    }

    /// Uses only the first value, because a file of JSON lines has more.
    fn of_json(content: &[u8]) -> Option<Self> {
        #[derive(Deserialize)]
        struct Head {
            schema: Option<String>,
        }
        let first = || serde_json::Deserializer::from_slice(content);
        if let Some(schema) = first().into_iter::<Head>().next()?.ok()?.schema {
            return Some(Self::of_schema(&schema));
        }
        let object = first().into_iter::<BTreeMap<String, IgnoredAny>>().next()?.ok()?;
        let keys: Vec<&str> = object.keys().map(String::as_str).collect();
        Some(Self::words(match keys.as_slice() {
            [] => "an empty JSON object".to_owned(),
            keys => format!("a JSON of {}", keys.join(", ")),
        }))
    }

    /// The kind of a text, from its first line without values and the line that names its writer.
    fn of_text(content: &[u8]) -> Self {
        let head = &content[..content.len().min(HEAD)];
        // The first bytes may end inside a character.
        let whole = match std::str::from_utf8(head) {
            Err(error) if error.error_len().is_none() => &head[..error.valid_up_to()],
            _ => head,
        };
        let Some(text) = std::str::from_utf8(whole).ok().filter(|text| !text.contains('\0')) else {
            return Self::words("a binary file");
        };
        let first = text.lines().next().unwrap_or_default();
        if first.starts_with("0x") {
            return Self::words("a list of codes");
        }
        if std::str::from_utf8(content).is_ok_and(|text| dsc::read(text, "board").is_ok()) {
            return Self::words(DSC);
        }
        let marked = text.lines().take(HEAD_LINES).find_map(marked);
        let words = plain(first);
        Self::words(match marked.filter(|marked| *marked != words) {
            Some(marked) => format!("text that begins with `{words}`, by {marked}"),
            None => format!("text that begins with `{words}`"),
        })
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (Is::Schema(words) | Is::Words(words)) = &self.0;
        f.write_str(&cut(words))
    }
}

/// The part of a line that names the writer.
fn marked(line: &str) -> Option<String> {
    // The name and numbers of a family follow.
    let family = line.find("DelTag family").map(|at| line[..at].to_owned() + "DelTag family");
    family.or_else(|| line.contains("deltille ").then(|| plain(line)))
}

/// A line up to its first value, without numbers.
fn plain(line: &str) -> String {
    let key = line.split([':', '=']).next().unwrap_or_default();
    let words = key.chars().filter(|c| !c.is_ascii_digit() && *c != '.');
    words.collect::<String>().trim().to_owned()
}

/// First bytes of a JPEG, and the marker of a comment.
const JPEG_START: &[u8] = b"\xff\xd8\xff";
const COMMENT: [u8; 2] = *b"\xff\xfe";
/// The first bytes of every PNG.
const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// The keyword under which a PNG names its writer.
pub const SOFTWARE: &str = "Software";

/// Metadata from the chunks before the pixels of a PNG.
#[derive(Default)]
struct Png<'a> {
    /// The program that wrote it.
    software: Option<&'a [u8]>,
    /// Whether a resolution is stated.
    is_to_scale: bool,
}

impl<'a> Png<'a> {
    fn of(content: &'a [u8]) -> Self {
        let (mut png, mut rest) = (Self::default(), &content[PNG_SIGNATURE.len()..]);
        while let Some((name, data, after)) = next_chunk(rest).filter(|(name, ..)| name != b"IDAT")
        {
            let words = data.strip_prefix(SOFTWARE.as_bytes());
            let software = words.and_then(|words| words.strip_prefix(b"\0"));
            png.software = png.software.or(software.filter(|_| name == b"tEXt"));
            png.is_to_scale |= name == b"pHYs";
            rest = after;
        }
        png
    }
}

/// The name and the data of the first chunk of a PNG, and the bytes after it.
fn next_chunk(bytes: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let (length, after) = bytes.split_first_chunk::<4>()?;
    let (name, after) = after.split_at_checked(4)?;
    let (data, after) = after.split_at_checked(u32::from_be_bytes(*length) as usize)?;
    Some((name, data, after.get(4..)?))
}

/// Adds the name of this program to a PNG, after its header chunk.
pub fn signed_png(mut png: Vec<u8>) -> Vec<u8> {
    const HEAD_END: usize = 33;
    let mut chunk = b"tEXt".to_vec();
    chunk.extend(SOFTWARE.bytes());
    chunk.push(0);
    chunk.extend(crate::export::GENERATOR.bytes());
    let mut sum = flate2::Crc::new();
    sum.update(&chunk);
    let length = (chunk.len() as u32 - 4).to_be_bytes();
    let chunk = [&length[..], &chunk, &sum.sum().to_be_bytes()].concat();
    if png.len() >= HEAD_END {
        png.splice(HEAD_END..HEAD_END, chunk);
    }
    png
}

/// Adds the name of this program to a JPEG, as its first comment.
pub(crate) fn signed_jpeg(mut jpeg: Vec<u8>) -> Vec<u8> {
    let text = crate::export::GENERATOR.as_bytes();
    let length = (text.len() as u16 + 2).to_be_bytes();
    let comment = [&COMMENT[..], &length, text].concat();
    let after_start = 2.min(jpeg.len());
    jpeg.splice(after_start..after_start, comment);
    jpeg
}

/// The comment after the start of a JPEG, and the bytes after it.
fn comment(jpeg: &[u8]) -> Option<&[u8]> {
    jpeg.get(2..)?.strip_prefix(&COMMENT)?.get(2..)
}

/// The JSON chunk of a binary glTF, after 20 bytes of headers.
fn glb_json(content: &[u8]) -> &[u8] {
    let length = content.get(12..16).and_then(|bytes| bytes.first_chunk::<4>());
    let length = length.map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize);
    let json = content.get(20..).unwrap_or_default();
    &json[..length.min(json.len())]
}

/// Whether `content` contains `wanted`.
fn contains(content: &[u8], wanted: &[u8]) -> bool {
    content.windows(wanted.len()).any(|window| window == wanted)
}
