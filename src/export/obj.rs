//! Wavefront OBJ with its material and texture, in millimetres.

use std::fmt::Write;

use super::mesh::TexturedMesh;

/// The text of `<name>.obj`; it names `<name>.mtl`.
pub fn text(mesh: &TexturedMesh) -> String {
    let name = &mesh.name;
    let generator = mesh.extras["generator"].as_str().unwrap_or("deltille");
    let mut text = format!("# {generator}, millimetres\n# {}\n", mesh.extras);
    // Writing to a string does not fail.
    let _ = writeln!(text, "mtllib {name}.mtl\no {name}");
    for face in &mesh.faces {
        for v in face.vertices_mm {
            let _ = writeln!(text, "v {:.6} {:.6} {:.6}", v.x, v.y, v.z);
        }
        for [u, v] in face.uv {
            let _ = writeln!(text, "vt {u:.9} {:.9}", 1.0 - v);
        }
        let n = face.normal;
        let _ = writeln!(text, "vn {:.9} {:.9} {:.9}", n.x, n.y, n.z);
    }
    let _ = writeln!(text, "usemtl print");
    for index in 0..mesh.faces.len() {
        let corner = |i: usize| format!("{0}/{0}/{1}", 3 * index + i + 1, index + 1);
        let _ = writeln!(text, "f {} {} {}", corner(0), corner(1), corner(2));
    }
    text
}

/// The text of `<name>.mtl`; it names the texture `<name>-texture.png`.
pub fn material(mesh: &TexturedMesh) -> String {
    let texture = texture_name(&mesh.name);
    format!("newmtl print\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {texture}\n")
}

/// File name of the texture.
pub fn texture_name(name: &str) -> String {
    format!("{name}-texture.png")
}
