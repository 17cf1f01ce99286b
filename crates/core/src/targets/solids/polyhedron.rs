//! Solids: vertices and faces.

use glam::DVec3;

use crate::angles::direction;

/// A closed solid of flat, convex faces, mm; right-handed. Named solids are centred on the origin, meshes keep the
/// origin of their file.
///
/// A face lists its vertices counterclockwise as seen from outside. The first two are the ends of its lower edge; the
/// third vertex of a triangle is its apex. In the frame of a face, x runs along the
/// lower edge, y upwards to the apex, z outwards.
///
/// Solids of triangles stand on the z axis: `n` is their upper vertex, `s` the lower one. The faces of a cuboid are
/// perpendicular to the axes:
///
/// ```text
///   icosahedron, unfolded (the vertices u lie above, l below the middle, u0 in the plane y = 0)
///
///      n   n   n   n   n              faces  0– 4  u_k   u_k+1  n      upright
///     ╱0╲ ╱1╲ ╱2╲ ╱3╲ ╱4╲             faces  5– 9  u_k+1 u_k    l_k    upside down
///    u0──u1──u2──u3──u4──u0           faces 10–14  l_k   l_k+1  u_k+1  upright
///     ╲5╱ ╲6╱ ╲7╱ ╲8╱ ╲9╱ ╲           faces 15–19  l_k+1 l_k    s      upside down
///      l0──l1──l2──l3──l4──l0
///       ╲15╱╲16╱╲17╱╲18╱╲19╱          10–14 stand between 5–9, e.g. 10 on l0–l1 below u1
///        s   s   s   s   s
///
///   octahedron:  faces 0–3  e_k  e_k+1  n;  faces 4–7  e_k+1  e_k  s
///   tetrahedron: faces 0–2  b_k  b_k+1  n;  face 3     b_1    b_0  b_2
///
///   cuboid, unfolded (l0 is the vertex with the least x, y and z; u_k lies above l_k)
///
///            u0──u3
///            │ 4 │                  faces 0–3  l_k  l_k+1  u_k+1  u_k    around the z axis
///       u0──u1──u2──u3──u0          face  4    u1   u2     u3     u0     towards z
///       │ 0 │ 1 │ 2 │ 3 │           face  5    l0   l3     l2     l1     away from it
///       l0──l1──l2──l3──l0
///            │ 5 │
///            l0──l3
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Vertices, mm.
    pub vertices_mm: Vec<DVec3>,
    /// Indices of the vertices of each face.
    pub faces: Vec<Vec<usize>>,
}

impl Polyhedron {
    /// Creates four faces around a vertical axis.
    pub fn tetrahedron(edge_mm: f64) -> Self {
        // A base of radius a/√3 lies √6/12 a below the centre, the apex √6/4 a above.
        let mut vertices_mm = ring(3, edge_mm / 3f64.sqrt(), -edge_mm * 6f64.sqrt() / 12.0, 0.0);
        vertices_mm.push(DVec3::Z * edge_mm * 6f64.sqrt() / 4.0);
        let sides = (0..3).map(|k| [k, (k + 1) % 3, 3]);
        Self { vertices_mm, faces: sides.chain([[1, 0, 2]]).map(Vec::from).collect() }
    }

    /// Creates eight faces; the vertices lie on the axes.
    pub fn octahedron(edge_mm: f64) -> Self {
        let radius = edge_mm / 2f64.sqrt();
        let mut vertices_mm = ring(4, radius, 0.0, 0.0);
        vertices_mm.extend([DVec3::Z * radius, DVec3::NEG_Z * radius]);
        let upper = (0..4).map(|k| [k, (k + 1) % 4, 4]);
        let lower = (0..4).map(|k| [(k + 1) % 4, k, 5]);
        Self { vertices_mm, faces: upper.chain(lower).map(Vec::from).collect() }
    }

    /// Creates twenty faces: five around each pole, ten in between.
    pub fn icosahedron(edge_mm: f64) -> Self {
        // Circumradius R = a/4 √(10 + 2√5); the rings lie at ±R/√5 with radius 2R/√5.
        let radius = edge_mm / 4.0 * (10.0 + 2.0 * 5f64.sqrt()).sqrt();
        let (height, width) = (radius / 5f64.sqrt(), 2.0 * radius / 5f64.sqrt());
        let mut vertices_mm = ring(5, width, height, 0.0);
        vertices_mm.extend(ring(5, width, -height, 0.5));
        vertices_mm.extend([DVec3::Z * radius, DVec3::NEG_Z * radius]);
        let (n, s) = (10, 11);
        let (u, l) = (|k: usize| k % 5, |k: usize| 5 + k % 5);
        let faces = (0..5)
            .map(|k| [u(k), u(k + 1), n])
            .chain((0..5).map(|k| [u(k + 1), u(k), l(k)]))
            .chain((0..5).map(|k| [l(k), l(k + 1), u(k + 1)]))
            .chain((0..5).map(|k| [l(k + 1), l(k), s]));
        Self { vertices_mm, faces: faces.map(Vec::from).collect() }
    }

    /// Creates six faces perpendicular to the axes, with the given size along them.
    pub fn cuboid(size_mm: DVec3) -> Self {
        let around = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let ring = |z: f64| around.map(|(x, y)| DVec3::new(x, y, z) * size_mm / 2.0);
        let vertices_mm = [ring(-1.0), ring(1.0)].concat();
        let (l, u) = (|k: usize| k % 4, |k: usize| 4 + k % 4);
        let sides = (0..4).map(|k| [l(k), l(k + 1), u(k + 1), u(k)]);
        let ends = [[u(1), u(2), u(3), u(0)], [l(0), l(3), l(2), l(1)]];
        Self { vertices_mm, faces: sides.chain(ends).map(Vec::from).collect() }
    }

    /// Returns the vertices of a face, mm.
    pub fn corners_mm(&self, face: usize) -> Vec<DVec3> {
        self.faces[face].iter().map(|&vertex| self.vertices_mm[vertex]).collect()
    }

    /// Returns the outward unit normal of a face.
    pub fn normal(&self, face: usize) -> DVec3 {
        normal(&self.corners_mm(face)).normalize_or_zero()
    }

    /// Returns the surface as triangles, mm, counterclockwise from outside; each face is split from its first vertex.
    pub fn triangles_mm(&self) -> Vec<[DVec3; 3]> {
        (0..self.faces.len()).flat_map(|face| triangles(&self.corners_mm(face))).collect()
    }

    /// Returns the edges as pairs of vertices, lower index first, in the order in which the faces list them.
    pub fn edges(&self) -> Vec<[usize; 2]> {
        let mut edges = Vec::new();
        for face in &self.faces {
            for (from, to) in sides(face) {
                let edge = [from.min(to), from.max(to)];
                if !edges.contains(&edge) {
                    edges.push(edge);
                }
            }
        }
        edges
    }
}

/// Returns the sides of a face: pairs of vertices.
pub fn sides(face: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    face.iter().copied().zip(face.iter().copied().cycle().skip(1))
}

/// Splits a flat, convex polygon into triangles that share its first corner.
pub fn triangles<T: Copy>(corners: &[T]) -> Vec<[T; 3]> {
    corners.windows(2).skip(1).map(|ends| [corners[0], ends[0], ends[1]]).collect()
}

/// Returns the normal of a flat polygon; its length is twice the area.
pub(crate) fn normal(corners: &[DVec3]) -> DVec3 {
    let normals = triangles(corners).into_iter().map(|[a, b, c]| (b - a).cross(c - a));
    normals.reduce(|sum, normal| sum + normal).unwrap_or_default()
}

/// Returns `n` vertices around the z axis; the first is `turn` steps from the plane y = 0.
fn ring(n: usize, radius: f64, z: f64, turn: f64) -> Vec<DVec3> {
    let step = std::f64::consts::TAU / n as f64;
    (0..n).map(|k| (direction((k as f64 + turn) * step) * radius).extend(z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solids() -> [Polyhedron; 4] {
        [
            Polyhedron::tetrahedron(150.0),
            Polyhedron::octahedron(150.0),
            Polyhedron::icosahedron(150.0),
            Polyhedron::cuboid(DVec3::splat(150.0)),
        ]
    }

    /// Regular, closed, and with every face counter-clockwise from outside.
    #[test]
    fn solids_are_regular_closed_and_right_handed() {
        for solid in solids() {
            let mean = solid.vertices_mm.iter().sum::<DVec3>() / solid.vertices_mm.len() as f64;
            assert!(mean.length() < 1e-9);
            let mut directed = std::collections::BTreeSet::new();
            for (index, face) in solid.faces.iter().enumerate() {
                let corners = solid.corners_mm(index);
                assert!(normal(&corners).dot(corners.iter().sum()) > 0.0, "face {index}");
                for (from, to) in sides(face) {
                    let length = solid.vertices_mm[from].distance(solid.vertices_mm[to]);
                    assert!((length - 150.0).abs() < 1e-9);
                    assert!(directed.insert((from, to)), "two faces run along {from}–{to}");
                }
            }
            assert!(directed.iter().all(|&(from, to)| directed.contains(&(to, from))));
            let (v, e, f) = (solid.vertices_mm.len(), solid.edges().len(), solid.faces.len());
            assert_eq!(v + f, e + 2);
        }
    }

    #[test]
    fn a_board_keeps_its_margin_and_its_frame() {
        for solid in solids() {
            for index in 0..solid.faces.len() {
                let face = solid.face(index, 10, 5.0).unwrap();
                let blank = if face.outline_mm.len() == 3 { 3f64.sqrt() } else { 1.0 } * 5.0;
                let expected = (150.0 - 2.0 * blank) / 10.0;
                assert!((face.tile_edge_mm - expected).abs() < 1e-9);
                for (flat, vertex) in face.outline_mm.iter().zip(solid.corners_mm(index)) {
                    let back = face.pose.target_from_panel(*flat);
                    assert!((back - vertex).length() < 1e-9);
                }
                // The lower edge runs along x, and z points outwards.
                assert!((face.outline_mm[0].y - face.outline_mm[1].y).abs() < 1e-9);
                let outwards = face.pose.matrix().z_axis;
                assert!(outwards.dot(face.pose.translation_mm) > 0.0);
            }
            assert_eq!(solid.face(0, 10, 75.0), None);
        }
    }
}
