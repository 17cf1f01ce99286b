//! Checks of page headers before anything is unpacked, because a reader allocates the stated sizes.
//!
//! A page begins with a struct in Thrift's compact protocol: its kind, its unpacked and packed sizes, and, depending on the
//! kind, the number of values and their encoding.

/// Maximum nesting depth of structs in a header; valid headers have three levels.
const MAX_DEPTH: u32 = 8;

/// Supported encodings: their decoders allocate no more than the size of the page. Encodings that begin with a count of
/// differences may allocate more.
const PLAIN: i64 = 0;
const PLAIN_DICTIONARY: i64 = 2;
const RLE: i64 = 3;
const RLE_DICTIONARY: i64 = 8;
const BYTE_STREAM_SPLIT: i64 = 9;

/// The header of a page.
#[derive(Default)]
struct Header {
    unpacked: i64,
    packed: i64,
    values: i64,
    encoding: i64,
    is_dictionary: bool,
}

/// Returns the unpacked size of all pages of a column chunk, bytes; an error describes the problem of a page. No dictionary may
/// have more than `most_entries`.
pub(super) fn unpacked_bytes(mut chunk: &[u8], most_entries: u64) -> Result<u64, String> {
    let mut all = 0;
    while !chunk.is_empty() {
        let header = header(&mut chunk).ok_or("the header of a page is damaged")?;
        let size =
            |bytes: i64| u64::try_from(bytes).map_err(|_| "a page of negative size".to_owned());
        let (unpacked, packed) = (size(header.unpacked)?, size(header.packed)?);
        if !matches!(
            header.encoding,
            PLAIN | PLAIN_DICTIONARY | RLE | RLE_DICTIONARY | BYTE_STREAM_SPLIT
        ) {
            return Err(
                "values are delta-encoded; write them plain or with a dictionary".to_owned()
            );
        }
        // Every value of a dictionary takes at least one byte.
        if header.is_dictionary && size(header.values)? > unpacked.min(most_entries) {
            return Err("a dictionary contains fewer values than it states".to_owned());
        }
        all += unpacked;
        let rest = usize::try_from(packed).ok().and_then(|packed| chunk.get(packed..));
        chunk = rest.ok_or("a page is truncated")?;
    }
    Ok(all)
}

fn header(bytes: &mut &[u8]) -> Option<Header> {
    let mut header = Header::default();
    let mut field = 0;
    loop {
        let Some(kind) = next_field(bytes, &mut field)? else { return Some(header) };
        match (field, kind) {
            (2, I32) => header.unpacked = number(bytes)?,
            (3, I32) => header.packed = number(bytes)?,
            // Data pages, dictionary pages, and data pages of version 2.
            (5 | 7 | 8, STRUCT) => {
                header.is_dictionary = field == 7;
                let encoding_at = if field == 8 { 4 } else { 2 };
                let mut inner = 0;
                while let Some(kind) = next_field(bytes, &mut inner)? {
                    match (inner, kind) {
                        (1, I32) => header.values = number(bytes)?,
                        (_, I32) if inner == encoding_at => header.encoding = number(bytes)?,
                        _ => skip(bytes, kind, 1)?,
                    }
                }
            }
            _ => skip(bytes, kind, 0)?,
        }
    }
}

const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const I16: u8 = 4;
const I32: u8 = 5;
const I64: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const STRUCT: u8 = 12;

/// Reads the kind of the next field of a struct and updates its number; `Some(None)` at the end.
fn next_field(bytes: &mut &[u8], field: &mut i64) -> Option<Option<u8>> {
    let head = byte(bytes)?;
    if head == 0 {
        return Some(None);
    }
    *field = match head >> 4 {
        0 => number(bytes)?,
        step => field.checked_add(i64::from(step))?,
    };
    Some(Some(head & 15))
}

fn skip(bytes: &mut &[u8], kind: u8, depth: u32) -> Option<()> {
    if depth > MAX_DEPTH {
        return None;
    }
    match kind {
        TRUE | FALSE => {}
        BYTE => drop(byte(bytes)?),
        I16 | I32 | I64 => drop(varint(bytes)?),
        DOUBLE => *bytes = bytes.get(8..)?,
        BINARY => {
            let length = usize::try_from(varint(bytes)?).ok()?;
            *bytes = bytes.get(length..)?;
        }
        LIST | SET => {
            let head = byte(bytes)?;
            let count = if head >> 4 == 15 { varint(bytes)? } else { u64::from(head >> 4) };
            for _ in 0..count {
                // Flags in a list take one byte each.
                let kind = if head & 15 <= FALSE { BYTE } else { head & 15 };
                skip(bytes, kind, depth + 1)?;
            }
        }
        STRUCT => {
            let mut field = 0;
            while let Some(kind) = next_field(bytes, &mut field)? {
                skip(bytes, kind, depth + 1)?;
            }
        }
        _ => return None,
    }
    Some(())
}

fn byte(bytes: &mut &[u8]) -> Option<u8> {
    let (&first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(first)
}

fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let part = byte(bytes)?;
        value |= u64::from(part & 0x7f) << shift;
        if part & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

/// An integer with its sign in the last bit (zigzag).
fn number(bytes: &mut &[u8]) -> Option<i64> {
    let value = varint(bytes)?;
    Some((value >> 1) as i64 ^ -((value & 1) as i64))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A data page whose header states these sizes.
    fn page(unpacked: u32, packed: u32, field: u8, values: u32, encoding: u8) -> Vec<u8> {
        let varint = |value: u32| {
            let mut value = u64::from(value) << 1;
            let mut bytes = Vec::new();
            while value > 0x7f {
                bytes.push(value as u8 | 0x80);
                value >>= 7;
            }
            bytes.push(value as u8);
            bytes
        };
        let mut bytes = vec![0x15, 0];
        for size in [unpacked, packed] {
            bytes.push(0x15);
            bytes.extend(varint(size));
        }
        bytes.push((field - 3) << 4 | STRUCT);
        bytes.push(0x15);
        bytes.extend(varint(values));
        bytes.extend([0x15, encoding << 1, 0, 0]);
        bytes.extend(vec![0; packed as usize]);
        bytes
    }

    #[test]
    fn sizes_are_checked_before_unpacking() {
        let two = [page(100, 7, 5, 9, 0), page(2_000_000_000, 20, 5, 9, 0)].concat();
        assert_eq!(unpacked_bytes(&two, 10), Ok(2_000_000_100));
        assert!(unpacked_bytes(&two[..40], 10).unwrap_err().contains("truncated"));
        assert!(unpacked_bytes(&page(100, 7, 7, 101, 0), 1000).unwrap_err().contains("dictionary"));
        assert!(unpacked_bytes(&page(100, 7, 7, 11, 0), 10).unwrap_err().contains("dictionary"));
        assert!(unpacked_bytes(&page(100, 7, 5, 9, 5), 10).unwrap_err().contains("delta-encoded"));
        assert!(unpacked_bytes(&[0xff; 40], 10).unwrap_err().contains("header"));
        assert!(unpacked_bytes(&[0x1c; 40], 10).unwrap_err().contains("header"));
    }
}
