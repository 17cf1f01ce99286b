//! Tolerances, triangle counts and volumes of meshes.

use glam::DVec3;

use crate::finding::any::Finding;
use crate::finding::mesh::MeshFinding;
use deltille_core::words::counted;

/// Largest accepted deviation of a corner of a mesh, mm: a tenth of the error of a well glued panel. For very large
/// tiles and coarse textures it is 0.04 px of the image, or 0.15 px of the texture.
pub const MESH_TOLERANCE_MM: f64 = 0.05;

/// A mesh with more than this multiple of the stated triangles is not examined further.
const MAX_TRIANGLES: usize = 2;

/// Returns the finding about a mesh with a number of triangles other than stated.
pub(crate) fn other_count(found: usize, stated: usize) -> Option<Finding> {
    let problem = || format!("{} instead of {stated}", counted(found, "triangle"));
    (found != stated).then(|| MeshFinding::Body { problem: problem() }.into())
}

/// Whether a mesh has so many triangles that it must be a different one.
pub(crate) fn is_other_mesh(found: usize, stated: usize) -> bool {
    found > MAX_TRIANGLES * stated
}

/// Returns the volume enclosed by a closed surface, mm³, by the divergence theorem: the sum of a · (b × c) / 6 over
/// triangles a b c, negative if they are oriented inwards.
pub(crate) fn volume(triangles: impl Iterator<Item = [DVec3; 3]>) -> f64 {
    triangles.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}
