use serde::{Deserialize, Serialize};

/// What was asked for: enough to make the target again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum TargetSpec {
    /// A flat zigzag board.
    Board(BoardSpec),
}

/// A zigzag deltille board of `rows × cols` corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSpec {
    /// Rows of corners.
    pub rows: u32,
    /// Corners in each row.
    pub cols: u32,
    /// Length of a tile's edge, mm.
    pub edge_mm: f64,
    /// Board id.
    pub board_id: u32,
    /// Tags; `None` for an untagged board.
    pub tags: Option<TagSpec>,
    /// Exchange black and white.
    pub inverted: bool,
}

/// Which tags a board carries, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagSpec {
    /// Family name, or path of a family file.
    pub family: String,
    /// Id of the first tag.
    pub first_id: u32,
    /// A tag in every n-th row and column.
    pub spacing: u32,
    /// Border in bit-widths along the edge.
    pub border_bits: f64,
}
