//! What exists in the world: panels with a pose, their corners and tags, in millimetres.
//!
//! A [`TargetSpec`] says what was asked for; a [`Target`] says what that is, corner by corner. The
//! JSON file of a target (FORMAT `deltille/target/1`) holds both, so that a sheet printed today can
//! be detected, verified and made again from that one file.
//!
//! Frames: a *panel* frame has its origin on the panel's lattice vertex (0,0), x along the rows, y
//! up on the print, z towards the viewer; `target = rotation · panel + translation`.

mod against_spec;
pub(crate) mod angles;
mod aprilgrid;
pub(crate) mod board;
pub(crate) mod build;
mod capacity;
mod charuco;
mod circles;
mod closed_mesh;
pub(crate) mod error;
mod face;
pub(crate) mod identity;
pub mod json;
pub(crate) mod length;
mod panel;
pub(crate) mod polyhedron;
mod pose;
mod skeleton;
mod solid;
mod spec;
mod symmetry;
pub(crate) mod tag_sheet;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

pub use crate::Name;
use crate::family::Family;
pub use crate::identity::{Fingerprint, TargetIdentity, check_result_of, check_same_board};
use crate::lattice::GridKind;
use crate::quantity;
pub use aprilgrid::AprilGridSpec;
pub(crate) use board::tagged_tiles;
pub use board::{board_vertices, zigzag_vertices};
pub use charuco::CharucoSpec;
pub use circles::CirclesSpec;
pub use closed_mesh::is_coordinate;
pub use closed_mesh::{ClosedMesh, ClosedMeshError, FaceNoun, NEAR_EQUILATERAL};
pub use error::TargetError;
pub use face::{Face, FaceBoard};
pub use json::{SCHEMA, TargetFileError};
pub use length::{BoxError, LengthError, parse_box_mm, parse_length_mm};
pub use polyhedron::{Polyhedron, triangles};
pub use skeleton::Incircle;
pub use skeleton::{Skeleton, SkeletonSpec};
pub use spec::{BORDER_BITS, FACE_TILES, MOST_ROWS, SIDES, least_untagged_corners};
pub use spec::{
    BoardSpec, ListFormat, ListedSpec, SolidShape, SolidSpec, TagSheetSpec, TagSpec, TargetSpec,
};
pub(crate) use symmetry::symmetries;

/// A target: its panels with their corners and tags, whatever they are printed on.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name of the target, which is the stem of the names of its files.
    pub name: Name,
    /// The specification that the target was made from.
    pub spec: TargetSpec,
    /// The family of its tags; `None` on an untagged target.
    pub family: Option<FamilyRef>,
    /// Planar pieces, by ascending id.
    pub panels: Vec<Panel>,
    /// Identity of the target as printed, where this one has measured corners or refined panels.
    pub plan: Option<TargetIdentity>,
}

/// Names a family so that a changed code table cannot go unnoticed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FamilyRef {
    /// The family's name, such as `delTag25h7`.
    pub name: String,
    /// Its fingerprint, see [`crate::family::Family::fingerprint`]; empty where a file from
    /// elsewhere names a family whose codes this crate does not have.
    pub fingerprint: String,
    /// The family of its squares, where a target has faces of both tilings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub squares: Option<Box<FamilyRef>>,
}

impl FamilyRef {
    /// The family of tags in tiles of a kind, of a target that has such.
    pub fn of_tiling(&self, kind: GridKind) -> &Self {
        match (kind, &self.squares) {
            (GridKind::Checker, Some(squares)) => squares,
            _ => self,
        }
    }

    /// The name and fingerprint of a family.
    pub fn of(family: &Family) -> Self {
        let (name, fingerprint) = (family.name().to_owned(), family.fingerprint().to_owned());
        Self { name, fingerprint, squares: None }
    }
}

/// Why a family is not that of a target's tags.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OtherFamily {
    /// It has other codes.
    #[error("was made with fingerprint {wanted} of {name}, this one is {found}")]
    Codes {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// That of the family which is there.
        found: String,
    },
    /// The family has grown since, and the target has a tag that it did not have then.
    #[error("has a tag {id}, but {name} of fingerprint {wanted} had only {codes} codes")]
    Id {
        /// The family's name in the target.
        name: String,
        /// Fingerprint of the family that the target was made with.
        wanted: String,
        /// The tag.
        id: u32,
        /// How many codes the family had.
        codes: usize,
    },
    /// The target has holes where the family needs the cells.
    #[error("has holes of {hole_mm} mm in its tags, but {problem}")]
    Hole {
        /// Their diameter, mm.
        hole_mm: f64,
        /// Why they cannot be there.
        problem: String,
    },
}

/// How far the tiles of a panel reach beyond its corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outline {
    /// The black tiles that touch a corner.
    #[default]
    Touching,
    /// The same and one tile more at the right end of the lowest row, so that every row of a
    /// zigzag board has as many tiles as the next.
    Zigzag,
    /// The same and one tile more at each end of a triangle of corners, so that the tiles fill a
    /// triangle.
    Triangle,
}

/// Which tiles carry tags, by their colour on a board that is not inverted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TagsIn {
    /// Black tiles: the tile itself is the tag's border.
    #[default]
    Black,
    /// White squares of a checkerboard: the tag has a border of its own, and white around it.
    White,
}

impl TagsIn {
    /// Whether it is what goes without saying in files.
    pub fn is_black(&self) -> bool {
        *self == Self::Black
    }
}

/// A planar piece of a target: a board, or a face of a solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Board id, unique within the target.
    pub id: u32,
    /// The tiling.
    pub kind: GridKind,
    /// Length of a tile's edge, mm.
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    pub edge_mm: f64,
    /// Border of its tags in bit-widths along the edge; `None` without tags.
    #[serde(default, deserialize_with = "quantity::border_bits::de")]
    pub border_bits: Option<f64>,
    /// Which squares of a checkerboard carry its tags.
    #[serde(default, skip_serializing_if = "TagsIn::is_black")]
    pub tags_in: TagsIn,
    /// Blank between a tile and the border of the tag in it, bit-widths, where it is not the usual one.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::border_bits::de"
    )]
    pub tag_margin_bits: Option<f64>,
    /// Width of every second row and column of tiles of a checkerboard, in edges, where these are gaps between
    /// tags: those of which the lower left vertex has an odd row, or an odd column.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::gap_edges::de"
    )]
    pub gap_edges: Option<f64>,
    /// Diameter of the discs that are drawn about the corners instead of tiles, mm.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub discs_mm: Option<f64>,
    /// Diameter of the hole in the middle of each tag, mm.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub hole_mm: Option<f64>,
    /// Whether the colours are exchanged: white upright tiles, or squares, on a black field.
    pub inverted: bool,
    /// Width of the black around the tiles, mm, where that follows their outline: on an inverted face of a solid.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::rim_mm::de"
    )]
    pub rim_mm: Option<f64>,
    /// Which tiles are drawn around the corners.
    #[serde(default)]
    pub outline: Outline,
    /// Columns and rows of the matrix in which `.dsc` and `.orpc` files number the corners
    /// (`docs/formats.md`, “.dsc target descriptions”); it holds every corner.
    #[serde(deserialize_with = "quantity::side_of_matrix::de")]
    pub matrix: [u32; 2],
    /// Pose of the panel: from the panel frame to the target frame.
    pub pose: PanelPose,
    /// Saddle points, ordered by row, then column.
    pub corners: Vec<Corner>,
    /// Tags, ordered like the corners.
    pub tags: Vec<TagPlacement>,
}

/// `target = rotation · panel + translation`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PanelPose {
    /// Rotation matrix, row-major.
    #[serde(deserialize_with = "quantity::cosine::de")]
    pub rotation: [f64; 9],
    /// Translation, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub translation_mm: DVec3,
    /// Covariance of a small turn (rad) and move (mm) along the target's axes, where the pose was
    /// measured.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::pose_covariance::de"
    )]
    pub covariance: Option<[[f64; 6]; 6]>,
}

/// A vertex of a panel where all tiles meet (six of a deltille, four of a checkerboard).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Corner {
    /// Id of the corner, unique within the target.
    pub id: u32,
    /// Lattice row.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Lattice column.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
    /// Position in the panel frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub panel_mm: DVec2,
    /// Position in the target frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub target_mm: DVec3,
    /// Where it is on the target that was made, where that was measured. The positions above are those of
    /// the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<MeasuredPlace>,
}

/// Where a corner of a target that was made is, as the views of a calibration have it.
///
/// Offsets are relative to the plan where it fits the corners best, in any place and turn and at any scale.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasuredPlace {
    /// Offset from the plan, along the axes of the panel frame, mm.
    #[serde(deserialize_with = "quantity::place_mm::de")]
    pub offset_mm: DVec3,
    /// Covariance of that, mm²: xx, xy, xz, yy, yz, zz.
    #[serde(deserialize_with = "quantity::figure::de")]
    pub covariance_mm2: [f64; 6],
}

impl Corner {
    /// How far from its place in the plan it is, in the panel frame, mm; zero where that was not measured.
    pub fn offset_mm(&self) -> DVec3 {
        self.measured.map_or(DVec3::ZERO, |place| place.offset_mm)
    }
}

/// A tag in the upright tile, or the square, whose lower-left vertex is (row, col).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagPlacement {
    /// Index of the code in the family.
    pub id: u32,
    /// Row of the tile's lower-left vertex.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Column of the tile's lower-left vertex.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
}

impl Target {
    /// The same target with its panels in other places, as they were measured; `poses` are as many
    /// as it has panels.
    pub fn with_poses(&self, poses: &[PanelPose]) -> Self {
        let mut target = self.clone();
        for (panel, pose) in target.panels.iter_mut().zip(poses) {
            panel.pose = *pose;
            for corner in &mut panel.corners {
                corner.target_mm = pose.target_from_panel(corner.panel_mm);
            }
        }
        target
    }

    /// Whether its panels are sheets that lie about, each for itself; also boards of a list that has no poses of them.
    pub fn is_loose(&self) -> bool {
        self.panels.len() > 1 && (!self.spec.is_rigid() || self.overlapping_boards().is_some())
    }

    /// Ids of two boards of a list that would be in one place: each is listed in a plane of its own, and the list has no
    /// poses of the boards.
    pub fn overlapping_boards(&self) -> Option<[u32; 2]> {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        let panels: &[Panel] = if is_list { &self.panels } else { &[] };
        let pairs =
            panels.iter().enumerate().flat_map(|(i, a)| panels[..i].iter().map(move |b| (b, a)));
        let mut pairs = pairs.filter(|(a, b)| a.overlaps(b));
        pairs.next().map(|(a, b)| [a.id, b.id])
    }

    /// Whether its panels have places in one scene, as far as is known: a list tells nothing of what is around several.
    pub fn is_one_scene(&self) -> bool {
        let is_list = matches!(self.spec, TargetSpec::Listed(_));
        self.panels.len() <= 1 || !(self.is_loose() || is_list)
    }

    /// The tilings of its panels.
    pub fn tilings(&self) -> impl Iterator<Item = GridKind> {
        let has = |kind: &GridKind| self.panels.iter().any(|panel| panel.kind == *kind);
        [GridKind::Deltille, GridKind::Checker].into_iter().filter(has)
    }

    /// Its panels of a tiling alone.
    pub(crate) fn of_tiling(&self, kind: GridKind) -> Self {
        let panels = self.panels.iter().filter(|panel| panel.kind == kind).cloned().collect();
        Self { panels, ..self.clone() }
    }

    /// The ids of its tags in tiles of a kind, and their family.
    pub(crate) fn tags_of_tiling(&self, kind: GridKind) -> Option<(&FamilyRef, Vec<u32>)> {
        let own = self.panels.iter().filter(|panel| panel.kind == kind);
        let ids = own.flat_map(|panel| &panel.tags).map(|tag| tag.id).collect();
        Some((self.family.as_ref()?.of_tiling(kind), ids))
    }

    /// Whether a family is one that the target names: it has the fingerprint, or had it before it grew, and all tags
    /// of the target then.
    ///
    /// # Errors
    /// Why it is not.
    pub fn check_family(&self, named: &FamilyRef, family: &Family) -> Result<(), OtherFamily> {
        let of_family = self.panels.iter().filter(|panel| panel.kind == family.kind());
        for panel in of_family {
            let (Some(hole_mm), Some(border)) = (panel.hole_mm, panel.border_bits) else {
                continue;
            };
            if let Some(problem) =
                capacity::no_room_for_hole(family, panel.edge_mm, border, hole_mm)
            {
                return Err(OtherFamily::Hole { hole_mm, problem });
            }
        }
        // A file from elsewhere names a family without a fingerprint.
        if named.fingerprint.is_empty() || family.fingerprint() == named.fingerprint {
            return Ok(());
        }
        let (name, wanted) = (named.name.clone(), named.fingerprint.clone());
        let Some(codes) = family.codes_under(&wanted) else {
            return Err(OtherFamily::Codes {
                name,
                wanted,
                found: family.fingerprint().to_owned(),
            });
        };
        let ids = self.tags_of_tiling(family.kind()).map_or_else(Vec::new, |(_, ids)| ids);
        match ids.into_iter().find(|&id| id as usize >= codes) {
            Some(id) => Err(OtherFamily::Id { name, wanted, id, codes }),
            None => Ok(()),
        }
    }

    /// Whether places of its corners were measured.
    pub fn is_measured(&self) -> bool {
        self.panels.iter().flat_map(|panel| &panel.corners).any(|corner| corner.measured.is_some())
    }

    /// How well the measured places of its corners are known: standard deviation of a coordinate, root mean
    /// square over the corners that were measured, mm. `None` where none was.
    pub fn measured_sd_mm(&self) -> Option<f64> {
        let corners = self.panels.iter().flat_map(|panel| &panel.corners);
        let places = corners.filter_map(|corner| corner.measured);
        let variances =
            places.map(|MeasuredPlace { covariance_mm2: [xx, _, _, yy, _, zz], .. }| {
                (xx + yy + zz) / 3.0
            });
        let (sum, count) = variances.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
        (count > 0).then(|| (sum / f64::from(count)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::{Construction, Rules};

    /// A target that was made before its family grew is still one of it, as long as it has only tags of then.
    #[test]
    fn families_that_grew_are_those_of_older_targets() {
        let codes = Family::shipped("delTag16h5").unwrap().codes().to_vec();
        let dimension = crate::lattice::Dimension::from_bits(16).unwrap();
        let of = |codes: &[u64]| {
            let source = Construction::Imported { source: "a test".to_owned() };
            Family::new("grown", dimension, 5, codes.to_vec(), Rules::NONE, source).unwrap()
        };
        let then = of(&codes[..20]);
        let now = of(&codes).extending(&then).unwrap();
        let tags = TagSpec { family: "grown".to_owned(), ..TagSpec::default() };
        let spec = BoardSpec { tags: Some(tags), ..BoardSpec::deltille(8, 10, 20.0) };
        let mut board = Target::build("old", &TargetSpec::Board(spec), Some(&then)).unwrap();
        let named = board.family.clone().unwrap();
        assert_eq!(board.check_family(&named, &then), Ok(()));
        assert_eq!(board.check_family(&named, &now), Ok(()));
        let other = of(&codes[..21]);
        assert!(matches!(board.check_family(&named, &other), Err(OtherFamily::Codes { .. })));
        board.panels[0].tags[0].id = 20;
        let why = board.check_family(&named, &now).unwrap_err();
        assert!(matches!(why, OtherFamily::Id { id: 20, codes: 20, .. }), "{why}");
    }
}
