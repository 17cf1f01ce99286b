//! Wavefront OBJ: textured meshes are written with materials and textures, in millimetres, and closed
//! meshes are read as solids.

use std::fmt::Write;
use std::ops::Range;

use glam::{DVec2, DVec3};

use super::mesh::TexturedMesh;
use crate::export::GENERATOR;
use crate::limits;
use deltille_core::targets::{ClosedMesh, ClosedMeshError, is_coordinate};

/// Error of using an OBJ as a solid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// The file is not a valid OBJ.
    #[error("not a readable OBJ: {0}")]
    Grammar(#[from] tobj::LoadError),
    /// The reader panicked.
    #[error(transparent)]
    Broken(#[from] limits::Broken),
    /// The faces are not one closed surface.
    #[error(transparent)]
    Mesh(#[from] ClosedMeshError),
}

/// Reads the faces of all objects and groups of an OBJ as one solid, in the unit of the file;
/// lines, points, materials and texture coordinates are ignored. The second value is true if the
/// surface was inside out.
///
/// # Errors
/// Returns an error if the file is not a valid OBJ, or if its faces are not one closed surface of flat, convex faces.
pub fn read(text: &[u8]) -> Result<(ClosedMesh, bool), ObjError> {
    let options =
        tobj::LoadOptions { ignore_lines: true, ignore_points: true, ..Default::default() };
    let no_materials = |_: &std::path::Path| Ok(Default::default());
    let load = || tobj::load_obj_buf(&mut &text[..], &options, no_materials);
    let (models, _) = limits::caught(load)??;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for mesh in models.iter().map(|model| &model.mesh) {
        let first = vertices.len();
        vertices.extend(mesh.positions.as_chunks::<3>().0.iter().copied().map(DVec3::from));
        // If the numbers of corners are missing, all faces are triangles.
        let triangles = vec![3; mesh.indices.len() / 3];
        let counts = if mesh.face_arities.is_empty() { &triangles } else { &mesh.face_arities };
        let mut indices = mesh.indices.iter().map(|&index| first + index as usize);
        faces.extend(counts.iter().map(|&n| indices.by_ref().take(n as usize).collect::<Vec<_>>()));
    }
    ClosedMesh::new(&vertices, &faces).map_err(|error| match error {
        // The reader numbers vertices in the order of use in faces, the user in the order of the file.
        ClosedMeshError::NotFinite(used) => {
            ClosedMeshError::NotFinite(first_not_finite(text).unwrap_or(used)).into()
        }
        other => other.into(),
    })
}

/// Number of the first `v` line with a value that is not a valid coordinate.
fn first_not_finite(text: &[u8]) -> Option<usize> {
    let text = String::from_utf8_lossy(text);
    let finite = |word: &str| word.parse().is_ok_and(is_coordinate);
    let mut lines = text.lines().filter_map(|line| line.trim_start().strip_prefix("v "));
    lines.position(|line| !line.split_whitespace().all(finite)).map(|index| index + 1)
}

/// The text of `<name>.obj`, which refers to `<name>.mtl`; lengths in mm. The faces of a texture follow its material.
pub fn text(mesh: &TexturedMesh) -> String {
    listed(mesh, 0..mesh.textures.len())
}

/// The text of [`part_name`]: the part of [`text`] with one texture, for readers that support one texture per mesh.
pub fn part(mesh: &TexturedMesh, texture: usize) -> String {
    listed(mesh, texture..texture + 1)
}

/// File name of the part of a mesh with one texture, counted from 0.
pub fn part_name(name: &str, texture: usize) -> String {
    format!("{name}-{}.obj", texture + 1)
}

fn listed(mesh: &TexturedMesh, textures: Range<usize>) -> String {
    let name = &mesh.name;
    let generator = mesh.extras["generator"].as_str().unwrap_or("deltille");
    let mut text = format!("# {generator}, millimetres\n# {}\n", mesh.extras);
    // Writing to a string does not fail.
    let _ = writeln!(text, "mtllib {name}.mtl\no {name}");
    for face in textures.clone().flat_map(|texture| mesh.faces_of(texture)) {
        for v in face.vertices_mm {
            let _ = writeln!(text, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z);
        }
        for DVec2 { x: u, y: v } in face.uv {
            let _ = writeln!(text, "vt {u:.9} {:.9}", 1.0 - v);
        }
        let n = face.normal;
        let _ = writeln!(text, "vn {:.9} {:.9} {:.9}", n.x, n.y, n.z);
    }
    let mut index = 0;
    for texture in textures {
        let _ = writeln!(text, "usemtl {}", material_name(texture, mesh.textures.len()));
        for _ in mesh.faces_of(texture) {
            let corner = |i: usize| format!("{0}/{0}/{1}", 3 * index + i + 1, index + 1);
            let _ = writeln!(text, "f {} {} {}", corner(0), corner(1), corner(2));
            index += 1;
        }
    }
    text
}

/// The text of `<name>.mtl`, which refers to the textures.
pub fn material(mesh: &TexturedMesh) -> String {
    let count = mesh.textures.len();
    let material = |texture: usize| {
        let (name, picture) =
            (material_name(texture, count), texture_name(&mesh.name, texture, count));
        format!("newmtl {name}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {picture}\n")
    };
    format!("# {GENERATOR}, material\n") + &(0..count).map(material).collect::<String>()
}

/// Name of the material of one of `count` textures, counted from 0.
pub fn material_name(texture: usize, count: usize) -> String {
    numbered(MATERIAL.to_owned(), "-", texture, count)
}

/// Name of the only material.
pub const MATERIAL: &str = "print";

/// File name of one of `count` textures, counted from 0, of a target with this name: `<name>-texture.png`, or
/// `<name>-texture-1.png` and so on.
pub fn texture_name(name: &str, texture: usize, count: usize) -> String {
    numbered(format!("{name}-texture"), "-", texture, count) + ".png"
}

/// A name for one of `count` items, counted from 0; with several items, it ends with the number.
pub(in crate::export) fn numbered(
    word: String,
    between: &str,
    index: usize,
    count: usize,
) -> String {
    if count == 1 { word } else { format!("{word}{between}{}", index + 1) }
}
