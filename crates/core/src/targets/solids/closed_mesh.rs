//! Solids given as lists of faces: the requirements of a closed solid, and the irregularity of its triangles.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::polyhedron::{normal, sides, triangles};
use crate::angles::angle;
use crate::setting::Setting::{SolidBoardId, TagFirstId};

/// Largest deviation of an edge from the mean of its face, for near-equilateral faces. The faces of
/// geodesic spheres are nearly equal triangles; they deviate by up to 11 %. At 15 %, the side of
/// the board is still two thirds of the mean edge.
pub const NEAR_EQUILATERAL: f64 = 0.15;

/// Distance below which vertices are merged, relative to the mesh's extent: the rounding of numbers
/// with six digits.
const WELD: f64 = 1e-6;

/// Least height of a face relative to its longest edge; a flatter face counts as having no area.
const MIN_HEIGHT: f64 = 1e-4;

/// Least volume of a mesh relative to the cube of its extent; a smaller one counts as flat.
const MIN_VOLUME: f64 = 1e-6;

/// Largest distance of a vertex from the plane of its face, relative to the mesh's extent: 0.05 mm on a solid of half
/// a metre, the tolerance of a manufactured one.
const FLAT: f64 = 1e-4;

/// Sine of the smallest exterior angle (0.6°) at a corner of a face with four or more corners.
/// Below it, the two sides count as
/// one line.
const MIN_ROTATION: f64 = 0.01;

/// Largest coordinate, in the unit of the list.
const FARTHEST: f64 = 1e9;

/// Returns whether a number is a valid coordinate of a mesh.
pub fn is_coordinate(value: f64) -> bool {
    value.abs() <= FARTHEST
}

/// The noun for faces in messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceNoun {
    /// All faces are triangles.
    Triangle,
    /// Some faces are not triangles.
    Face,
}

impl fmt::Display for FaceNoun {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Triangle => "triangle",
            Self::Face => "face",
        })
    }
}

/// Why a list of faces is not a closed solid. Faces and vertices are numbered from 1.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClosedMeshError {
    /// The list is empty.
    #[error("the mesh has no triangles")]
    Empty,
    /// A coordinate is not finite, or too large to be squared in single precision.
    #[error("vertex {0}: coordinates must be finite numbers of at most {FARTHEST:e}")]
    NotFinite(usize),
    /// An index exceeds the number of vertices.
    #[error("{0} {1} refers to a vertex that does not exist")]
    NoSuchVertex(FaceNoun, usize),
    /// A face has no area.
    #[error("{0} {1} has no area")]
    NoArea(FaceNoun, usize),
    /// The vertices of a face are not coplanar.
    #[error("face {0} is not flat: split it into triangles")]
    NotFlat(usize),
    /// A face has a straight or concave corner.
    #[error("face {0} is not convex, or has a corner between two collinear sides: split it")]
    NotConvex(usize),
    /// An edge has a face on one side only.
    #[error("the mesh is open: {0} {1} has no neighbour along an edge")]
    Open(FaceNoun, usize),
    /// More than two faces share an edge.
    #[error("the mesh is not manifold: an edge of {0} {1} belongs to {2} {0}s")]
    CrowdedEdge(FaceNoun, usize, usize),
    /// Two neighbours have opposite orientation.
    #[error("neighbouring {0}s {1} and {2} have opposite winding")]
    Winding(FaceNoun, usize, usize),
    /// Solids touch only in a vertex, at these coordinates.
    #[error("the mesh is not manifold: parts of it touch only in the vertex at {0}")]
    Pinched(DVec3),
    /// The list contains more than one solid.
    #[error(
        "the mesh has {0} separate pieces: make a target of each, with {TagFirstId} and {SolidBoardId} set so that \
         no id is used twice"
    )]
    Pieces(usize),
    /// The solid has no volume.
    #[error("the mesh encloses no volume")]
    Flat,
    /// Faces intersect each other.
    #[error("{0}s {1} and {2} intersect")]
    CutsItself(FaceNoun, usize, usize),
}

/// A closed solid of flat, convex faces in one piece. The faces are counterclockwise as seen from outside.
///
/// It may be concave, but does not intersect itself. The order of faces, and the first vertex of each face, are those
/// of the list it was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Lists", into = "Lists")]
pub struct ClosedMesh {
    vertices: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

/// Serialised form of a closed mesh.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Lists {
    vertices: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

impl TryFrom<Lists> for ClosedMesh {
    type Error = ClosedMeshError;

    fn try_from(lists: Lists) -> Result<Self, ClosedMeshError> {
        Ok(Self::new(&lists.vertices, &lists.faces)?.0)
    }
}

impl From<ClosedMesh> for Lists {
    fn from(mesh: ClosedMesh) -> Self {
        Self { vertices: mesh.vertices, faces: mesh.faces }
    }
}

impl ClosedMesh {
    /// Checks a list of faces. Merges vertices at the same position, and drops vertices that no face uses. Reverses a
    /// mesh that is wound inside out; the second value is then true.
    ///
    /// # Errors
    /// Returns an error if the faces are not one closed surface, a face is not flat and convex, or a coordinate is
    /// not a number.
    pub fn new<F: AsRef<[usize]>>(
        vertices: &[DVec3],
        faces: &[F],
    ) -> Result<(Self, bool), ClosedMeshError> {
        use ClosedMeshError::*;
        if faces.is_empty() {
            return Err(Empty);
        }
        if let Some(bad) =
            vertices.iter().position(|v| !v.to_array().into_iter().all(is_coordinate))
        {
            return Err(NotFinite(bad + 1));
        }
        if let Some(bad) =
            faces.iter().position(|f| f.as_ref().iter().any(|&v| v >= vertices.len()))
        {
            return Err(NoSuchVertex(noun(faces), bad + 1));
        }
        let mut mesh = welded(vertices, faces);
        if let Some(bad) = (0..mesh.faces.len()).find(|&face| !mesh.has_area(face)) {
            return Err(NoArea(mesh.noun(), bad + 1));
        }
        let flat_within = FLAT * mesh.extent();
        if let Some(bad) = (0..mesh.faces.len()).find(|&face| !mesh.is_flat(face, flat_within)) {
            return Err(NotFlat(bad + 1));
        }
        if let Some(bad) = (0..mesh.faces.len()).find(|&face| !mesh.is_convex(face)) {
            return Err(NotConvex(bad + 1));
        }
        mesh.check_edges()?;
        mesh.check_vertices()?;
        let volume = mesh.volume();
        if volume.abs() < MIN_VOLUME * mesh.extent().powi(3) {
            return Err(Flat);
        }
        if volume < 0.0 {
            mesh.faces.iter_mut().for_each(|face| face[1..].reverse());
        }
        mesh.check_self()?;
        Ok((mesh, volume < 0.0))
    }

    /// Merges neighbouring faces in one plane if the result is convex: triangle meshes split each
    /// square into two halves. Drops vertices within straight edges.
    ///
    /// # Errors
    /// Returns an error if the merged faces are not one closed surface.
    pub fn with_whole_faces(&self) -> Result<Self, ClosedMeshError> {
        let normals: Vec<DVec3> = (0..self.faces.len())
            .map(|face| normal(&self.corners(face)).normalize_or_zero())
            .collect();
        let mut beside = vec![Vec::new(); self.faces.len()];
        for faces in self.faces_at_edges().values() {
            if let [(a, _), (b, _)] = faces[..] {
                beside[a].push(b);
                beside[b].push(a);
            }
        }
        let mut members = Vec::new();
        let mut is_seen = vec![false; self.faces.len()];
        for first in 0..self.faces.len() {
            if is_seen[first] {
                continue;
            }
            is_seen[first] = true;
            let (mut group, mut next) = (vec![first], 0);
            while let Some(&face) = group.get(next) {
                next += 1;
                for &other in &beside[face] {
                    let is_level = normals[first].cross(normals[other]).length() < MIN_ROTATION
                        && normals[first].dot(normals[other]) > 0.0;
                    if is_level && !is_seen[other] {
                        is_seen[other] = true;
                        group.push(other);
                    }
                }
            }
            members.push(group);
        }
        let outlines = members.iter().flat_map(|members| match self.outline_of(members) {
            Some(outline) => vec![outline],
            None => members.iter().map(|&face| self.faces[face].clone()).collect(),
        });
        let outlines: Vec<Vec<usize>> = outlines.collect();
        // A vertex is dropped only if no face has a corner there.
        let is_straight = |face: &[usize], i: usize| {
            let at = |i: usize| self.vertices[face[i % face.len()]];
            let before = (at(i) - at(i + face.len() - 1)).normalize_or_zero();
            before.cross((at(i + 1) - at(i)).normalize_or_zero()).length() < MIN_ROTATION
        };
        let mut is_corner = vec![false; self.vertices.len()];
        for face in &outlines {
            (0..face.len())
                .filter(|&i| !is_straight(face, i))
                .for_each(|i| is_corner[face[i]] = true);
        }
        let corners = |face: &Vec<usize>| face.iter().copied().filter(|&v| is_corner[v]).collect();
        let faces: Vec<Vec<usize>> = outlines.iter().map(corners).collect();
        Self::new(&self.vertices, &faces).map(|(mesh, _)| mesh)
    }

    /// Returns the outline of connected faces in one plane, if it is a single convex polygon.
    fn outline_of(&self, faces: &[usize]) -> Option<Vec<usize>> {
        let edges: BTreeSet<(usize, usize)> =
            faces.iter().flat_map(|&face| sides(&self.faces[face])).collect();
        let rim = edges.iter().filter(|&&(from, to)| !edges.contains(&(to, from)));
        let next: BTreeMap<usize, usize> = rim.clone().copied().collect();
        let (&first, _) = next.first_key_value()?;
        let outline: Vec<usize> = std::iter::successors(Some(first), |at| {
            next.get(at).copied().filter(|&to| to != first)
        })
        .take(next.len() + 1)
        .collect();
        let whole = outline.len() == next.len() && next.len() == rim.count();
        let rotations = |i: usize| {
            let at = |i: usize| self.vertices[outline[i % outline.len()]];
            let side = |i: usize| (at(i + 1) - at(i)).normalize_or_zero();
            side(i).cross(side(i + 1)).dot(normal(&self.corners(faces[0])).normalize_or_zero())
        };
        (whole && (0..outline.len()).all(|i| rotations(i) > -MIN_ROTATION)).then_some(outline)
    }

    /// Returns the vertices, in the unit of the list.
    pub fn vertices(&self) -> &[DVec3] {
        &self.vertices
    }

    /// Returns the vertex indices of each face.
    pub fn faces(&self) -> &[Vec<usize>] {
        &self.faces
    }

    /// Returns the mean length of all edges.
    pub fn mean_edge(&self) -> f64 {
        // Every edge belongs to two faces.
        let lengths = (0..self.faces.len()).flat_map(|face| self.lengths(face));
        lengths.sum::<f64>() / self.faces.iter().map(Vec::len).sum::<usize>() as f64
    }

    /// Returns the triangle that is farthest from equilateral, and the largest relative deviation
    /// of its edges from their mean.
    pub fn most_skewed(&self) -> (usize, f64) {
        let deviation = |face: usize| {
            let lengths = self.lengths(face);
            let mean = lengths.iter().sum::<f64>() / 3.0;
            lengths.iter().map(|length| (length / mean - 1.0).abs()).fold(0.0, f64::max)
        };
        let triangles = (0..self.faces.len()).filter(|&face| self.faces[face].len() == 3);
        let faces = triangles.map(|face| (face, deviation(face)));
        faces.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default()
    }

    fn corners(&self, face: usize) -> Vec<DVec3> {
        self.faces[face].iter().map(|&vertex| self.vertices[vertex]).collect()
    }

    fn lengths(&self, face: usize) -> Vec<f64> {
        sides(&self.faces[face])
            .map(|(from, to)| self.vertices[from].distance(self.vertices[to]))
            .collect()
    }

    fn extent(&self) -> f64 {
        extent(&self.vertices)
    }

    fn has_area(&self, face: usize) -> bool {
        let lengths = self.lengths(face);
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let area = normal(&self.corners(face)).length();
        area > MIN_HEIGHT * longest * longest && lengths.iter().all(|&length| length > 0.0)
    }

    fn is_flat(&self, face: usize, within: f64) -> bool {
        let corners = self.corners(face);
        let normal = normal(&corners).normalize_or_zero();
        corners.iter().all(|v| normal.dot(v - corners[0]).abs() <= within)
    }

    /// Returns whether a face with four or more corners bends in the same direction at all of them,
    /// and only once around.
    fn is_convex(&self, face: usize) -> bool {
        let corners = self.corners(face);
        let count = corners.len();
        let outwards = normal(&corners).normalize_or_zero();
        let side = |i: usize| (corners[(i + 1) % count] - corners[i % count]).normalize_or_zero();
        let rotations = (0..count).map(|i| {
            let (before, behind) = (side(i), side(i + 1));
            let sine = before.cross(behind).dot(outwards);
            (sine, angle(sine, before.dot(behind)))
        });
        let rotations: Vec<(f64, f64)> = rotations.collect();
        let around: f64 = rotations.iter().map(|(_, turn)| turn).sum();
        count == 3 || rotations.iter().all(|(sine, _)| *sine > MIN_ROTATION) && around < 1.5 * TAU
    }

    /// Returns the sum of the signed volumes of the tetrahedra between one vertex and the faces.
    fn volume(&self) -> f64 {
        let o = self.vertices[0];
        let surface = (0..self.faces.len()).flat_map(|face| triangles(&self.corners(face)));
        surface.map(|[a, b, c]| (a - o).dot((b - o).cross(c - o)) / 6.0).sum()
    }

    /// Returns the faces at each edge, and whether each runs along the edge from the lower vertex to the higher.
    fn faces_at_edges(&self) -> BTreeMap<[usize; 2], Vec<(usize, bool)>> {
        let mut edges = BTreeMap::<_, Vec<_>>::new();
        for (face, vertices) in self.faces.iter().enumerate() {
            for (from, to) in sides(vertices) {
                let edge = [from.min(to), from.max(to)];
                edges.entry(edge).or_default().push((face, from < to));
            }
        }
        edges
    }

    fn noun(&self) -> FaceNoun {
        noun(&self.faces)
    }

    fn check_edges(&self) -> Result<(), ClosedMeshError> {
        let noun = self.noun();
        for faces in self.faces_at_edges().values() {
            match faces.as_slice() {
                [(a, along), (b, other)] if along == other => {
                    return Err(ClosedMeshError::Winding(noun, a + 1, b + 1));
                }
                [_, _] => {}
                [(face, _)] => return Err(ClosedMeshError::Open(noun, face + 1)),
                many => {
                    return Err(ClosedMeshError::CrowdedEdge(noun, many[0].0 + 1, many.len()));
                }
            }
        }
        Ok(())
    }

    /// Checks that the faces around each vertex form one ring, and that all faces are connected.
    fn check_vertices(&self) -> Result<(), ClosedMeshError> {
        let mut next = vec![BTreeMap::new(); self.vertices.len()];
        // Around a vertex, each face leads from the vertex after it to the one before.
        for face in &self.faces {
            let count = face.len();
            for i in 0..count {
                next[face[i]].insert(face[(i + 1) % count], face[(i + count - 1) % count]);
            }
        }
        for (vertex, ring) in next.iter().enumerate() {
            let Some((&first, _)) = ring.first_key_value() else { continue };
            let (mut at, mut steps) = (ring[&first], 1);
            while at != first {
                (at, steps) = (ring[&at], steps + 1);
            }
            if steps < ring.len() {
                return Err(ClosedMeshError::Pinched(self.vertices[vertex]));
            }
        }
        let mut pieces = 0;
        let mut seen = vec![false; self.vertices.len()];
        for start in 0..seen.len() {
            pieces += usize::from(!seen[start]);
            let mut open = vec![start];
            while let Some(vertex) = open.pop() {
                if !std::mem::replace(&mut seen[vertex], true) {
                    open.extend(next[vertex].keys());
                }
            }
        }
        if pieces > 1 { Err(ClosedMeshError::Pieces(pieces)) } else { Ok(()) }
    }

    /// Checks that no edge intersects a face with which it shares no vertex.
    fn check_self(&self) -> Result<(), ClosedMeshError> {
        let boxes: Vec<[DVec3; 2]> = (0..self.faces.len())
            .map(|face| {
                let corners = self.corners(face);
                let least = corners.iter().copied().reduce(DVec3::min).unwrap_or_default();
                let most = corners.iter().copied().reduce(DVec3::max).unwrap_or_default();
                [least, most]
            })
            .collect();
        for (&[from, to], faces) in &self.faces_at_edges() {
            let (p, q) = (self.vertices[from], self.vertices[to]);
            let (low, high) = (p.min(q), p.max(q));
            for (other, [least, most]) in boxes.iter().enumerate() {
                let apart = low.cmpgt(*most).any() || high.cmplt(*least).any();
                let touching = self.faces[other].iter().any(|&v| v == from || v == to);
                let is_pierced = || {
                    let triangles = triangles(&self.corners(other));
                    triangles.into_iter().any(|triangle| pierces([p, q], triangle))
                };
                if !apart && !touching && is_pierced() {
                    let [one, other] = [faces[0].0 + 1, other + 1];
                    return Err(ClosedMeshError::CutsItself(self.noun(), one, other));
                }
            }
        }
        Ok(())
    }
}

fn noun<F: AsRef<[usize]>>(faces: &[F]) -> FaceNoun {
    match faces.iter().all(|face| face.as_ref().len() == 3) {
        true => FaceNoun::Triangle,
        false => FaceNoun::Face,
    }
}

/// Returns whether a segment intersects a triangle.
fn pierces([p, q]: [DVec3; 2], [a, b, c]: [DVec3; 3]) -> bool {
    let normal = (b - a).cross(c - a);
    let (before, behind) = (normal.dot(p - a), normal.dot(q - a));
    if (before > 0.0) == (behind > 0.0) || before == behind {
        return false;
    }
    let at = p + (q - p) * (before / (before - behind));
    [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (to - from).cross(at - from).dot(normal) > 0.0)
}

fn extent(vertices: &[DVec3]) -> f64 {
    let least = vertices.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let most = vertices.iter().copied().reduce(DVec3::max).unwrap_or_default();
    (most - least).max_element()
}

/// Merges vertices at the same position, in the order in which the faces use them.
fn welded<F: AsRef<[usize]>>(vertices: &[DVec3], faces: &[F]) -> ClosedMesh {
    let used: Vec<DVec3> = faces.iter().flat_map(F::as_ref).map(|&v| vertices[v]).collect();
    let near = WELD * extent(&used);
    let mut by_x: Vec<usize> = (0..vertices.len()).collect();
    by_x.sort_by(|&a, &b| vertices[a].x.total_cmp(&vertices[b].x));
    // The first vertex at a position represents all others there.
    let mut stands_for: Vec<usize> = (0..vertices.len()).collect();
    for (i, &a) in by_x.iter().enumerate() {
        let here = by_x[i + 1..].iter().take_while(|&&b| vertices[b].x - vertices[a].x <= near);
        for &b in here.filter(|&&b| vertices[b].distance(vertices[a]) <= near) {
            let first = stands_for[a].min(stands_for[b]);
            (stands_for[a], stands_for[b]) = (first, first);
        }
    }
    let mut mesh = ClosedMesh { vertices: Vec::new(), faces: Vec::with_capacity(faces.len()) };
    let mut index = BTreeMap::new();
    for face in faces {
        let named = face.as_ref().iter().map(|&vertex| {
            let first = stands_for[vertex];
            *index.entry(first).or_insert_with(|| {
                mesh.vertices.push(vertices[first]);
                mesh.vertices.len() - 1
            })
        });
        mesh.faces.push(named.collect());
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::ClosedMeshError::*;
    use super::FaceNoun::Triangle;
    use super::*;
    use crate::targets::Polyhedron;

    fn octahedron() -> (Vec<DVec3>, Vec<Vec<usize>>) {
        let solid = Polyhedron::octahedron(100.0);
        (solid.vertices_mm, solid.faces)
    }

    fn refused<F: AsRef<[usize]>>(vertices: &[DVec3], faces: &[F]) -> ClosedMeshError {
        ClosedMesh::new(vertices, faces).unwrap_err()
    }

    #[test]
    fn duplicate_vertices_merge_and_inverted_meshes_are_reversed() {
        let solid = Polyhedron::icosahedron(100.0);
        let vertices: Vec<DVec3> =
            (0..20).flat_map(|face| solid.corners_mm(face)).map(|v| v + 1e-5).collect();
        let faces: Vec<[usize; 3]> = (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let (mesh, turned) = ClosedMesh::new(&vertices, &faces).unwrap();
        assert!(mesh.vertices().len() == 12 && !turned);
        assert!((mesh.mean_edge() - 100.0).abs() < 1e-9 && mesh.most_skewed().1 < 1e-9);
        let inside_out: Vec<[usize; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let (again, turned) = ClosedMesh::new(&vertices, &inside_out).unwrap();
        assert!(turned && again.faces().len() == 20);
        assert!(again.volume() > 0.0 && (again.volume() - mesh.volume()).abs() < 1e-6);
        let text = serde_json::to_string(&mesh).unwrap();
        assert_eq!(serde_json::from_str::<ClosedMesh>(&text).unwrap(), mesh);
    }

    #[test]
    fn open_or_invalid_meshes_are_rejected() {
        let (vertices, faces) = octahedron();
        assert_eq!(refused::<[usize; 3]>(&vertices, &[]), Empty);
        assert_eq!(refused(&vertices, &faces[1..]), Open(Triangle, 1));
        assert_eq!(
            refused(&vertices, &[&faces[..], &[vec![0, 1, 9]]].concat()),
            NoSuchVertex(Triangle, 9)
        );
        let mut bad = vertices.clone();
        bad[2].y = f64::NAN;
        assert_eq!(refused(&bad, &faces), NotFinite(3));
        bad[2] = bad[1];
        assert_eq!(refused(&bad, &faces), NoArea(Triangle, 2));
        let mut wound = faces.clone();
        wound[3].swap(0, 1);
        assert!(matches!(refused(&vertices, &wound), Winding(Triangle, _, _)));
        let twice = [&faces[..], &faces[..]].concat();
        assert!(matches!(refused(&vertices, &twice), CrowdedEdge(Triangle, 1, 4)));
        // A second solid: separate from the first, sharing a vertex with it, and intersecting it.
        let beside = |by: DVec3| {
            let more: Vec<DVec3> = vertices.iter().map(|v| v + by).collect();
            let indices: Vec<Vec<usize>> =
                faces.iter().map(|f| f.iter().map(|v| v + 6).collect()).collect();
            refused(&[&vertices[..], &more[..]].concat(), &[&faces[..], &indices[..]].concat())
        };
        assert_eq!(beside(DVec3::X * 500.0), Pieces(2));
        assert!(matches!(beside(DVec3::X * 100.0 * 2f64.sqrt()), Pinched(_)));
        let flat = [[0, 1, 2], [2, 1, 0]];
        assert_eq!(refused(&vertices, &flat), Flat);
    }

    #[test]
    fn faces_of_four_must_be_flat_and_convex() {
        let cube = Polyhedron::cuboid(DVec3::splat(100.0));
        let (mesh, turned) = ClosedMesh::new(&cube.vertices_mm, &cube.faces).unwrap();
        assert!(!turned && mesh.faces().len() == 6 && mesh.most_skewed().1 == 0.0);
        assert!((mesh.volume() - 1e6).abs() < 1e-6 && (mesh.mean_edge() - 100.0).abs() < 1e-9);
        let mut bent = cube.vertices_mm.clone();
        bent[6] += DVec3::new(0.0, 0.0, 0.2);
        assert_eq!(refused(&bent, &cube.faces), NotFlat(5));
        // A vertex of the upper and of two other faces moved far inwards, in the plane of the upper one.
        let mut dented = Polyhedron::cuboid(DVec3::splat(100.0));
        let deep = |z: f64| DVec3::new(-20.0, -20.0, z);
        (dented.vertices_mm[6], dented.vertices_mm[2]) = (deep(50.0), deep(-50.0));
        assert_eq!(refused(&dented.vertices_mm, &dented.faces), NotConvex(5));
    }

    /// A vertex pushed through a face on the other side.
    #[test]
    fn self_intersecting_solids_are_rejected() {
        let (mut vertices, faces) = octahedron();
        vertices[4] = DVec3::new(40.0, 30.0, -40.0);
        let result = ClosedMesh::new(&vertices, &faces);
        assert!(matches!(result, Err(CutsItself(Triangle, _, _))), "{result:?}");
    }
}
