//! The bytes of a recording, with compressed chunks in place.

use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use deltille_core::words::quoted;
use deltille_files::limits::{Kind, Limits};

use crate::problem::Problem;

/// The bytes of a file, or of a chunk of it until its end. Nothing larger than the limits is read into memory.
pub(crate) struct Source {
    file: BufReader<File>,
    /// Bytes of the file.
    length: u64,
    /// Bytes of the file that were not read yet.
    left: u64,
    chunk: Cursor<Vec<u8>>,
    /// Whether the file ended within the chunk.
    is_cut: bool,
    limits: Limits,
}

impl Source {
    pub(crate) fn open(path: &Path, limits: &Limits) -> Result<Self, Problem> {
        let file = File::open(path).map_err(Problem::Io)?;
        let length = file.metadata().map_err(Problem::Io)?.len();
        let file = BufReader::with_capacity(1 << 16, file);
        let chunk = Cursor::default();
        Ok(Self { file, length, left: length, chunk, is_cut: false, limits: *limits })
    }

    /// Returns the number of bytes of the file.
    #[cfg(feature = "mcap")]
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Returns the fraction of the file that was read, with the whole of the chunk.
    pub(crate) fn part(&self) -> f64 {
        1.0 - self.left as f64 / self.length.max(1) as f64
    }

    /// Moves to a position in the file; stays if it is behind the end.
    pub(crate) fn seek(&mut self, position: u64) -> Result<(), Problem> {
        self.left = self.length.checked_sub(position).ok_or_else(Problem::cut_off)?;
        self.file.seek(SeekFrom::Start(position))?;
        self.chunk = Cursor::default();
        Ok(())
    }

    /// Whether the file ends here, not within a chunk.
    pub(crate) fn is_at_end(&self) -> Result<bool, Problem> {
        match self.left_in_chunk() == 0 && self.left == 0 {
            true if self.is_cut => Err(Problem::cut_off()),
            is_end => Ok(is_end),
        }
    }

    /// Returns the next `N` bytes.
    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        let bytes = self.bytes(N as u64)?;
        Ok(*bytes.first_chunk().expect("N bytes"))
    }

    /// Returns the next bytes.
    pub(crate) fn bytes(&mut self, count: u64) -> Result<Vec<u8>, Problem> {
        self.take(count)?;
        if count > self.limits.picture_bytes() {
            return Err(self.limits.exceeded(Kind::Pixels).into());
        }
        let mut bytes = vec![0; count as usize];
        match self.left_in_chunk() {
            0 => {
                self.left -= count;
                self.file.read_exact(&mut bytes)?;
            }
            _ => self.chunk.read_exact(&mut bytes)?,
        }
        Ok(bytes)
    }

    /// Skips the next bytes.
    pub(crate) fn skip(&mut self, count: u64) -> Result<(), Problem> {
        self.take(count)?;
        match self.left_in_chunk() {
            0 => {
                self.left -= count;
                self.file.seek_relative(count.cast_signed())?;
            }
            _ => self.chunk.set_position(self.chunk.position() + count),
        }
        Ok(())
    }

    /// Continues with the content of the chunk of `length` bytes that begins here, and has `size` bytes when decompressed.
    /// If the file ends before the chunk, its first part is read.
    pub(crate) fn enter(
        &mut self,
        compression: &str,
        length: u64,
        size: u64,
    ) -> Result<(), Problem> {
        if self.left_in_chunk() > 0 {
            return Err(Problem::Damaged("a chunk within a chunk".to_owned()));
        }
        self.is_cut = length > self.left;
        let chunk = self.bytes(length.min(self.left))?;
        let is_plain = matches!(compression, "" | "none");
        self.chunk = Cursor::new(match (is_plain, self.is_cut) {
            (true, _) => chunk,
            (false, false) => decompressed(compression, &chunk, Some(size), &self.limits)?,
            (false, true) => decompressed_part(compression, &chunk, size, &self.limits)?.0,
        });
        Ok(())
    }

    /// Returns the content of the chunk, if the file contains all of it.
    #[cfg(feature = "mcap")]
    pub(crate) fn whole_chunk(&self) -> Option<&[u8]> {
        (!self.is_cut).then_some(self.chunk.get_ref())
    }

    fn left_in_chunk(&self) -> u64 {
        self.chunk.get_ref().len() as u64 - self.chunk.position()
    }

    /// Checks that as many bytes are left.
    fn take(&self, count: u64) -> Result<(), Problem> {
        let left = match self.left_in_chunk() {
            0 => self.left,
            left => left,
        };
        if count > left { Err(Problem::cut_off()) } else { Ok(()) }
    }
}

/// Returns decompressed bytes, which must be as many as stated.
pub(crate) fn decompressed(
    compression: &str,
    bytes: &[u8],
    size: Option<u64>,
    limits: &Limits,
) -> Result<Vec<u8>, Problem> {
    let most = size.unwrap_or(limits.picture_bytes());
    let (content, error) = decompressed_part(compression, bytes, most, limits)?;
    let found = content.len() as u64;
    let error = error.or_else(|| {
        let is_other = size.is_some_and(|size| found < size) || found > most;
        is_other.then(|| "its size is not the stated one".to_owned())
    });
    match error {
        None => Ok(content),
        Some(error) => Err(Problem::Damaged(format!(
            "a damaged chunk, compressed with {compression}: {error}"
        ))),
    }
}

/// Returns decompressed bytes, at most one more than `most`, up to an error.
fn decompressed_part(
    compression: &str,
    bytes: &[u8],
    most: u64,
    limits: &Limits,
) -> Result<(Vec<u8>, Option<String>), Problem> {
    if most > limits.picture_bytes() {
        return Err(limits.exceeded(Kind::Pixels).into());
    }
    let reader: Box<dyn Read + '_> = match compression {
        "lz4" => Box::new(lz4_flex::frame::FrameDecoder::new(bytes)),
        #[cfg(feature = "mcap")]
        "zstd" => match ruzstd::decoding::StreamingDecoder::new(bytes) {
            Ok(decoder) => Box::new(decoder),
            Err(error) => return Ok((Vec::new(), Some(error.to_string()))),
        },
        #[cfg(feature = "rosbag1")]
        "bz2" => Box::new(bzip2::read::MultiBzDecoder::new(bytes)),
        _ => return Err(Problem::Unsupported(format!("compression {}", quoted(compression)))),
    };
    let mut content = Vec::new();
    let read = reader.take(most.saturating_add(1)).read_to_end(&mut content);
    Ok((content, read.err().map(|error| error.to_string())))
}
