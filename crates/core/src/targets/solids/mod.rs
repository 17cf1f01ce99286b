//! Solids: a board on every face.
//!
//! `solid_spec` contains the specification; `polyhedron` the regular solids, `closed_mesh` those given as lists of
//! faces. `face` fits the largest board that leaves a margin on a face, `solid` positions all of them in space, and
//! `skeleton` is a frame with a seat for a panel on every face.

pub(crate) mod closed_mesh;
pub(crate) mod face;
pub(crate) mod polyhedron;
pub(crate) mod skeleton;
pub(crate) mod solid;
pub(crate) mod solid_spec;

pub use closed_mesh::{ClosedMesh, ClosedMeshError, FaceNoun, NEAR_EQUILATERAL, is_coordinate};
pub use face::{Face, FaceBoard};
pub use polyhedron::{Polyhedron, sides, triangles};
pub use skeleton::{Incircle, Skeleton, SkeletonSpec};
pub use solid_spec::{FACE_TILES, SolidShape, SolidSpec};
