use serde::{Deserialize, Serialize};

use super::TargetError;
use super::length::format_mm;

/// Most rows or columns of a board: more than the largest paper holds at the finest edge that
/// anybody prints, and few enough that no number overflows.
pub(crate) const MOST_ROWS: u32 = 500;

/// Range of rows and of columns: two rows of two corners have a tile between them.
pub(crate) const SIDES: std::ops::RangeInclusive<u32> = 2..=MOST_ROWS;

/// Most corners of all boards together: their description takes 100 MB of text.
const MOST_CORNERS: u64 = 1_000_000;

/// Range of a tile's edge, mm.
const EDGE_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Range of a tag's border, bit-widths. The border separates the code from the white around the
/// tile; with half a bit of it the detector no longer finds every corner of a clean print, from 0.6
/// on it does.
pub(crate) const BORDER_BITS: std::ops::RangeInclusive<f64> = 0.6..=10.0;

/// What was asked for: enough to make the target again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum TargetSpec {
    /// Flat zigzag boards.
    Board(BoardSpec),
    /// Known only by its corners and tags, as another program listed them.
    Listed(ListedSpec),
}

/// Zigzag deltille boards of `rows × cols` corners, all alike but for their ids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// Rows of corners.
    pub rows: u32,
    /// Corners in each row.
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
    /// Exchange black and white.
    pub inverted: bool,
}

fn one() -> u32 {
    1
}

/// Which tags a board carries, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSpec {
    /// Family name, or path of a family file.
    pub family: String,
    /// Id of the first tag; the others follow, by row, then column, board after board.
    pub first_id: u32,
    /// A tag in every n-th row and column.
    pub spacing: u32,
    /// Border in bit-widths along the edge.
    pub border_bits: f64,
}

/// Where a listed target comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ListedSpec {
    /// The format of the list.
    pub format: ListFormat,
}

/// Formats that list a target's corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ListFormat {
    /// `.dsc` in the dialect of the reference detector (FORMATS §5).
    DscOriginal,
    /// `.dsc` in the dialect of its fork.
    DscFork,
}

impl Default for TagSpec {
    /// delTag25h7 from id 0, a tag in every third row and column, a border of 1.5 bits: a tag has
    /// six plain tiles around each of its corners, and the border is that of published targets.
    fn default() -> Self {
        let family = "delTag25h7".to_owned();
        Self { family, first_id: 0, spacing: 3, border_bits: 1.5 }
    }
}

impl BoardSpec {
    /// Checks every number by itself.
    pub(super) fn check(&self) -> Result<(), TargetError> {
        for (option, value) in [("--rows", self.rows), ("--cols", self.cols)] {
            if !SIDES.contains(&value) {
                let problem = format!("{value} is not between 2 and {MOST_ROWS}");
                return Err(TargetError::invalid(option, problem));
            }
        }
        if !EDGE_MM.contains(&self.edge_mm) {
            let problem = format!("{} is not between 1 mm and 1000 mm", format_mm(self.edge_mm));
            return Err(TargetError::invalid("--edge", problem));
        }
        if !(1..=MOST_ROWS).contains(&self.boards) {
            let problem = format!("{} is not between 1 and {MOST_ROWS}", self.boards);
            return Err(TargetError::invalid("--boards", problem));
        }
        let corners =
            [self.rows, self.cols, self.boards].into_iter().map(u64::from).product::<u64>();
        if corners > MOST_CORNERS {
            let problem = format!("{corners} corners are more than {MOST_CORNERS} in one target");
            return Err(TargetError::invalid("--boards", problem));
        }
        if self.board_id.checked_add(self.boards).is_none() {
            let problem = format!("{} leaves no ids for the boards after it", self.board_id);
            return Err(TargetError::invalid("--board-id", problem));
        }
        match &self.tags {
            Some(tags) => tags.check(),
            None if self.boards > 1 => {
                let problem = "untagged boards cannot be told apart: give them tags, or make one";
                Err(TargetError::invalid("--boards", problem))
            }
            None => Ok(()),
        }
    }
}

impl TagSpec {
    fn check(&self) -> Result<(), TargetError> {
        if !(1..=MOST_ROWS).contains(&self.spacing) {
            let problem = format!("{} is not between 1 and {MOST_ROWS}", self.spacing);
            return Err(TargetError::invalid("--tag-spacing", problem));
        }
        if !BORDER_BITS.contains(&self.border_bits) {
            let problem = format!("{} is not between 0.6 and 10 bit-widths", self.border_bits);
            return Err(TargetError::invalid("--tag-border", problem));
        }
        Ok(())
    }
}
