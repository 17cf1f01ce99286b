//! A separate reader for binary STL: a header of 80 bytes, the number of triangles, and 50 bytes for each: normal,
//! three vertices, and two attribute bytes.

use std::path::Path;

use glam::{DVec3, Vec3};

use crate::reading::error::DocumentError;
use crate::reading::reader::Reader;

/// Number of bytes before the triangles, and of one triangle.
const HEAD: usize = 84;
const TRIANGLE: usize = 50;

/// A triangle of an STL.
pub(crate) struct Facet {
    /// The stated normal.
    pub normal: DVec3,
    /// Positions of its vertices, mm; counter-clockwise from outside.
    pub vertices_mm: [DVec3; 3],
}

/// Loads the triangles of a binary STL.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is too short, has no triangles, or its length does not match the
/// number of triangles that it states. The last condition also rejects text STL.
pub(crate) fn load_stl(reader: &Reader, path: &Path) -> Result<Vec<Facet>, DocumentError> {
    let unreadable = |problem: &str| DocumentError::unreadable(path, problem);
    let bytes = reader.read(path)?;
    let (Some(head), Some(body)) = (bytes.get(..HEAD), bytes.get(HEAD..)) else {
        return Err(unreadable("too short for a binary STL"));
    };
    let count = u32::from_le_bytes([head[80], head[81], head[82], head[83]]) as usize;
    if count == 0 || Some(body.len()) != count.checked_mul(TRIANGLE) {
        return Err(unreadable(
            "not a binary STL: its length does not match its number of triangles",
        ));
    }
    let facets = body.chunks_exact(TRIANGLE).map(|record| {
        let vectors: Vec<DVec3> = record.as_chunks::<12>().0[..4].iter().map(vector).collect();
        Facet { normal: vectors[0], vertices_mm: [vectors[1], vectors[2], vectors[3]] }
    });
    Ok(facets.collect())
}

/// Returns three little-endian numbers in single precision.
fn vector(bytes: &[u8; 12]) -> DVec3 {
    let number =
        |i: usize| f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
    Vec3::new(number(0), number(4), number(8)).as_dvec3()
}
