//! How much is read before a file is refused, so that no file, whoever made it, takes all memory or
//! never ends.
//!
//! ```
//! use deltille_files::limits::Limits;
//!
//! let mut small = Limits::default();
//! small.max_bytes = 10;
//! let error = small.read("Cargo.toml".as_ref()).unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "Cargo.toml: more than 10 bytes; `Limits::max_bytes` sets how many are read"
//! );
//! ```
//!
//! The defaults take whatever this crate writes and any camera takes up to 150 megapixels, and end
//! within a gigabyte of memory.

mod guard;

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use guard::{Broken, Guard, bounded, caught};

/// Most bytes of a file of settings: a camera, a template, rules. A hundredth of it is more than
/// most have, and readers of YAML take time with the square of it.
pub const MAX_SETTINGS_BYTES: usize = 50_000;

/// Most bytes of a family file or of a checkpoint of its search: twice what the three million codes
/// of the largest family take.
pub const MAX_FAMILY_BYTES: usize = 150_000_000;

/// Pixels of a picture that may be in a file of any size.
const FREE_PIXELS: u64 = 10_000_000;

/// Bytes that a pixel may take while a picture is decoded: 8 bits of four colours.
const BYTES_PER_PIXEL: u64 = 4;

/// What a reader takes before it gives up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Limits {
    /// Bytes of a file, and of what is unpacked from it; pictures go by their pixels.
    pub max_bytes: u64,
    /// Pixels of a picture: of a photograph, of a page or texture as PNG, and of all photographs
    /// that are in memory at a time.
    pub max_pixels: u64,
    /// Pixels of a photograph of more than 10 megapixels for each byte of its file. The noise of sensors takes bytes: a
    /// compressed photograph has some 5, and what has so many more was made to keep its reader busy.
    pub max_pixels_per_byte: u64,
    /// Parts of a file: elements of an SVG, operators of a PDF page, nodes and triangles of a mesh.
    pub max_nodes: u64,
    /// How deep parts lie within each other.
    pub max_depth: usize,
    /// Seconds for each step that other crates do: reading a file, drawing a page.
    pub max_seconds: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_bytes: 200_000_000,
            max_pixels: 150_000_000,
            max_pixels_per_byte: 100,
            max_nodes: 4_000_000,
            max_depth: 64,
            max_seconds: 60.0,
        }
    }
}

/// One of the [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// [`Limits::max_bytes`]
    Bytes,
    /// [`Limits::max_pixels`]
    Pixels,
    /// [`Limits::max_pixels_per_byte`]
    PixelsPerByte,
    /// [`Limits::max_nodes`]
    Nodes,
    /// [`Limits::max_depth`]
    Depth,
    /// [`Limits::max_seconds`]
    Seconds,
}

/// A limit that a file passes.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub struct Exceeded {
    /// Which limit.
    pub kind: Kind,
    /// The value of the limit, in its unit: bytes, pixels, parts, levels or seconds.
    pub limit: f64,
}

impl fmt::Display for Exceeded {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let limit = self.limit;
        match self.kind {
            Kind::Bytes => {
                write!(f, "more than {limit} bytes; `Limits::max_bytes` sets how many are read")
            }
            Kind::Pixels => {
                let mega = limit / 1e6;
                write!(
                    f,
                    "more than {mega} megapixels; `Limits::max_pixels` sets how many are read"
                )
            }
            Kind::PixelsPerByte => {
                write!(f, "more than {limit} pixels for each byte, as no photograph has; ")?;
                write!(f, "`Limits::max_pixels_per_byte` sets how many are read")
            }
            Kind::Nodes => {
                write!(f, "more than {limit} parts; `Limits::max_nodes` sets how many are read")
            }
            Kind::Depth => {
                write!(
                    f,
                    "parts more than {limit} deep; `Limits::max_depth` sets how deep they may be"
                )
            }
            Kind::Seconds => {
                write!(
                    f,
                    "not done after {limit} s; `Limits::max_seconds` sets how long it may take"
                )
            }
        }
    }
}

/// A file that is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A folder, a device or a pipe, which may never end.
    #[error("{}: {what}, where a file is needed", path.display())]
    NotFile {
        /// Where it is.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// The file has more bytes than are read.
    #[error("{}: {exceeded}", path.display())]
    Exceeded {
        /// The file.
        path: PathBuf,
        /// The limit.
        exceeded: Exceeded,
    },
    /// The file has more bytes than any of its kind.
    #[error("{}: more than {most} bytes, which no such file has", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// How many a file of this kind may have.
        most: usize,
    },
    /// The file is no text.
    #[error("{}: not a text file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
    },
}

impl Limits {
    /// No limits, for files whose maker is trusted.
    pub const NONE: Self = Self {
        max_bytes: u64::MAX,
        max_pixels: u64::MAX,
        max_pixels_per_byte: u64::MAX,
        max_nodes: u64::MAX,
        max_depth: usize::MAX,
        max_seconds: f64::INFINITY,
    };

    /// The bytes of a regular file.
    ///
    /// # Errors
    /// Where it cannot be read, is no regular file, or is larger than the limit.
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, ReadError> {
        let exceeded = self.exceeded(Kind::Bytes);
        read_up_to(path, self.max_bytes)?
            .ok_or_else(|| ReadError::Exceeded { path: path.to_owned(), exceeded })
    }

    /// The text of a regular file.
    ///
    /// # Errors
    /// Where it cannot be read, is no regular file, is larger than the limit, or is no text.
    pub fn read_text(&self, path: &Path) -> Result<String, ReadError> {
        text(path, self.read(path)?)
    }

    /// A limit that is passed.
    pub fn exceeded(&self, kind: Kind) -> Exceeded {
        let limit = match kind {
            Kind::Bytes => self.max_bytes as f64,
            Kind::Pixels => self.max_pixels as f64,
            Kind::PixelsPerByte => self.max_pixels_per_byte as f64,
            Kind::Nodes => self.max_nodes as f64,
            Kind::Depth => self.max_depth as f64,
            Kind::Seconds => self.max_seconds,
        };
        Exceeded { kind, limit }
    }

    /// Refuses a picture of too many pixels.
    ///
    /// # Errors
    /// The limit that it passes.
    pub fn check_pixels(&self, width: u32, height: u32) -> Result<(), Exceeded> {
        self.check(Kind::Pixels, u64::from(width) * u64::from(height), self.max_pixels)
    }

    /// Refuses a photograph of too many pixels, or of too many for a file of so many bytes.
    ///
    /// # Errors
    /// The limit that it passes.
    pub fn check_photograph(&self, width: u32, height: u32, bytes: u64) -> Result<(), Exceeded> {
        self.check_pixels(width, height)?;
        let pixels = u64::from(width) * u64::from(height);
        let most = bytes.saturating_mul(self.max_pixels_per_byte).max(FREE_PIXELS);
        self.check(Kind::PixelsPerByte, pixels, most)
    }

    /// Refuses so many parts.
    ///
    /// # Errors
    /// The limit that they pass.
    pub fn check_nodes(&self, nodes: usize) -> Result<(), Exceeded> {
        self.check(Kind::Nodes, nodes as u64, self.max_nodes)
    }

    /// Refuses parts that lie so deep.
    ///
    /// # Errors
    /// The limit that they pass.
    pub fn check_depth(&self, depth: usize) -> Result<(), Exceeded> {
        self.check(Kind::Depth, depth as u64, self.max_depth as u64)
    }

    /// Most bytes of a decoded picture, and of its file, which is never much larger.
    pub fn picture_bytes(&self) -> u64 {
        self.max_pixels.saturating_mul(BYTES_PER_PIXEL)
    }

    /// [`max_seconds`](Self::max_seconds); what no clock holds is for ever.
    pub fn time(&self) -> Duration {
        Duration::try_from_secs_f64(self.max_seconds).unwrap_or(Duration::MAX)
    }

    fn check(&self, kind: Kind, found: u64, most: u64) -> Result<(), Exceeded> {
        if found > most { Err(self.exceeded(kind)) } else { Ok(()) }
    }
}

/// The text of a regular file of a kind that has at most so many bytes.
///
/// # Errors
/// Where it cannot be read, is no regular file, is too long, or is no text.
pub fn read_short_text(path: &Path, most: usize) -> Result<String, ReadError> {
    let bytes = read_up_to(path, most as u64)?;
    text(path, bytes.ok_or_else(|| ReadError::TooLong { path: path.to_owned(), most })?)
}

/// Refuses what is no regular file. A pipe is not even opened, as that may wait for ever.
///
/// # Errors
/// Where it cannot be looked at, or is no regular file.
pub fn check_file(path: &Path) -> Result<(), ReadError> {
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    let metadata = path.metadata().map_err(io)?;
    if metadata.is_file() {
        return Ok(());
    }
    let what = if metadata.is_dir() { "a folder" } else { "a device or a pipe" };
    Err(ReadError::NotFile { path: path.to_owned(), what })
}

/// The bytes of a regular file, unless there are more than so many.
fn read_up_to(path: &Path, most: u64) -> Result<Option<Vec<u8>>, ReadError> {
    check_file(path)?;
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    let file = File::open(path).map_err(io)?;
    let length = file.metadata().map_err(io)?.len();
    if length > most {
        return Ok(None);
    }
    let mut bytes = Vec::with_capacity(length as usize);
    // The file may be growing.
    file.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(io)?;
    Ok((bytes.len() as u64 <= most).then_some(bytes))
}

fn text(path: &Path, bytes: Vec<u8>) -> Result<String, ReadError> {
    String::from_utf8(bytes).map_err(|_| ReadError::NotText { path: path.to_owned() })
}
