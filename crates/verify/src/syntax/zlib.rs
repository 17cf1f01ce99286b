//! Decompression with verified checksum and length.

use flate2::{Decompress, FlushDecompress, Status};

/// Decompresses zlib data block by block and returns the decompressed length. Returns `None` unless the stream ends
/// with the last byte, its checksum is right, and the output is at most `most` bytes long.
pub(super) fn unpack(packed: &[u8], most: u64, each: impl FnMut(&[u8])) -> Option<u64> {
    unpack_by(Decompress::new(true), packed, most, each)
}

/// Does the same with a stream that expects a zlib header and checksum, or neither.
pub(super) fn unpack_by(
    mut stream: Decompress,
    packed: &[u8],
    most: u64,
    mut each: impl FnMut(&[u8]),
) -> Option<u64> {
    let mut block = vec![0; 1 << 16];
    loop {
        let (read, before) = (stream.total_in(), stream.total_out());
        let rest = packed.get(usize::try_from(read).ok()?..)?;
        let status = stream.decompress(rest, &mut block, FlushDecompress::None).ok()?;
        let length = stream.total_out() - before;
        each(block.get(..usize::try_from(length).ok()?)?);
        if stream.total_out() > most {
            return None;
        }
        match status {
            Status::StreamEnd if stream.total_in() == packed.len() as u64 => {
                return Some(stream.total_out());
            }
            Status::StreamEnd => return None,
            // No progress: the end is missing.
            _ if length == 0 && stream.total_in() == read => return None,
            _ => {}
        }
    }
}
