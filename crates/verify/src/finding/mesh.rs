//! Deviations of a mesh or a body to print.

use glam::DVec3;
use serde::Serialize;

use crate::finding::shown::shown;
use deltille_core::words::counted;

/// A deviation of a mesh or a body to print. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum MeshFinding {
    /// A corner of a mesh is displaced.
    #[error(
        "corner {id} at row {row} col {col} is off by ({:.3}, {:.3}, {:.3}) mm",
        shown(by_mm.x), shown(by_mm.y), shown(by_mm.z)
    )]
    CornerOff3d {
        /// Corner id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Found minus stated position in the target frame.
        by_mm: DVec3,
    },
    /// The surface of a body differs from the stated one.
    #[error("{problem}")]
    Body {
        /// Description of the deviation.
        problem: String,
    },
    /// Triangles of a mesh have wrong normals.
    #[error("{} with wrong normals", counted(*triangles, "triangle"))]
    Normals {
        /// Number of triangles.
        triangles: usize,
    },
    /// A tag on a mesh is not read, or is read with wrong bits.
    #[error("tag {id} at row {row} col {col} {}", how_read(*errors))]
    TagInexact {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Number of wrong bits; `None` when the tag was not read.
        errors: Option<u32>,
    },
}

/// Describes how a tag was read.
fn how_read(errors: Option<u32>) -> String {
    match errors {
        Some(errors) => format!("is read with {}", counted(errors as usize, "wrong bit")),
        None => "is not read".to_owned(),
    }
}
