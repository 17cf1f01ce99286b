//! Binary STL in millimetres, of a solid without print or of its skeleton.

use glam::DVec3;

/// The content of an `.stl` file; `triangles_mm` in mm, counter-clockwise seen from outside.
pub fn to_bytes(name: &str, triangles_mm: &[[DVec3; 3]]) -> Vec<u8> {
    let mut bytes = header(name).to_vec();
    bytes.extend((triangles_mm.len() as u32).to_le_bytes());
    for &[a, b, c] in triangles_mm {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        for v in [normal, a, b, c] {
            bytes.extend(v.as_vec3().to_array().into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend([0, 0]);
    }
    bytes
}

/// The header before the triangles; readers ignore its text.
pub fn header(name: &str) -> [u8; 80] {
    let mut header = [b' '; 80];
    let words = format!("deltille {name}, millimetres");
    for (byte, word) in header.iter_mut().zip(words.bytes()) {
        *byte = word;
    }
    header
}

/// The file name of the skeleton of a target with this name.
pub fn skeleton_name(name: &str) -> String {
    format!("{name}-skeleton.stl")
}
