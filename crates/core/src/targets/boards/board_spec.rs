//! The specification of a board.

use serde::{Deserialize, Serialize};

use super::tag_spec::{MAX_ROWS, MIN_DENSE_TILES};
use crate::lattice::GridKind;
use crate::setting::Setting::{
    BoardBoardId, BoardBoards, BoardCols, BoardEdgeMm, BoardRows, BoardTags, BoardTwoSidedMm,
    TagFamily, TagHoleMm, TagTagsIn,
};
use crate::targets::length::format_mm;
use crate::targets::{TagSpec, TagsIn, TargetError};

/// Range of rows and of columns: two rows of two corners enclose one tile.
pub const SIDES: std::ops::RangeInclusive<u32> = 2..=MAX_ROWS;

/// Maximum number of corners of all boards together: their description takes 100 MB of text.
const MAX_CORNERS: u64 = 1_000_000;

/// Returns the fewest corners of an untagged board, as the detector requires of grids without a confirming tag. They
/// form a hexagon of triangles, or four squares. Random texture may contain one or two quads that pass for tiles, but
/// not twelve clean edges between so few corners.
pub const fn least_untagged_corners(kind: GridKind) -> u32 {
    match kind {
        GridKind::Deltille => 7,
        GridKind::Checker => 9,
    }
}

/// Range of the thickness of a two-sided plate, mm.
const TWO_SIDED_MM: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

/// Range of a tile's edge, mm.
pub(crate) const EDGE_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Boards of `rows × cols` corners that differ only in their ids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// The tiling.
    #[serde(default, skip_serializing_if = "is_deltille")]
    pub grid: GridKind,
    /// Number of rows of corners, 2 to 500.
    pub rows: u32,
    /// Number of corners in each row, 2 to 500.
    pub cols: u32,
    /// Length of a tile's edge, mm.
    pub edge_mm: f64,
    /// Number of boards. Each has its own sheet. They are loose, so each of them is at the origin of the target
    /// frame.
    #[serde(default = "one")]
    pub boards: u32,
    /// Id of the first board; the others follow.
    pub board_id: u32,
    /// Tags; `None` for an untagged board.
    pub tags: Option<TagSpec>,
    /// Whether black and white are inverted: white tiles on a black field.
    pub inverted: bool,
    /// Thickness of a plate with a second board on its back, mm; `None` for one-sided boards. The back has the next
    /// id and is rotated about the vertical axis through the centre of the plate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub two_sided_mm: Option<f64>,
}

fn one() -> u32 {
    1
}

fn is_deltille(kind: &GridKind) -> bool {
    *kind == GridKind::Deltille
}

impl BoardSpec {
    /// Tile edge of the published board, mm; it fits A4 with 10 × 11 corners.
    pub const DEFAULT_EDGE_MM: f64 = 20.0;

    /// Creates one deltille board with tags and the given numbers of rows and columns of corners.
    pub fn deltille(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Deltille, rows, cols, edge_mm)
    }

    /// Creates one checkerboard with AprilTags and the given numbers of rows and columns of corners.
    pub fn checkerboard(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Checker, rows, cols, edge_mm)
    }

    /// Creates one board with tags.
    pub fn new(grid: GridKind, rows: u32, cols: u32, edge_mm: f64) -> Self {
        let tags = Some(match grid {
            GridKind::Deltille => TagSpec::default(),
            GridKind::Checker => TagSpec::for_squares(TagsIn::Black),
        });
        let (boards, board_id, inverted, two_sided_mm) = (1, 0, false, None);
        Self { grid, rows, cols, edge_mm, boards, board_id, tags, inverted, two_sided_mm }
    }

    /// Returns the number of panels: one per side.
    pub(crate) fn panel_count(&self) -> u32 {
        self.boards * if self.two_sided_mm.is_some() { 2 } else { 1 }
    }

    /// Checks the requirements of two-sided boards.
    fn check_sides(&self) -> Result<(), TargetError> {
        let refused = |problem: String| Err(TargetError::invalid(BoardTwoSidedMm, problem));
        match self.two_sided_mm {
            None => Ok(()),
            Some(mm) if !TWO_SIDED_MM.contains(&mm) => {
                refused(format!("{} is not between 0.1 mm and 1000 mm", format_mm(mm)))
            }
            Some(_) if self.boards > 1 => refused(
                "a two-sided board must be the only board of its target: make one board at a time"
                    .to_owned(),
            ),
            Some(_) if self.tags.is_none() => {
                refused("untagged sides cannot be distinguished: add tags".to_owned())
            }
            Some(_) if self.tags.as_ref().is_some_and(|tags| tags.hole_mm.is_some()) => {
                refused(format!(
                    "a hole through a tag of one side would cut into a tile of the other: omit {TagHoleMm}, or \
             make a one-sided board",
                ))
            }
            Some(_) => Ok(()),
        }
    }

    /// Checks each number on its own.
    pub(crate) fn check(&self) -> Result<(), TargetError> {
        self.check_sides()?;
        for (setting, value) in [(BoardRows, self.rows), (BoardCols, self.cols)] {
            if !SIDES.contains(&value) {
                let problem = format!("{value} is not between 2 and {MAX_ROWS}");
                return Err(TargetError::invalid(setting, problem));
            }
        }
        if !EDGE_MM.contains(&self.edge_mm) {
            let problem = format!("{} is not between 1 mm and 1000 mm", format_mm(self.edge_mm));
            return Err(TargetError::invalid(BoardEdgeMm, problem));
        }
        if !(1..=MAX_ROWS).contains(&self.boards) {
            let problem = format!("{} is not between 1 and {MAX_ROWS}", self.boards);
            return Err(TargetError::invalid(BoardBoards, problem));
        }
        let corners =
            [self.rows, self.cols, self.panel_count()].into_iter().map(u64::from).product::<u64>();
        if corners > MAX_CORNERS {
            let problem =
                format!("{corners} corners exceed the maximum of {MAX_CORNERS} per target");
            return Err(TargetError::invalid(BoardBoards, problem));
        }
        if self.board_id.checked_add(self.panel_count()).is_none() {
            let problem = format!(
                "{} is too large: it leaves no ids for the following boards",
                self.board_id
            );
            return Err(TargetError::invalid(BoardBoardId, problem));
        }
        let least = least_untagged_corners(self.grid);
        if self.tags.is_none() && self.rows * self.cols < least {
            let problem = format!(
                "{} × {} corners without tags are too few to distinguish from texture: use at least \
             {least} corners, or add tags",
                self.rows, self.cols
            );
            let setting = match self.grid {
                GridKind::Deltille => BoardTags,
                GridKind::Checker => BoardRows,
            };
            return Err(TargetError::invalid(setting, problem));
        }
        match &self.tags {
            Some(tags) => {
                tags.check(self.grid)?;
                if (self.grid, self.rows, self.cols, tags.tags_in)
                    == (GridKind::Checker, 2, 2, TagsIn::White)
                {
                    let problem = "a board of 2 × 2 corners has only one square, which is black";
                    return Err(TargetError::invalid(TagTagsIn, problem));
                }
                if tags.is_dense() && self.grid == GridKind::Deltille {
                    let boards = self.board_id..self.board_id + self.panel_count();
                    let (rows, cols) = (self.rows, self.cols);
                    if (rows - 1) * (cols - 1) < MIN_DENSE_TILES {
                        let problem = format!(
                            "{rows} × {cols} corners enclose fewer than {MIN_DENSE_TILES} tiles, too few to \
                identify a position: use more corners, or tags of another {TagFamily}"
                        );
                        return Err(TargetError::invalid(BoardRows, problem));
                    }
                    tags.check_places(BoardBoardId, boards, BoardRows, [rows, cols])?;
                }
                Ok(())
            }
            None if self.boards > 1 => {
                let problem =
                    "untagged boards cannot be distinguished: add tags, or make one board";
                Err(TargetError::invalid(BoardBoards, problem))
            }
            None => Ok(()),
        }
    }
}
