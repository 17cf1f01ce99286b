//! Closed meshes to put boards on, from files of other programs: OBJ, STL and PLY, recognised by their content.

use std::io::Cursor;

use glam::DVec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Ply, Property};

use super::obj::{self, ObjError};
use crate::limits;
use deltille_core::targets::{ClosedMesh, ClosedMeshError};

/// Error of using a file as a solid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// It is not a valid OBJ, or not closed.
    #[error(transparent)]
    Obj(#[from] ObjError),
    /// It begins like an STL or a PLY, but is not valid.
    #[error("not a readable {format}: {problem}")]
    Grammar {
        /// STL or PLY.
        format: &'static str,
        /// The problem.
        problem: String,
    },
    /// The reader panicked.
    #[error(transparent)]
    Broken(#[from] limits::Broken),
    /// The faces are not one closed surface.
    #[error(transparent)]
    Mesh(#[from] ClosedMeshError),
}

/// Size of a binary STL before its triangles, and of one triangle, bytes.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Vertices, and faces as indices of vertices.
type Faces = (Vec<DVec3>, Vec<Vec<usize>>);

/// Reads vertices and faces from a file, or returns the problem.
type Read = fn(&[u8]) -> Result<Faces, String>;

/// Reads a file as one solid, in the unit of the file. Coplanar triangles of an STL or a PLY become one face. The second
/// value is true if the surface was inside out.
///
/// # Errors
/// Returns an error if the file is not a valid OBJ, STL or PLY, or if it is not one closed surface of flat, convex faces.
pub fn read(bytes: &[u8]) -> Result<(ClosedMesh, bool), MeshFileError> {
    let (format, read): (_, Read) = if bytes.starts_with(b"ply") {
        ("PLY", ply)
    } else if bytes.contains(&0) || bytes.trim_ascii_start().starts_with(b"solid") {
        ("STL", stl)
    } else {
        return Ok(obj::read(bytes)?);
    };
    let read = limits::caught(|| read(bytes))?;
    let (vertices, faces) = read.map_err(|problem| MeshFileError::Grammar { format, problem })?;
    let (mesh, inside_out) = ClosedMesh::new(&vertices, &faces)?;
    Ok((mesh.with_whole_faces()?, inside_out))
}

/// Whether the length matches the stated number of triangles.
fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(STL_HEAD - 4..STL_HEAD).and_then(|count| count.try_into().ok());
    let length = count.map(|count| u32::from_le_bytes(count) as usize);
    let length = length.and_then(|count| count.checked_mul(STL_TRIANGLE)?.checked_add(STL_HEAD));
    length == Some(bytes.len())
}

fn stl(bytes: &[u8]) -> Result<Faces, String> {
    // Text contains no zero bytes.
    if bytes.contains(&0) && !is_binary_stl(bytes) {
        return Err("its length does not match the stated number of triangles".to_owned());
    }
    let mut bytes = bytes.to_vec();
    // The reader treats files that begin with `solid` as text, but many programs begin binary files with it, too.
    if is_binary_stl(&bytes) {
        bytes[..STL_HEAD - 4].fill(b' ');
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let vertices = mesh.vertices.iter().map(|v| DVec3::from(v.0.map(f64::from)));
    let faces = mesh.faces.iter().map(|face| face.vertices.to_vec());
    Ok((vertices.collect(), faces.collect()))
}

fn ply(bytes: &[u8]) -> Result<Faces, String> {
    // The reader allocates the sizes in the header; each element takes at least one byte.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(1 << 16)]);
    let lines = head.lines().take_while(|line| line.trim() != "end_header");
    let promised = lines.filter_map(|line| line.trim().strip_prefix("element "));
    let count = |line: &str| line.split_whitespace().nth(1)?.parse::<usize>().ok();
    if promised.map(count).any(|count| count.is_none_or(|count| count > bytes.len())) {
        return Err("it has fewer elements than its header states".to_owned());
    }
    let read: Result<Ply<DefaultElement>, _> =
        Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(bytes));
    let read = read.map_err(|error| error.to_string())?;
    let of = |name: &str| read.payload.get(name).map_or(&[][..], |elements| elements);
    let place = |element: &DefaultElement| {
        let along = |axis: &str| element.get(axis).and_then(number);
        Some(DVec3::new(along("x")?, along("y")?, along("z")?))
    };
    let vertices = of("vertex").iter().map(place).collect::<Option<Vec<_>>>();
    let vertices = vertices.ok_or("a vertex has no x, y or z")?;
    let corners = |element: &DefaultElement| {
        let list = element.get("vertex_indices").or_else(|| element.get("vertex_index"));
        list.and_then(indices)
    };
    let faces = of("face").iter().map(corners).collect::<Option<Vec<_>>>();
    Ok((vertices, faces.ok_or("a face has no `vertex_indices`")?))
}

/// A number of a PLY.
fn number(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(value) => value.into(),
        Property::UChar(value) => value.into(),
        Property::Short(value) => value.into(),
        Property::UShort(value) => value.into(),
        Property::Int(value) => value.into(),
        Property::UInt(value) => value.into(),
        Property::Float(value) => value.into(),
        Property::Double(value) => value,
        _ => return None,
    })
}

/// A list of indices of a PLY.
fn indices(property: &Property) -> Option<Vec<usize>> {
    fn all<T: Copy + TryInto<usize>>(list: &[T]) -> Option<Vec<usize>> {
        list.iter().map(|&index| index.try_into().ok()).collect()
    }
    match property {
        Property::ListChar(list) => all(list),
        Property::ListUChar(list) => all(list),
        Property::ListShort(list) => all(list),
        Property::ListUShort(list) => all(list),
        Property::ListInt(list) => all(list),
        Property::ListUInt(list) => all(list),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::meshes::stl;

    /// A cube with two triangles per side.
    fn cube() -> Vec<[DVec3; 3]> {
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let squares =
            [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = squares.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
        halves.map(|half| half.map(|i| 30.0 * corner(i))).collect()
    }

    #[test]
    fn coplanar_triangles_are_one_face() {
        let binary = stl::to_bytes("cube", &cube());
        let facet = |[a, b, c]: &[DVec3; 3]| {
            let vertex = |v: &DVec3| format!("vertex {} {} {}\n", v.x, v.y, v.z);
            let loops = [a, b, c].map(vertex).concat();
            format!("facet normal 0 0 0\nouter loop\n{loops}endloop\nendfacet\n")
        };
        let facets: String = cube().iter().map(facet).collect();
        let ascii = format!("solid cube\n{facets}endsolid cube\n");
        let vertices: String =
            cube().iter().flatten().map(|v| format!("{} {} {}\n", v.x, v.y, v.z)).collect();
        let faces: String =
            (0..12).map(|i| format!("3 {} {} {}\n", 3 * i, 3 * i + 1, 3 * i + 2)).collect();
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 36\nproperty float x\nproperty float y\nproperty float z\n\
             element face 12\nproperty list uchar int vertex_indices\nend_header\n{vertices}{faces}"
        );
        let mut of_others = binary.clone();
        of_others[..6].copy_from_slice(b"solid ");
        for bytes in [&binary[..], &of_others, ascii.as_bytes(), ply.as_bytes()] {
            let (mesh, inside_out) = read(bytes).unwrap();
            assert!(!inside_out);
            assert_eq!(mesh.faces().iter().map(Vec::len).collect::<Vec<_>>(), [4; 6]);
            assert!((mesh.mean_edge() - 30.0).abs() < 1e-6);
        }
    }

    #[test]
    fn broken_files_are_refused() {
        let whole = stl::to_bytes("cube", &cube());
        let promise =
            "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nend_header\n";
        for bytes in [&whole[..600], b"solid \nfacet", b"ply\n", promise.as_bytes(), b""] {
            assert!(read(bytes).is_err());
        }
    }
}
