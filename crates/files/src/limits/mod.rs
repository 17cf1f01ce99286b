//! Limits on files that are read, so that no file, even a malicious one, exhausts memory or time. `guard` runs third-party
//! code with a time limit and turns its panics into errors.
//!
//! ```
//! use deltille_files::limits::Limits;
//!
//! let mut small = Limits::default();
//! small.max_bytes = 10;
//! let error = small.read("Cargo.toml".as_ref()).unwrap_err();
//! assert_eq!(
//!     error.to_string(),
//!     "Cargo.toml: more than 10 bytes; `Limits::max_bytes` sets this limit"
//! );
//! ```
//!
//! The defaults accept all files that this crate writes and photographs of up to 150 megapixels, within one gigabyte of memory.

mod guard;

use std::fmt;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

use deltille_core::setting::Setting::{
    LimitsMaxBytes, LimitsMaxDepth, LimitsMaxNodes, LimitsMaxPixels, LimitsMaxPixelsPerByte,
    LimitsMaxSeconds,
};

pub use guard::{Broken, Guard, bounded, caught};

/// Maximum size of a settings file (camera, template, rules), bytes. Most are a hundred times smaller, and YAML readers take
/// quadratic time.
pub const MAX_SETTINGS_BYTES: usize = 50_000;

/// Maximum size of a family file or of a checkpoint of its search, bytes: twice the size of the largest
/// family, which has three million codes.
pub const MAX_FAMILY_BYTES: usize = 150_000_000;

/// Number of pixels up to which an image is accepted regardless of its file size.
const FREE_PIXELS: u64 = 10_000_000;

/// Bytes of memory per pixel while an image is decoded: four channels of 8 bits.
const BYTES_PER_PIXEL: u64 = 4;

/// Limits within which a reader accepts a file.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Limits {
    /// Bytes of a file, and of its decompressed content. Images are limited by their pixels instead.
    pub max_bytes: u64,
    /// Pixels of an image (photograph, page or texture as PNG), and of all photographs, or all textures
    /// of a mesh, that are in memory at the same time.
    pub max_pixels: u64,
    /// Pixels per byte of the file of a photograph with more than 10 megapixels. Sensor noise does not compress: a
    /// compressed photograph has about 5 pixels per byte, and a file with far more was made to exhaust its reader.
    pub max_pixels_per_byte: u64,
    /// Number of parts of a file: elements of an SVG, operators of a PDF page, nodes and triangles of a mesh.
    pub max_nodes: u64,
    /// Nesting depth of parts.
    pub max_depth: usize,
    /// Seconds for each step of third-party code: reading a file, drawing a page.
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

/// A limit that a file exceeds.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub struct Exceeded {
    /// The limit that is exceeded.
    pub kind: Kind,
    /// The value of the limit, in its unit: bytes, pixels, parts, levels or seconds.
    pub limit: f64,
}

impl fmt::Display for Exceeded {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let limit = self.limit;
        match self.kind {
            Kind::Bytes => {
                write!(f, "more than {limit} bytes; {LimitsMaxBytes} sets this limit")
            }
            Kind::Pixels => {
                let mega = limit / 1e6;
                write!(f, "more than {mega} megapixels; {LimitsMaxPixels} sets this limit")
            }
            Kind::PixelsPerByte => {
                write!(f, "more than {limit} pixels per byte, which no photograph has; ")?;
                write!(f, "{LimitsMaxPixelsPerByte} sets this limit")
            }
            Kind::Nodes => {
                write!(f, "more than {limit} parts; {LimitsMaxNodes} sets this limit")
            }
            Kind::Depth => {
                write!(
                    f,
                    "parts nested more than {limit} levels deep; {LimitsMaxDepth} sets this limit"
                )
            }
            Kind::Seconds => {
                write!(f, "not finished after {limit} s; {LimitsMaxSeconds} sets this limit")
            }
        }
    }
}

/// Error of reading a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The path is empty.
    #[error("the file name is empty: specify a file, or omit the option")]
    Nameless,
    /// The file cannot be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The path is a folder, or a device or pipe, which may never end.
    #[error("{}: {what}, but a file is needed", path.display())]
    NotFile {
        /// The path.
        path: PathBuf,
        /// The kind of the object found there.
        what: &'static str,
    },
    /// The file has more bytes than the limits allow.
    #[error("{}: {exceeded}", path.display())]
    Exceeded {
        /// The file.
        path: PathBuf,
        /// The limit.
        exceeded: Exceeded,
    },
    /// The file has more bytes than a file of its kind may have.
    #[error("{}: more than {most} bytes, the maximum for this kind of file", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// The maximum size of a file of this kind, bytes.
        most: usize,
    },
    /// The file is not UTF-8 text.
    #[error("{}: not a text file", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
    },
}

impl Limits {
    /// No limits, for files from a trusted source.
    pub const NONE: Self = Self {
        max_bytes: u64::MAX,
        max_pixels: u64::MAX,
        max_pixels_per_byte: u64::MAX,
        max_nodes: u64::MAX,
        max_depth: usize::MAX,
        max_seconds: f64::INFINITY,
    };

    /// Reads the bytes of a regular file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not a regular file, or is larger than
    /// [`max_bytes`](Self::max_bytes).
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, ReadError> {
        let exceeded = self.exceeded(Kind::Bytes);
        read_up_to(path, self.max_bytes)?
            .ok_or_else(|| ReadError::Exceeded { path: path.to_owned(), exceeded })
    }

    /// Reads a regular file as UTF-8 text.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not a regular file, is larger than
    /// [`max_bytes`](Self::max_bytes), or is not UTF-8.
    pub fn read_text(&self, path: &Path) -> Result<String, ReadError> {
        text(path, self.read(path)?)
    }

    /// Returns the error for exceeding this limit.
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

    /// Refuses an image with more than [`max_pixels`](Self::max_pixels).
    ///
    /// # Errors
    /// Returns the limit that is exceeded.
    pub fn check_pixels(&self, width: u32, height: u32) -> Result<(), Exceeded> {
        self.check_all_pixels(u64::from(width) * u64::from(height))
    }

    /// Refuses images that together have more than [`max_pixels`](Self::max_pixels).
    ///
    /// # Errors
    /// Returns the limit that is exceeded.
    pub fn check_all_pixels(&self, pixels: u64) -> Result<(), Exceeded> {
        self.check(Kind::Pixels, pixels, self.max_pixels)
    }

    /// Refuses a photograph with too many pixels, or with too many for a file of `bytes` bytes.
    ///
    /// # Errors
    /// Returns the limit that is exceeded.
    pub fn check_photograph(&self, width: u32, height: u32, bytes: u64) -> Result<(), Exceeded> {
        self.check_pixels(width, height)?;
        let pixels = u64::from(width) * u64::from(height);
        let most = bytes.saturating_mul(self.max_pixels_per_byte).max(FREE_PIXELS);
        self.check(Kind::PixelsPerByte, pixels, most)
    }

    /// Refuses a file with more than [`max_nodes`](Self::max_nodes) parts.
    ///
    /// # Errors
    /// Returns the limit that is exceeded.
    pub fn check_nodes(&self, nodes: usize) -> Result<(), Exceeded> {
        self.check(Kind::Nodes, nodes as u64, self.max_nodes)
    }

    /// Refuses parts that are nested deeper than [`max_depth`](Self::max_depth).
    ///
    /// # Errors
    /// Returns the limit that is exceeded.
    pub fn check_depth(&self, depth: usize) -> Result<(), Exceeded> {
        self.check(Kind::Depth, depth as u64, self.max_depth as u64)
    }

    /// Maximum size of a decoded image, bytes, and of its file, which is hardly larger.
    pub fn picture_bytes(&self) -> u64 {
        self.max_pixels.saturating_mul(BYTES_PER_PIXEL)
    }

    /// [`max_seconds`](Self::max_seconds) as a duration; the maximum duration if the value is too large.
    pub fn time(&self) -> Duration {
        Duration::try_from_secs_f64(self.max_seconds).unwrap_or(Duration::MAX)
    }

    fn check(&self, kind: Kind, found: u64, most: u64) -> Result<(), Exceeded> {
        if found > most { Err(self.exceeded(kind)) } else { Ok(()) }
    }
}

/// Reads a regular file of at most `most` bytes as UTF-8 text.
///
/// # Errors
/// Returns an error if the file cannot be read, is not a regular file, is longer than `most`, or is not UTF-8.
pub fn read_short_text(path: &Path, most: usize) -> Result<String, ReadError> {
    let bytes = read_up_to(path, most as u64)?;
    text(path, bytes.ok_or_else(|| ReadError::TooLong { path: path.to_owned(), most })?)
}

/// Refuses a path that is not a regular file. Pipes are not opened, because that may block for ever.
///
/// # Errors
/// Returns an error if the metadata cannot be read, or if the path is not a regular file.
pub fn check_file(path: &Path) -> Result<(), ReadError> {
    if path.as_os_str().is_empty() {
        return Err(ReadError::Nameless);
    }
    let io = |source| ReadError::Io { path: path.to_owned(), source };
    let metadata = path.metadata().map_err(io)?;
    if metadata.is_file() {
        return Ok(());
    }
    let what = if metadata.is_dir() { "a folder" } else { "a device or a pipe" };
    Err(ReadError::NotFile { path: path.to_owned(), what })
}

/// Returns the bytes of a regular file; `None` if there are more than `most`.
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
