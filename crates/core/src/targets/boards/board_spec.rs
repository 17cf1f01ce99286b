//! What is asked for of a board.

use serde::{Deserialize, Serialize};

use super::tag_spec::{LEAST_DENSE_TILES, MOST_ROWS};
use crate::lattice::GridKind;
use crate::setting::Setting::{
    BoardBoardId, BoardBoards, BoardCols, BoardEdgeMm, BoardRows, BoardTags, BoardTwoSidedMm,
    TagFamily, TagHoleMm, TagTagsIn,
};
use crate::targets::length::format_mm;
use crate::targets::{TagSpec, TagsIn, TargetError};

/// Range of rows and of columns: two rows of two corners have a tile between them.
pub const SIDES: std::ops::RangeInclusive<u32> = 2..=MOST_ROWS;

/// Most corners of all boards together: their description takes 100 MB of text.
const MOST_CORNERS: u64 = 1_000_000;

/// Fewest corners of an untagged board: what the detector asks for where no tag vouches for a grid.
/// A hexagon of triangles, or four squares: a quad or two of random texture may pass for tiles,
/// twelve clean edges between so few corners do not.
pub const fn least_untagged_corners(kind: GridKind) -> u32 {
    match kind {
        GridKind::Deltille => 7,
        GridKind::Checker => 9,
    }
}

/// Range of the thickness of a plate with a board on either side, mm.
const TWO_SIDED_MM: std::ops::RangeInclusive<f64> = 0.1..=1000.0;

/// Range of a tile's edge, mm.
pub(crate) const EDGE_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Boards of `rows × cols` corners, all alike but for their ids.
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
    /// Number of boards. Each has a sheet of its own; they are loose, so that each lies in the
    /// origin of the target frame.
    #[serde(default = "one")]
    pub boards: u32,
    /// Id of the first board; the others follow.
    pub board_id: u32,
    /// Tags; `None` for an untagged board.
    pub tags: Option<TagSpec>,
    /// Whether black and white are exchanged: white tiles on a black field.
    pub inverted: bool,
    /// Thickness of the plate that carries a board on its back, too, mm; `None` for boards with one side. The back, whose
    /// id follows, is turned about the upright axis through the middle of the plate.
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
    /// Edge of the tiles of the published board, mm, which fits A4 with 10 × 11 corners.
    pub const USUAL_EDGE_MM: f64 = 20.0;

    /// One deltille board with tags, of so many rows and columns of corners.
    pub fn deltille(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Deltille, rows, cols, edge_mm)
    }

    /// One checkerboard with AprilTags, of so many rows and columns of corners.
    pub fn checkerboard(rows: u32, cols: u32, edge_mm: f64) -> Self {
        Self::new(GridKind::Checker, rows, cols, edge_mm)
    }

    /// One board with tags.
    pub fn new(grid: GridKind, rows: u32, cols: u32, edge_mm: f64) -> Self {
        let tags = Some(match grid {
            GridKind::Deltille => TagSpec::default(),
            GridKind::Checker => TagSpec::for_squares(TagsIn::Black),
        });
        let (boards, board_id, inverted, two_sided_mm) = (1, 0, false, None);
        Self { grid, rows, cols, edge_mm, boards, board_id, tags, inverted, two_sided_mm }
    }

    /// How many panels they are: one for each side.
    pub(crate) fn panel_count(&self) -> u32 {
        self.boards * if self.two_sided_mm.is_some() { 2 } else { 1 }
    }

    /// Checks what two sides need.
    fn check_sides(&self) -> Result<(), TargetError> {
        let refused = |problem: String| Err(TargetError::invalid(BoardTwoSidedMm, problem));
        match self.two_sided_mm {
            None => Ok(()),
            Some(mm) if !TWO_SIDED_MM.contains(&mm) => {
                refused(format!("{} is not between 0.1 mm and 1000 mm", format_mm(mm)))
            }
            Some(_) if self.boards > 1 => refused(
                "the two sides of one board are described together: make one board at a time"
                    .to_owned(),
            ),
            Some(_) if self.tags.is_none() => {
                refused("untagged sides cannot be told apart: give them tags".to_owned())
            }
            Some(_) if self.tags.as_ref().is_some_and(|tags| tags.hole_mm.is_some()) => {
                refused(format!(
                    "a hole through a tag of one side would be in a tile of the other: leave out {TagHoleMm}, or \
                 make one side"
                ))
            }
            Some(_) => Ok(()),
        }
    }

    /// Checks every number by itself.
    pub(crate) fn check(&self) -> Result<(), TargetError> {
        self.check_sides()?;
        for (setting, value) in [(BoardRows, self.rows), (BoardCols, self.cols)] {
            if !SIDES.contains(&value) {
                let problem = format!("{value} is not between 2 and {MOST_ROWS}");
                return Err(TargetError::invalid(setting, problem));
            }
        }
        if !EDGE_MM.contains(&self.edge_mm) {
            let problem = format!("{} is not between 1 mm and 1000 mm", format_mm(self.edge_mm));
            return Err(TargetError::invalid(BoardEdgeMm, problem));
        }
        if !(1..=MOST_ROWS).contains(&self.boards) {
            let problem = format!("{} is not between 1 and {MOST_ROWS}", self.boards);
            return Err(TargetError::invalid(BoardBoards, problem));
        }
        let corners =
            [self.rows, self.cols, self.panel_count()].into_iter().map(u64::from).product::<u64>();
        if corners > MOST_CORNERS {
            let problem = format!("{corners} corners are more than {MOST_CORNERS} in one target");
            return Err(TargetError::invalid(BoardBoards, problem));
        }
        if self.board_id.checked_add(self.panel_count()).is_none() {
            let problem = format!("{} leaves no ids for the boards after it", self.board_id);
            return Err(TargetError::invalid(BoardBoardId, problem));
        }
        let least = least_untagged_corners(self.grid);
        if self.tags.is_none() && self.rows * self.cols < least {
            let problem = format!(
                "{} × {} corners without tags are too few to be told from texture: take at least \
                 {least} corners, or tags",
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
                    let problem = "the one square between 2 × 2 corners is black";
                    return Err(TargetError::invalid(TagTagsIn, problem));
                }
                if tags.is_dense() && self.grid == GridKind::Deltille {
                    let boards = self.board_id..self.board_id + self.panel_count();
                    let (rows, cols) = (self.rows, self.cols);
                    if (rows - 1) * (cols - 1) < LEAST_DENSE_TILES {
                        let problem = format!(
                            "{rows} × {cols} corners have fewer than {LEAST_DENSE_TILES} tiles between them, too few to \
                             tell a place: take more, or tags of another {TagFamily}"
                        );
                        return Err(TargetError::invalid(BoardRows, problem));
                    }
                    tags.check_places(BoardBoardId, boards, BoardRows, [rows, cols])?;
                }
                Ok(())
            }
            None if self.boards > 1 => {
                let problem = "untagged boards cannot be told apart: give them tags, or make one";
                Err(TargetError::invalid(BoardBoards, problem))
            }
            None => Ok(()),
        }
    }
}
