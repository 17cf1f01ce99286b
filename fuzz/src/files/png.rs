//! Mutations of a PNG: its chunks, its pixels.

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;

use super::dice::{Dice, noise};

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Maximum number of pixel bytes that are decompressed for mutation.
const MAX_BYTES: u64 = 4 << 20;

/// Mutates one thing; `None` if the bytes are not a PNG.
pub fn change(bytes: &[u8], dice: &mut Dice) -> Option<Vec<u8>> {
    let mut chunks = chunks(bytes.strip_prefix(SIGNATURE)?)?;
    if chunks.is_empty() {
        return None;
    }
    let (at, other) = (dice.below(chunks.len()), dice.below(chunks.len()));
    match dice.below(8) {
        0 => drop(chunks.remove(at)),
        1 => chunks.insert(at, chunks[other].clone()),
        2 => chunks.swap(at, other),
        3 => chunks[at].0 = chunks[other].0,
        4 => {
            chunks[at].0 =
                *dice.one_of(&[b"tEXt", b"gAMA", b"iCCP", b"tRNS", b"eXIf", b"acTL", b"PLTE"])
        }
        5 if &chunks[at].0 == b"IDAT" => {
            let mut pixels = Vec::new();
            let packed = ZlibDecoder::new(&chunks[at].1[..]);
            packed.take(MAX_BYTES).read_to_end(&mut pixels).ok()?;
            let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
            packed.write_all(&noise(&pixels, dice)).ok()?;
            chunks[at].1 = packed.finish().ok()?;
        }
        _ => chunks[at].1 = noise(&chunks[at].1, dice),
    }
    Some(joined(&chunks))
}

type Chunk = ([u8; 4], Vec<u8>);

fn chunks(mut rest: &[u8]) -> Option<Vec<Chunk>> {
    let mut chunks = Vec::new();
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let (kind, after) = after.split_first_chunk::<4>()?;
        chunks.push((*kind, after.get(..length)?.to_vec()));
        rest = after.get(length + 4..)?;
    }
    Some(chunks)
}

fn joined(chunks: &[Chunk]) -> Vec<u8> {
    let mut bytes = SIGNATURE.to_vec();
    for (kind, data) in chunks {
        let mut sum = flate2::Crc::new();
        sum.update(kind);
        sum.update(data);
        bytes.extend((data.len() as u32).to_be_bytes());
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend(sum.sum().to_be_bytes());
    }
    bytes
}
