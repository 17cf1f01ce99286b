//! How exact a mesh must be, how many triangles it has, and what it encloses.

use glam::DVec3;

use crate::finding::any::Finding;
use crate::finding::mesh::MeshFinding;
use deltille_core::words::counted;

/// Largest deviation of a corner of a mesh, mm: a tenth of the error of a well glued panel. Of very large tiles, and of coarse
/// textures, it is 0.04 px of the picture, or 0.15 px of the texture.
pub const MESH_TOLERANCE_MM: f64 = 0.05;

/// A mesh with so many times the stated triangles is not looked at any further either.
const MOST_TRIANGLES: usize = 2;

/// The finding about a mesh with another number of triangles than stated.
pub(crate) fn other_count(found: usize, stated: usize) -> Option<Finding> {
    let problem = || format!("{} instead of {stated}", counted(found, "triangle"));
    (found != stated).then(|| MeshFinding::Body { problem: problem() }.into())
}

/// Whether a mesh has so many triangles that it is another one.
pub(crate) fn is_other_mesh(found: usize, stated: usize) -> bool {
    found > MOST_TRIANGLES * stated
}

/// The volume enclosed by a closed surface, mm³, by the divergence theorem: the sum of a · (b × c) / 6
/// over triangles a b c, negative where they are oriented inwards.
pub(crate) fn volume(triangles: impl Iterator<Item = [DVec3; 3]>) -> f64 {
    triangles.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}
