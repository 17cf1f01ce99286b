//! Solids with faces of several shapes, as OBJ text.

use glam::DVec3;

/// Eight triangles and six squares.
pub fn cuboctahedron(edge: f64) -> String {
    let [diagonal, halfway, axes] = [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]].map(turned);
    obj(&halfway, edge / 2f64.sqrt(), &[diagonal, axes].concat())
}

/// Four triangles and four hexagons.
pub fn truncated_tetrahedron(edge: f64) -> String {
    let mut vertices = turned([3.0, 1.0, 1.0]);
    vertices.retain(|v| v.element_product() > 0.0);
    obj(&vertices, edge / 8f64.sqrt(), &turned([1.0, 1.0, 1.0]))
}

/// Twelve rhombi.
pub fn rhombic_dodecahedron(edge: f64) -> String {
    let vertices = [turned([1.0, 1.0, 1.0]), turned([2.0, 0.0, 0.0])].concat();
    obj(&vertices, edge / 3f64.sqrt(), &turned([1.0, 1.0, 0.0]))
}

/// Returns a vector with all signs and orders of its coordinates.
fn turned([a, b, c]: [f64; 3]) -> Vec<DVec3> {
    let orders = [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]];
    let signs = (0..8).map(|bits| DVec3::from_array([0, 1, 2].map(|k| [1.0, -1.0][bits >> k & 1])));
    let mut all: Vec<DVec3> =
        signs.flat_map(|sign| orders.map(|order| sign * DVec3::from(order) + 0.0)).collect();
    all.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    all.dedup();
    all
}

/// Returns a convex solid. The vertices farthest along a normal form a face.
fn obj(vertices: &[DVec3], scale: f64, normals: &[DVec3]) -> String {
    let mut text: String = vertices
        .iter()
        .map(|v| v * scale)
        .map(|v| format!("v {} {} {}\n", v.x, v.y, v.z))
        .collect();
    for normal in normals {
        let most = vertices.iter().map(|v| v.dot(*normal)).fold(0.0, f64::max);
        let mut around: Vec<usize> =
            (0..vertices.len()).filter(|&i| vertices[i].dot(*normal) > most - 1e-9).collect();
        // Counter-clockwise about the normal.
        let middle = around.iter().map(|&i| vertices[i]).sum::<DVec3>() / around.len() as f64;
        let right = vertices[around[0]] - middle;
        let angle = |i: usize| {
            let at = vertices[i] - middle;
            right.cross(at).dot(normal.normalize()).atan2(right.dot(at))
        };
        around.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
        let corners: Vec<String> = around.iter().map(|i| (i + 1).to_string()).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}
