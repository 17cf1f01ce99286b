//! Solids of triangles: vertices, faces, and where the frame of each face lies.

use glam::{DMat3, DVec2, DVec3};

use super::PanelPose;
use super::angles::direction;
use crate::lattice::ROW_HEIGHT;

/// A closed solid of triangles, mm; right-handed. Regular solids have their centre in the origin,
/// meshes keep the origin of their file.
///
/// A face lists its vertices counter-clockwise as seen from outside. The first two are the ends of
/// its lower edge, the third is its apex: printed on the face, x runs along the lower edge, y
/// towards the apex, z outwards.
///
/// The regular solids stand on the z axis, `n` is their upper vertex, `s` the lower one:
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
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Vertices, mm.
    pub vertices_mm: Vec<DVec3>,
    /// Indices of the vertices of each face.
    pub faces: Vec<[usize; 3]>,
}

/// A face with the largest board of tiles that it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Outline in the panel frame, mm, counter-clockwise from the left end of the lower edge.
    pub outline_mm: [DVec2; 3],
    /// Pose of the panel frame in the target frame.
    pub pose: PanelPose,
    /// Edge of a tile, mm.
    pub tile_edge_mm: f64,
}

impl Polyhedron {
    /// Four faces around a vertical axis.
    pub fn tetrahedron(edge_mm: f64) -> Self {
        // A base of radius a/√3 lies √6/12 a below the centre, the apex √6/4 a above.
        let mut vertices_mm = ring(3, edge_mm / 3f64.sqrt(), -edge_mm * 6f64.sqrt() / 12.0, 0.0);
        vertices_mm.push(DVec3::Z * edge_mm * 6f64.sqrt() / 4.0);
        let mut faces: Vec<[usize; 3]> = (0..3).map(|k| [k, (k + 1) % 3, 3]).collect();
        faces.push([1, 0, 2]);
        Self { vertices_mm, faces }
    }

    /// Eight faces; the vertices lie on the axes.
    pub fn octahedron(edge_mm: f64) -> Self {
        let radius = edge_mm / 2f64.sqrt();
        let mut vertices_mm = ring(4, radius, 0.0, 0.0);
        vertices_mm.extend([DVec3::Z * radius, DVec3::NEG_Z * radius]);
        let upper = (0..4).map(|k| [k, (k + 1) % 4, 4]);
        let lower = (0..4).map(|k| [(k + 1) % 4, k, 5]);
        Self { vertices_mm, faces: upper.chain(lower).collect() }
    }

    /// Twenty faces: five around each pole, ten in between.
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
        Self { vertices_mm, faces: faces.collect() }
    }

    /// The vertices of a face, mm.
    pub fn triangle_mm(&self, face: usize) -> [DVec3; 3] {
        self.faces[face].map(|vertex| self.vertices_mm[vertex])
    }

    /// All faces, mm, counter-clockwise from outside.
    pub fn triangles_mm(&self) -> Vec<[DVec3; 3]> {
        (0..self.faces.len()).map(|face| self.triangle_mm(face)).collect()
    }

    /// A face with the largest board of `tiles` tiles a side that leaves a margin; `None` where
    /// the margin takes all of it.
    ///
    /// The board is equilateral whatever the face is, and its lower side is parallel to that of
    /// the face. With its centre on the incentre of the face (inradius r), a vertex of the board
    /// of side S lies S/√3 away in direction d, and keeps the margin m from the edge with inward
    /// normal n when r + S/√3 d·n ≥ m.
    pub fn face(&self, face: usize, tiles: u32, margin_mm: f64) -> Option<Face> {
        let corners = self.triangle_mm(face);
        let [a, b, c] = corners;
        let lengths = [(c - b).length(), (a - c).length(), (b - a).length()];
        let around: f64 = lengths.iter().sum();
        let centre = (a * lengths[0] + b * lengths[1] + c * lengths[2]) / around;
        let normal = (b - a).cross(c - a);
        let inradius = normal.length() / around;
        let x = (b - a).normalize_or_zero();
        let z = normal.normalize_or_zero();
        let rotation = DMat3::from_cols(x, z.cross(x), z);
        let flat = |p: DVec3| (rotation.transpose() * (p - centre)).truncate();
        let outline = corners.map(flat);

        let normals =
            [0, 1, 2].map(|i| (outline[(i + 1) % 3] - outline[i]).perp().normalize_or_zero());
        let towards = [-150f64, -30.0, 90.0].map(|degrees| direction(degrees.to_radians()));
        let steepest = normals
            .iter()
            .flat_map(|n| towards.iter().map(move |d| -d.dot(*n)))
            .fold(0.0, f64::max);
        let side = 3f64.sqrt() * (inradius - margin_mm) / steepest;
        if !(side > 0.0 && side.is_finite()) {
            return None;
        }
        // The board's lower left end is lattice vertex (−1,−1); the panel's origin is (0,0).
        let tile_edge_mm = side / f64::from(tiles);
        let origin = towards[0] * side / 3f64.sqrt() + DVec2::new(1.5, ROW_HEIGHT) * tile_edge_mm;
        let translation = centre + rotation * origin.extend(0.0);
        Some(Face {
            outline_mm: outline.map(|p| p - origin),
            pose: PanelPose::new(rotation, translation),
            tile_edge_mm,
        })
    }

    /// Edges as pairs of vertices, lower index first, in the order in which the faces name them.
    pub fn edges(&self) -> Vec<[usize; 2]> {
        let mut edges = Vec::new();
        for face in &self.faces {
            for i in 0..3 {
                let (from, to) = (face[i], face[(i + 1) % 3]);
                let edge = [from.min(to), from.max(to)];
                if !edges.contains(&edge) {
                    edges.push(edge);
                }
            }
        }
        edges
    }
}

/// `n` vertices around the z axis; the first lies `turn` steps from the plane y = 0.
fn ring(n: usize, radius: f64, z: f64, turn: f64) -> Vec<DVec3> {
    let step = std::f64::consts::TAU / n as f64;
    (0..n).map(|k| (direction((k as f64 + turn) * step) * radius).extend(z)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solids() -> [Polyhedron; 3] {
        [
            Polyhedron::tetrahedron(150.0),
            Polyhedron::octahedron(150.0),
            Polyhedron::icosahedron(150.0),
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
                let [a, b, c] = solid.triangle_mm(index);
                assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "face {index}");
                for i in 0..3 {
                    let (from, to) = (face[i], face[(i + 1) % 3]);
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
                let expected = (150.0 - 2.0 * 3f64.sqrt() * 5.0) / 10.0;
                assert!((face.tile_edge_mm - expected).abs() < 1e-9);
                for (flat, vertex) in face.outline_mm.iter().zip(solid.triangle_mm(index)) {
                    let back = face.pose.target_from_panel(*flat);
                    assert!((back - vertex).length() < 1e-9);
                }
                // The lower edge runs along x, and z points outwards.
                assert!((face.outline_mm[0].y - face.outline_mm[1].y).abs() < 1e-9);
                let outwards = face.pose.matrix().z_axis;
                assert!(outwards.dot(face.pose.translation_mm) > 0.0);
            }
            assert_eq!(solid.face(0, 10, 50.0), None);
        }
    }
}
