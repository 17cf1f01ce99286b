//! Damaged STL.

use super::{Case, Damage, cases};

/// Edits bytes in place.
fn bytes(edit: impl Fn(&mut Vec<u8>) + 'static) -> Damage {
    Box::new(move |good| {
        let mut bad = good.to_vec();
        edit(&mut bad);
        bad
    })
}

/// Returns the start of triangle `index`: a normal and three vertices of three floats, two bytes.
fn triangle(index: usize) -> usize {
    84 + 50 * index
}

/// Maps all coordinates of vertices.
fn vertices(edit: impl Fn(usize, f32) -> f32 + 'static) -> Damage {
    bytes(move |bytes| {
        for index in 0..(bytes.len() - 84) / 50 {
            for number in 3..12 {
                let at = triangle(index) + 4 * number;
                let value = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                bytes[at..at + 4].copy_from_slice(&edit(number % 3, value).to_le_bytes());
            }
        }
    })
}

/// Returns the cases for a solid.
pub fn all() -> Vec<Case> {
    cases(
        "t.stl",
        vec![
            ("the word that begins a text STL", bytes(|b| b[..5].copy_from_slice(b"solid"))),
            ("a colour", bytes(|b| b[40..50].copy_from_slice(b"COLOR=\xff\0\0\xff"))),
            ("a coloured triangle", bytes(|b| b[triangle(2) + 49] = 0x80)),
            (
                "a missing triangle",
                bytes(|b| {
                    b.truncate(triangle(3));
                    b[80] = 3;
                }),
            ),
            ("a truncated file", bytes(|b| b.truncate(triangle(3)))),
            ("data after the end", bytes(|b| b.extend(b"more"))),
            ("a normal to the other side", bytes(|b| b[triangle(0) + 3] ^= 0x80)),
            (
                "a NaN normal",
                bytes(|b| b[triangle(0)..triangle(0) + 4].copy_from_slice(&f32::NAN.to_le_bytes())),
            ),
            ("the head of a different target", bytes(|b| b[9] = b'u')),
            ("more triangles stated", bytes(|b| b[80] = 5)),
            (
                "a duplicate triangle",
                bytes(|b| {
                    let first = b[triangle(0)..triangle(1)].to_vec();
                    b.extend(first);
                    b[80] += 1;
                }),
            ),
            ("a displaced vertex", bytes(|b| b[triangle(0) + 14] ^= 0x10)),
            ("a NaN coordinate", vertices(|_, _| f32::NAN)),
            ("inches for millimetres", vertices(|_, v| v / 25.4)),
            ("a mirrored shape", vertices(|axis, v| if axis == 0 { -v } else { v })),
            ("a stretched body", vertices(|axis, v| if axis == 2 { 1.01 * v } else { v })),
        ],
    )
}
