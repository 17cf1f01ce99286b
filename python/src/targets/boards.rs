//! Deltille boards and checkerboards.

use std::path::PathBuf;
use std::sync::Arc;

use deltille::family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, usual_edge_mm};
use deltille::targets::{BoardSpec, TagSpec, TagsIn, TargetSpec};
use pyo3::prelude::*;

use super::families::FamilyChoice;
use super::paper::flat;
use super::target::Target;
use crate::boundary::arrays::whole;
use crate::boundary::errors::{self, raised};

/// A specification, and the family of its tags.
pub type Made = (TargetSpec, Option<Arc<family::Family>>);

/// The settings of a board; missing ones get their defaults.
struct Wanted {
    grid: GridKind,
    size: [i64; 2],
    edge_mm: Option<f64>,
    tags: Option<Tags>,
    boards: i64,
    board_id: i64,
    inverted: bool,
    two_sided_mm: Option<f64>,
}

/// The settings of tags.
pub struct Tags {
    pub family: Option<FamilyChoice>,
    pub tags_in: TagsIn,
    pub spacing: Option<u32>,
    pub border_bits: Option<f64>,
    pub first_id: u32,
    pub hole_mm: Option<f64>,
}

impl Tags {
    /// Returns the specification, and the family.
    pub fn spec(self, grid: GridKind) -> PyResult<(TagSpec, Arc<family::Family>)> {
        let default = TagSpec::usual(grid, None, self.tags_in);
        let usual_family = FamilyChoice::Name(PathBuf::from(default.family));
        let (name, family) = self.family.unwrap_or(usual_family).resolve()?;
        let usual = TagSpec::usual(grid, Some(&name), self.tags_in);
        let spec = TagSpec {
            first_id: self.first_id,
            spacing: self.spacing.unwrap_or(usual.spacing),
            border_bits: self.border_bits.unwrap_or(usual.border_bits),
            tags_in: self.tags_in,
            hole_mm: self.hole_mm,
            ..usual
        };
        Ok((spec, family))
    }
}

impl Wanted {
    fn make(self, paper: &PaperSpec) -> PyResult<Made> {
        let tags = self.tags.map(|tags| tags.spec(self.grid));
        let (tags, family) = tags.transpose()?.unzip();
        let [rows, cols] = self.size;
        let rows = whole("rows", rows, errors::target)?;
        let cols = whole("cols", cols, errors::target)?;
        let mut spec = BoardSpec {
            boards: whole("boards", self.boards, errors::target)?,
            board_id: whole("board_id", self.board_id, errors::target)?,
            tags,
            inverted: self.inverted,
            two_sided_mm: self.two_sided_mm,
            ..BoardSpec::new(self.grid, rows, cols, 1.0)
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_edge_mm(&spec, paper));
        Ok((TargetSpec::Board(spec), family))
    }
}

/// Checks the spacing of tags.
pub fn spacing_of(tag_spacing: Option<i64>) -> PyResult<Option<u32>> {
    tag_spacing.map(|rows| whole("tag_spacing", rows, errors::target)).transpose()
}

flat! {
    /// A flat deltille board with tags.
    ///
    /// Parameters
    /// ----------
    /// rows, cols : int
    ///     Rows of corners, and corners per row, 2 to 500.
    /// edge_mm : float, optional
    ///     Edge of a tile, mm; defaults to 20, or with ``paper`` to the largest whole number that fits.
    /// family : Family, str or path-like, optional
    ///     Family of the tags, see :meth:`Family.shipped`; defaults to delTag25h7. ``"dense9"`` places a position code in
    ///     every upright tile.
    /// tags : bool, optional
    ///     ``False`` makes a board without tags.
    /// tag_spacing : int, optional
    ///     Place a tag in every n-th row and column.
    /// tag_border : float, optional
    ///     Width of the black border of a tag, in cells.
    /// hole_mm : float, optional
    ///     Diameter of a hole in the centre of each tag, for a screw or a camera; the family must leave the cells there free
    ///     (``deltag gen-family --free centre``).
    /// first_id : int, optional
    ///     Id of the first tag; the others follow.
    /// boards : int, optional
    ///     Number of boards, which differ only in their ids, each on its own sheet.
    /// board_id : int, optional
    ///     Id of the first board.
    /// inverted : bool, optional
    ///     Swap black and white.
    /// poster : bool, optional
    ///     Split a board larger than the paper across several pages, to be joined.
    /// packed : bool, optional
    ///     Print as many boards as fit on each sheet, to be cut apart.
    /// two_sided_mm : float, optional
    ///     Thickness of a plate with boards on both sides, mm.
    /// tag_ids : bool, optional
    ///     Print the id of each tag next to it, in small type.
    Board, "board",
    (rows: i64, cols: i64),
    (
        edge_mm: Option<f64> = None,
        family: Option<FamilyChoice> = None,
        tags: bool = true,
        tag_spacing: Option<i64> = None,
        tag_border: Option<f64> = None,
        hole_mm: Option<f64> = None,
        first_id: i64 = 0,
        boards: i64 = 1,
        board_id: i64 = 0,
        inverted: bool = false,
        poster: bool = false,
        packed: bool = false,
        two_sided_mm: Option<f64> = None,
        tag_ids: bool = false,
    ),
    |on| {
        on = PaperSpec { poster, packed, tag_ids, ..on };
        let spacing = spacing_of(tag_spacing)?;
        let first_id = whole("first_id", first_id, errors::target)?;
        let of_tags =
            || Tags { family, tags_in: TagsIn::Black, spacing, border_bits: tag_border, first_id, hole_mm };
        let wanted = Wanted {
            grid: GridKind::Deltille,
            size: [rows, cols],
            edge_mm,
            tags: tags.then(of_tags),
            boards,
            board_id,
            inverted,
            two_sided_mm,
        };
        wanted.make(&on)?
    }
}

flat! {
    /// A flat checkerboard, plain or with square tags.
    ///
    /// Parameters
    /// ----------
    /// rows, cols : int
    ///     Rows of inner corners, and corners per row, 2 to 500.
    /// edge_mm : float, optional
    ///     Edge of a square, mm; defaults to 20, or with ``paper`` to the largest whole number that fits.
    /// family : Family, str or path-like, optional
    ///     ``"aprilTag36h11"``, ``"aprilTag25h9"`` or ``"aprilTag16h5"``; defaults to no tags.
    /// tags_in : str, optional
    ///     Squares with tags, ``"black"`` or ``"white"``.
    /// tag_spacing, tag_border, first_id, boards, board_id, inverted, poster, packed, two_sided_mm, tag_ids
    ///     See :class:`Board`.
    Checkerboard, "checkerboard",
    (rows: i64, cols: i64),
    (
        edge_mm: Option<f64> = None,
        family: Option<FamilyChoice> = None,
        tags_in: &str = "black",
        tag_spacing: Option<i64> = None,
        tag_border: Option<f64> = None,
        first_id: i64 = 0,
        boards: i64 = 1,
        board_id: i64 = 0,
        inverted: bool = false,
        poster: bool = false,
        packed: bool = false,
        two_sided_mm: Option<f64> = None,
        tag_ids: bool = false,
    ),
    |on| {
        on = PaperSpec { poster, packed, tag_ids, ..on };
        let tags_in = match tags_in {
            "black" => TagsIn::Black,
            "white" => TagsIn::White,
            _ => {
                let what = format!("unknown tags_in {tags_in} (known: black, white)");
                return Err(raised::TargetError::new_err(what));
            }
        };
        let spacing = spacing_of(tag_spacing)?;
        let first_id = whole("first_id", first_id, errors::target)?;
        let of_tags = |family| Tags {
            family: Some(family),
            tags_in,
            spacing,
            border_bits: tag_border,
            first_id,
            hole_mm: None,
        };
        let wanted = Wanted {
            grid: GridKind::Checker,
            size: [rows, cols],
            edge_mm,
            tags: family.map(of_tags),
            boards,
            board_id,
            inverted,
            two_sided_mm,
        };
        wanted.make(&on)?
    }
}
