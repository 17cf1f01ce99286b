//! Numbers and texts in bytes.

use crate::problem::Problem;

/// A position in bytes.
pub(crate) struct Fields<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

impl<'a> Fields<'a> {
    /// Begins at the first byte; numbers are little-endian.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, is_big_endian: false }
    }

    /// Begins at the first byte; numbers are big-endian.
    pub(crate) fn big_endian(bytes: &'a [u8]) -> Self {
        Self { is_big_endian: true, ..Self::new(bytes) }
    }

    /// Returns the next bytes.
    pub(crate) fn bytes(&mut self, count: usize) -> Result<&'a [u8], Problem> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let bytes = rest.get(..count).ok_or_else(Problem::cut_off)?;
        self.at += count;
        Ok(bytes)
    }

    /// Whether no byte is left.
    #[cfg(feature = "rosbag1")]
    pub(crate) fn is_at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Returns the number of bytes so far.
    pub(crate) fn position(&self) -> usize {
        self.at
    }

    /// Skips bytes until the position is a multiple of `size`.
    pub(crate) fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size);
    }

    pub(crate) fn u8(&mut self) -> Result<u8, Problem> {
        Ok(self.bytes(1)?[0])
    }

    #[cfg(feature = "mcap")]
    pub(crate) fn u16(&mut self) -> Result<u16, Problem> {
        let bytes = self.array()?;
        Ok(if self.is_big_endian { u16::from_be_bytes(bytes) } else { u16::from_le_bytes(bytes) })
    }

    pub(crate) fn u32(&mut self) -> Result<u32, Problem> {
        let bytes = self.array()?;
        Ok(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    pub(crate) fn u64(&mut self) -> Result<u64, Problem> {
        let bytes = self.array()?;
        Ok(if self.is_big_endian { u64::from_be_bytes(bytes) } else { u64::from_le_bytes(bytes) })
    }

    /// Returns bytes after their number of 32 bits.
    pub(crate) fn counted(&mut self) -> Result<&'a [u8], Problem> {
        let count = self.u32()?;
        self.bytes(count as usize)
    }

    /// Returns a text after its number of bytes, without a final NUL.
    pub(crate) fn text(&mut self) -> Result<String, Problem> {
        let text = String::from_utf8_lossy(self.counted()?);
        Ok(text.trim_end_matches('\0').to_owned())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Problem> {
        Ok(*self.bytes(N)?.first_chunk().expect("N bytes"))
    }
}
