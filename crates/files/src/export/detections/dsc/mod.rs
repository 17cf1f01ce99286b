//! `.dsc` target descriptions in the format of the reference detector and its fork (`docs/formats.md`, “.dsc target
//! descriptions”).
//!
//! ```text
//! 0,15,10,20.0                      board id, A, B, edge
//! delTag25h7,1.5                    family, border in bit-widths
//! -1,4,0,80,0,0                     tag (−1 = none), column, row, x, y, z: a line per corner
//! 0,5,1,110,17.32,0
//! …                                 and so on, board after board
//! ```
//!
//! Two dialects differ in the meaning of A and B, in the names of families and in units:
//!
//! | | original | fork |
//! |---|---|---|
//! | squares | A × B squares, corners (A−1) × (B−1), all listed | A × B corners |
//! | triangles | B = 0: triangle of A tiles a side, n(n+1)/2 corners, n = A−2 | A columns, B rows; any outline |
//! | triangular when | B = 0 | the family is a `delTag` |
//! | families | `t25h7`, … | `delTag25h7`, `aprilTag25h7`, … |
//!
//! ```
//! use deltille_files::export::dsc::{self, Dialect};
//!
//! let text = "0,2,2,10\ndelTag16h5,2\n0,0,0,0,0,0\n-1,1,0,10,0,0\n-1,0,1,5,8.66,0\n";
//! let target = dsc::read(text, "small")?;
//! assert_eq!(target.panels[0].corners.len(), 3);
//! assert_eq!(dsc::write(&target, Dialect::Fork)?.lines().nth(2), Some("0,0,0,0,0,0"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The reader accepts either dialect, spaces around commas, CRLF and a missing final newline. Coordinates may be in the unit of
//! the edge, in cm with the edge in mm, or in m with the edge in cm or mm; the reader infers the unit from the distance of
//! neighbouring corners.
//!
//! Limits: the original dialect describes only triangular outlines. Neither dialect describes untagged or inverted boards, or
//! tags in white squares. This crate contains the square families aprilTag16h5, 25h9 and 36h11;
//! other square families have no fingerprint here. The original program reads triangular tags with
//! the code tables of square tags, so it indexes such boards only by its own codes.

mod read;
mod write;

use std::fmt;
use std::str::FromStr;

pub use read::{read, read_in_mm};
pub use write::write;

use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::targets::{ListFormat, ListedSpec, Panel, Target, TargetSpec};

/// The dialect of a file, named after the program that reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Dialect {
    /// The reference detector.
    Original,
    /// Its fork, with real DelTag families.
    #[default]
    Fork,
}

impl Dialect {
    /// The dialect from which a target was read; the fork's dialect for all other targets.
    pub fn of(target: &Target) -> Self {
        let original = ListedSpec { format: ListFormat::DscOriginal };
        if target.spec == TargetSpec::Listed(original) { Dialect::Original } else { Dialect::Fork }
    }
}

impl fmt::Display for Dialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Dialect::Original => "original",
            Dialect::Fork => "fork",
        })
    }
}

impl FromStr for Dialect {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "original" => Ok(Dialect::Original),
            "fork" => Ok(Dialect::Fork),
            _ => Err(format!("`{text}` is neither `fork` nor `original`")),
        }
    }
}

/// Error of reading or writing a `.dsc`.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DscError {
    /// A line is not valid.
    #[error("line {line}: {problem}")]
    Line {
        /// Counted from 1.
        line: usize,
        /// The problem.
        problem: String,
    },
    /// The boards are not a valid target.
    #[error("{0}")]
    Target(String),
    /// The dialect cannot describe the target.
    #[error("the {dialect} .dsc dialect cannot describe `{name}`: {reason}")]
    Refused {
        /// The dialect.
        dialect: Dialect,
        /// Name of the target.
        name: String,
        /// The reason and the remedy.
        reason: String,
    },
}

/// Names of the families without their prefix; the programs support only these.
const FAMILIES: [&str; 5] = ["16h5", "25h7", "25h9", "36h9", "36h11"];

/// The index of a corner in `.orpc` files: its position in the matrix of the panel, row by row.
///
/// Rows of rectangular boards are counted from the top in the original dialect.
pub fn point_id(panel: &Panel, dialect: Dialect, corner: Vertex) -> i64 {
    let [cols, rows] = panel.matrix.map(i64::from);
    let (row, col) = (i64::from(corner.row), i64::from(corner.col));
    match (panel.kind, dialect) {
        (GridKind::Checker, Dialect::Original) => (rows - 1 - row) * cols + col,
        _ => row * cols + col,
    }
}
