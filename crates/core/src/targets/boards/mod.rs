//! Flat targets: the specification of each kind, and the positions of its corners and tags.
//!
//! `board_spec` and `tag_spec` specify boards of triangles and squares, and `board` makes their panels. `charuco`,
//! `aprilgrid` and `circles` are the targets of other detectors, and `tag_sheet` contains single tags: each has its
//! specification and its panel in one file. `capacity` proposes remedies for families with too few codes.

pub(crate) mod aprilgrid;
pub(crate) mod board;
pub(crate) mod board_spec;
pub(crate) mod capacity;
pub(crate) mod charuco;
pub(crate) mod circles;
pub(crate) mod tag_sheet;
pub(crate) mod tag_spec;

pub use aprilgrid::AprilGridSpec;
pub use board::{board_vertices, size_mm, tagged_tiles, untied_panels, zigzag_vertices};
pub use board_spec::{BoardSpec, SIDES, least_untagged_corners};
pub use charuco::CharucoSpec;
pub use circles::CirclesSpec;
pub use tag_sheet::TagSheetSpec;
pub use tag_spec::{BORDER_BITS, MAX_ROWS, TagSpec};
