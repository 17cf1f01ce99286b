//! Deviations of tiles and of the cells of tags.

use glam::DVec2;
use serde::Serialize;

/// A deviation of a tile or of its tag. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum TileFinding {
    /// A tile has the wrong colour.
    #[error("{}", tile_differs(*row, *col, *should_be_black))]
    TileColour {
        /// Row of its lower-left vertex.
        row: i32,
        /// Column of its lower-left vertex.
        col: i32,
        /// Whether it should be black.
        should_be_black: bool,
    },
    /// Part of a tile has the wrong colour.
    #[error(
        "spot of {area_mm2:.3} mm² at ({:.2}, {:.2}) mm in the tile at row {row} col {col}",
        at_mm.x, at_mm.y
    )]
    Blemish {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// Centre of the spot.
        at_mm: DVec2,
        /// Its area, mm².
        area_mm2: f64,
    },
    /// An edge of a tile or of one of its cells is displaced.
    #[error(
        "an edge at ({:.2}, {:.2}) mm in the tile at row {row} col {col} is displaced by {:.3} mm \
         towards {}",
        at_mm.x, at_mm.y, by_mm.abs(), lighter_or_darker(*by_mm)
    )]
    EdgeMoved {
        /// Row of the tile's lower-left vertex.
        row: i32,
        /// Column of the tile's lower-left vertex.
        col: i32,
        /// Position of the edge.
        at_mm: DVec2,
        /// Displacement, mm; positive where there is too much black.
        by_mm: f64,
    },
    /// A tag reads as a different one of its family, or is rotated.
    #[error("tag {id} at row {row} col {col} {}", what_reads(*id, *reads))]
    TagReads {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// The id that is read.
        reads: u32,
        /// Counter-clockwise rotation, in steps of 120°.
        rotations: u8,
    },
    /// A tag has too many wrong cells for correction.
    #[error("tag {id} at row {row} col {col} is unreadable: {} bits differ", bits.len())]
    TagUnreadable {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit index.
        bits: Vec<u32>,
    },
    /// A tag has wrong cells that decoding would correct.
    #[error("tag {id} at row {row} col {col} is damaged: {}", bits_differ(bits.len()))]
    TagDamaged {
        /// Stated id.
        id: u32,
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
        /// Wrong cells, by bit index.
        bits: Vec<u32>,
    },
    /// A tag on a sheet of single tags is not at its stated position.
    #[error("tag {id} is not at its stated position")]
    TagMissing {
        /// Stated id.
        id: u32,
    },
}

impl TileFinding {
    /// Returns the finding with its position converted to another frame.
    pub(crate) fn moved(self, place: impl Fn(DVec2) -> DVec2) -> Self {
        match self {
            Self::Blemish { row, col, at_mm, area_mm2 } => {
                Self::Blemish { row, col, at_mm: place(at_mm), area_mm2 }
            }
            Self::EdgeMoved { row, col, at_mm, by_mm } => {
                Self::EdgeMoved { row, col, at_mm: place(at_mm), by_mm }
            }
            other => other,
        }
    }
}

/// Describes how a tag reads where that differs from the target.
fn what_reads(id: u32, reads: u32) -> String {
    if id == reads { "is rotated".to_owned() } else { format!("reads {reads}") }
}

/// States the number of differing bits.
fn bits_differ(bits: usize) -> String {
    let differ = if bits == 1 { "bit differs" } else { "bits differ" };
    format!("{bits} {differ}")
}

/// Describes how the colour of a tile is wrong.
fn tile_differs(row: i32, col: i32, should_be_black: bool) -> String {
    match should_be_black {
        true => format!("tile missing at row {row} col {col}"),
        false => format!("tile at row {row} col {col} is black instead of white"),
    }
}

/// The colour towards which an edge is displaced; `by_mm` is positive where there is too much black.
fn lighter_or_darker(by_mm: f64) -> &'static str {
    if by_mm > 0.0 { "white" } else { "black" }
}
