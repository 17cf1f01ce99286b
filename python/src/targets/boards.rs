//! Boards from what is asked for.

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

/// What a board is, and the family of its tags.
pub type Made = (TargetSpec, Option<Arc<family::Family>>);

/// A board of a kind; what has a default of its own is added.
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

/// Tags as they are asked for.
pub struct Tags {
    pub family: Option<FamilyChoice>,
    pub tags_in: TagsIn,
    pub spacing: Option<u32>,
    pub border_bits: Option<f64>,
    pub first_id: u32,
    pub hole_mm: Option<f64>,
}

impl Tags {
    /// What a specification says, and the family.
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

/// How far tags are from each other.
pub fn spacing_of(tag_spacing: Option<i64>) -> PyResult<Option<u32>> {
    tag_spacing.map(|rows| whole("tag_spacing", rows, errors::target)).transpose()
}

flat! {
    /// A flat deltille board with tags.
    ///
    /// Parameters
    /// ----------
    /// rows, cols : int
    ///     Rows of corners, and corners in each row, 2 to 500.
    /// edge_mm : float, optional
    ///     Edge of a tile, mm; 20, or with ``paper`` the largest in whole mm that fits it.
    /// family : Family, str or path-like, optional
    ///     Family of the tags, see :meth:`Family.shipped`; delTag25h7 if left out. ``"dense9"`` for a place code in every
    ///     upright tile.
    /// tags : bool, optional
    ///     ``False`` for a board without tags.
    /// tag_spacing : int, optional
    ///     A tag in every n-th row and column.
    /// tag_border : float, optional
    ///     Black border of a tag, in widths of a bit.
    /// hole_mm : float, optional
    ///     Diameter of a hole in the middle of each tag, for a screw or a camera; the family must leave the cells there free
    ///     (``deltag gen-family --free centre``).
    /// first_id : int, optional
    ///     Id of the first tag; the others follow.
    /// boards : int, optional
    ///     Number of boards, alike but for their ids, each on a sheet of its own.
    /// board_id : int, optional
    ///     Id of the first board.
    /// inverted : bool, optional
    ///     Whether black and white are exchanged.
    /// poster : bool, optional
    ///     Whether a board that is larger than the paper is printed over several pages, to be joined.
    /// packed : bool, optional
    ///     Whether as many boards as fit are printed on each sheet, to be cut apart.
    /// two_sided_mm : float, optional
    ///     Thickness of a plate that carries a board on its back, too, mm.
    /// tag_ids : bool, optional
    ///     Whether the id of each tag is printed beside it, in small type.
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
    ///     Rows of inner corners, and corners in each row, 2 to 500.
    /// edge_mm : float, optional
    ///     Edge of a square, mm; 20, or with ``paper`` the largest in whole mm that fits it.
    /// family : Family, str or path-like, optional
    ///     ``"aprilTag36h11"``, ``"aprilTag25h9"`` or ``"aprilTag16h5"``; no tags if left out.
    /// tags_in : str, optional
    ///     Squares that carry the tags, ``"black"`` or ``"white"``.
    /// tag_spacing, tag_border, first_id, boards, board_id, inverted, poster, packed, two_sided_mm, tag_ids
    ///     As of :class:`Board`.
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
            _ => return Err(raised::TargetError::new_err("tags_in: give black or white")),
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
