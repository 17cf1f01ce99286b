//! Specifications of targets: boards, solids, and targets for other detectors.

use serde::{Deserialize, Serialize};

use crate::targets::{AprilGridSpec, BoardSpec, CharucoSpec, CirclesSpec, SolidSpec, TagSheetSpec};

/// The specification of a target: enough to make the target again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum TargetSpec {
    /// Flat boards: deltille zigzags, or checkerboards.
    Board(BoardSpec),
    /// A solid with a board on each face.
    Solid(SolidSpec),
    /// Single tags in rows.
    Tags(TagSheetSpec),
    /// A ChArUco board.
    Charuco(CharucoSpec),
    /// An AprilGrid.
    AprilGrid(AprilGridSpec),
    /// A grid of circles.
    Circles(CirclesSpec),
    /// A target known only by its corners and tags, as another program listed them.
    Listed(ListedSpec),
}

/// Origin of a listed target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedSpec {
    /// The format of the list.
    pub format: ListFormat,
}

/// Formats that list a target's corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum ListFormat {
    /// `.dsc` in the dialect of the reference detector (`docs/formats.md`, “.dsc target descriptions”).
    DscOriginal,
    /// `.dsc` in the dialect of its fork.
    DscFork,
}

impl From<BoardSpec> for TargetSpec {
    fn from(spec: BoardSpec) -> Self {
        Self::Board(spec)
    }
}

impl From<SolidSpec> for TargetSpec {
    fn from(spec: SolidSpec) -> Self {
        Self::Solid(spec)
    }
}

impl From<TagSheetSpec> for TargetSpec {
    fn from(spec: TagSheetSpec) -> Self {
        Self::Tags(spec)
    }
}

impl From<AprilGridSpec> for TargetSpec {
    fn from(spec: AprilGridSpec) -> Self {
        Self::AprilGrid(spec)
    }
}

impl From<CirclesSpec> for TargetSpec {
    fn from(spec: CirclesSpec) -> Self {
        Self::Circles(spec)
    }
}

impl From<CharucoSpec> for TargetSpec {
    fn from(spec: CharucoSpec) -> Self {
        Self::Charuco(spec)
    }
}

impl TargetSpec {
    /// Returns whether the panels are fixed to each other: faces of a solid, sides of a board, or boards listed
    /// together. Otherwise they are separate loose sheets.
    pub fn is_rigid(&self) -> bool {
        match self {
            Self::Solid(_) | Self::Listed(_) => true,
            Self::Board(_) => self.two_sided_mm().is_some(),
            Self::Tags(_) | Self::Charuco(_) | Self::AprilGrid(_) | Self::Circles(_) => false,
        }
    }

    /// Returns the distance between the sides of a two-sided board, mm.
    pub fn two_sided_mm(&self) -> Option<f64> {
        match self {
            Self::Board(board) => board.two_sided_mm,
            _ => None,
        }
    }

    /// Returns whether each panel can be the front of a plate: boards whose corners are detected.
    pub fn is_on_plate(&self) -> bool {
        matches!(self, Self::Board(_) | Self::Charuco(_) | Self::AprilGrid(_))
    }

    /// Returns the family of the tags, by name or path; `None` for an untagged or listed target.
    pub fn family(&self) -> Option<&str> {
        match self {
            Self::Board(board) => board.tags.as_ref().map(|tags| tags.family.as_str()),
            Self::Solid(solid) => solid.tags.as_ref().map(|tags| tags.family.as_str()),
            Self::Tags(tags) => Some(&tags.family),
            Self::Charuco(charuco) => Some(&charuco.dictionary),
            Self::AprilGrid(grid) => Some(&grid.family),
            Self::Listed(_) | Self::Circles(_) => None,
        }
    }

    /// Returns the family of the square tags if other tags are triangular, by name or path.
    pub fn square_family(&self) -> Option<&str> {
        match self {
            Self::Solid(solid) => solid.square_tags.as_ref().map(|tags| tags.family.as_str()),
            _ => None,
        }
    }
}
