//! Binary STL of the bare solid, in millimetres.

use super::mesh::TexturedMesh;

/// The content of `<name>.stl`.
pub fn to_bytes(mesh: &TexturedMesh) -> Vec<u8> {
    let mut header = format!("deltille {}, millimetres", mesh.name).into_bytes();
    header.resize(80, b' ');
    let mut bytes = header;
    bytes.extend((mesh.faces.len() as u32).to_le_bytes());
    for face in &mesh.faces {
        for v in std::iter::once(face.normal).chain(face.vertices_mm) {
            bytes.extend(v.as_vec3().to_array().into_iter().flat_map(f32::to_le_bytes));
        }
        bytes.extend([0, 0]);
    }
    bytes
}
