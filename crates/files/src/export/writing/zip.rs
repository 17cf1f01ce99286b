//! ZIP files in memory, for 3MF and for arrays of NumPy.

use std::io::Write as _;

use flate2::write::DeflateEncoder;
use flate2::{Compression, Crc};

/// Version of the format that a reader needs: 2.0, for folders and compression.
const ZIP_VERSION: u16 = 20;

/// A ZIP file of parts with their names, contents and compression flags. It has no date.
pub(in crate::export) fn zip(parts: &[(&str, &[u8], bool)]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut directory = Vec::new();
    for &(name, content, is_packed) in parts {
        let packed = if is_packed { deflated(content) } else { content.to_vec() };
        let mut sum = Crc::new();
        sum.update(content);
        let start = length(&file);
        // Version, flags, method, and the earliest time and date.
        let head = [ZIP_VERSION, 0, if is_packed { 8 } else { 0 }, 0, 0x21];
        let head = head.into_iter().flat_map(u16::to_le_bytes);
        let sizes = [sum.sum(), length(&packed), length(content)];
        let sizes = sizes.into_iter().flat_map(u32::to_le_bytes);
        let name_length = [name.len() as u16, 0].into_iter().flat_map(u16::to_le_bytes);
        let common: Vec<u8> = head.chain(sizes).chain(name_length).collect();
        file.extend(b"PK\x03\x04");
        file.extend(&common);
        file.extend(name.bytes());
        file.extend(&packed);
        directory.extend(b"PK\x01\x02");
        directory.extend(ZIP_VERSION.to_le_bytes());
        directory.extend(&common);
        // No comment, first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(start.to_le_bytes());
        directory.extend(name.bytes());
    }
    let start = length(&file);
    let size = length(&directory);
    let count = (parts.len() as u16).to_le_bytes();
    file.extend(directory);
    file.extend(b"PK\x05\x06\0\0\0\0");
    file.extend([count, count].concat());
    file.extend(size.to_le_bytes());
    file.extend(start.to_le_bytes());
    file.extend([0; 2]);
    file
}

fn length(bytes: &[u8]) -> u32 {
    u32::try_from(bytes.len()).expect("the content is far smaller than four gigabytes")
}

fn deflated(content: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(content).and_then(|()| encoder.finish());
    written.expect("writing to memory does not fail")
}
