//! Physical targets: panels with a pose, their corners and tags, in millimetres.
//!
//! A [`TargetSpec`] specifies a target; a [`Target`] is the result, corner by corner. The JSON file of a target
//! (FORMAT `deltille/target/1`) contains both, so that a sheet printed today can be detected, verified and made again
//! from that one file. In the order in which a target is made:
//!
//! 1. `spec`: the specification; `boards` and `solids` each contain the specifications of their kind and make panels
//!    of them;
//! 2. `build`: from a specification and a family to a target; `error`: why that fails; `family_ref`: the family of a
//!    target;
//! 3. `target`, `panel`, `corner`, `pose`: the values; `symmetry`: rotations that leave a panel unchanged; `length`:
//!    lengths in mm;
//! 4. `identity`: the fingerprint of a target; `json`: its file, which `against_spec` compares with its
//!    specification.
//!
//! Frames: a *panel* frame has its origin on the panel's lattice vertex (0,0), x along the rows, y
//! up on the print, z towards the viewer; `target = rotation · panel + translation`.

mod against_spec;
pub(crate) mod boards;
pub(crate) mod build;
mod corner;
pub(crate) mod error;
mod family_ref;
pub(crate) mod identity;
pub mod json;
pub(crate) mod length;
mod panel;
mod pose;
pub(crate) mod solids;
mod spec;
mod symmetry;
mod target;

pub use crate::Name;
pub use crate::identity::{Fingerprint, TargetIdentity, check_result_of, check_same_board};
pub use boards::{
    AprilGridSpec, BORDER_BITS, BoardSpec, CharucoSpec, CirclesSpec, MAX_ROWS, SIDES, TagSheetSpec,
    TagSpec, board_vertices, least_untagged_corners, zigzag_vertices,
};
pub use corner::{Corner, MeasuredPosition};
pub use error::TargetError;
pub use family_ref::{FamilyRef, OtherFamily, UnknownCodes};
pub use json::{SCHEMA, TargetFileError};
pub use length::{BoxError, LengthError, parse_box_mm, parse_length_mm};
pub use panel::{Outline, Panel, TagPlacement, TagsIn};
pub use pose::PanelPose;
pub use solids::{
    ClosedMesh, ClosedMeshError, FACE_TILES, Face, FaceBoard, FaceNoun, Incircle, NEAR_EQUILATERAL,
    Polyhedron, Skeleton, SkeletonSpec, SolidShape, SolidSpec, is_coordinate, triangles,
};
pub use spec::{ListFormat, ListedSpec, TargetSpec};
pub use target::Target;

// For the crates above, which lay out and detect targets.
#[doc(hidden)]
pub use {
    boards::{size_mm, tagged_tiles, untied_panels},
    build::shipped_family,
    error::{Problem, problem},
    identity::fingerprint,
    length::format_mm,
    solids::sides,
    symmetry::symmetries,
};
