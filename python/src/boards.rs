//! Boards from what is asked for.

use std::path::PathBuf;
use std::sync::Arc;

use deltille::family;
use deltille::lattice::GridKind;
use deltille::limits;
use deltille::logo::{self, LogoError, MAX_LOGO_BYTES};
use deltille::targets::{
    self, BoardSpec, DEFAULT_MARGIN_MM, PaperSpec, SolidSheets, TagSpec, TagsIn, TargetSpec,
    usual_edge_mm,
};
use pyo3::prelude::*;

use crate::arrays::whole;
use crate::errors::{self, Raise, RaiseFile, raised};
use crate::families::FamilyChoice;
use crate::targets::Target;

/// What a target is printed on.
pub fn paper(
    size: Option<&str>,
    orientation: &str,
    margin_mm: Option<f64>,
    solids: SolidSheets,
) -> PyResult<PaperSpec> {
    Ok(PaperSpec {
        size: size.map(str::parse).transpose().raise(errors::target)?,
        orientation: orientation.parse().raise(errors::target)?,
        margin_mm: margin_mm.unwrap_or(DEFAULT_MARGIN_MM),
        solids,
        ..PaperSpec::default()
    })
}

/// A paper with a logo, which is a file or the text of an SVG.
pub fn with_logo(
    paper: PaperSpec,
    logo: Option<PathBuf>,
    logo_height_mm: Option<f64>,
) -> PyResult<PaperSpec> {
    let Some(given) = logo else { return Ok(PaperSpec { logo_height_mm, ..paper }) };
    let is_text = given.to_str().is_some_and(|text| text.trim_start().starts_with('<'));
    let text = match given.to_str().filter(|_| is_text) {
        Some(text) => text.to_owned(),
        None => {
            limits::read_short_text(&given, MAX_LOGO_BYTES).raise_of_file(&given, errors::target)?
        }
    };
    let refused = |error| match error {
        LogoError::Outline(error) => error.to_string(),
        error if is_text => format!("logo: {error}"),
        error => format!("logo: {}: {error}", given.display()),
    };
    let logo = logo::from_svg(&text).map_err(refused).raise(errors::target)?;
    Ok(PaperSpec { logo: Some(logo), logo_height_mm, ..paper })
}

/// A board of a kind.
struct Wanted {
    grid: GridKind,
    size: [u32; 2],
    edge_mm: Option<f64>,
    tags: Option<Tags>,
    boards: u32,
    board_id: u32,
    inverted: bool,
    two_sided_mm: Option<f64>,
    name: String,
    paper: PaperSpec,
}

/// Tags as they are asked for.
pub struct Tags {
    pub family: Option<FamilyChoice>,
    pub tags_in: TagsIn,
    pub spacing: Option<u32>,
    pub border_bits: Option<f64>,
    pub first_id: u32,
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
            ..usual
        };
        Ok((spec, family))
    }
}

impl Wanted {
    fn make(self) -> PyResult<Target> {
        let tags = self.tags.map(|tags| tags.spec(self.grid));
        let (tags, family) = tags.transpose()?.unzip();
        let [rows, cols] = self.size;
        let mut spec = BoardSpec {
            boards: self.boards,
            board_id: self.board_id,
            tags,
            inverted: self.inverted,
            two_sided_mm: self.two_sided_mm,
            ..BoardSpec::new(self.grid, rows, cols, 1.0)
        };
        spec.edge_mm = self.edge_mm.unwrap_or_else(|| usual_edge_mm(&spec, &self.paper));
        let spec = TargetSpec::Board(spec);
        let target =
            targets::Target::build(&self.name, &spec, family.as_deref(), Some(&self.paper));
        Ok(Target { target: Arc::new(target.raise(errors::target)?), family })
    }
}

/// Rows and columns of corners.
fn size_of(rows: i64, cols: i64) -> PyResult<[u32; 2]> {
    Ok([whole("rows", rows, errors::target)?, whole("cols", cols, errors::target)?])
}

/// How far tags are from each other.
pub fn spacing_of(tag_spacing: Option<i64>) -> PyResult<Option<u32>> {
    tag_spacing.map(|rows| whole("tag_spacing", rows, errors::target)).transpose()
}

/// A flat deltille board with tags.
///
/// Parameters
/// ----------
/// rows, cols : int
///     Rows of corners, and corners in each row, 2 to 500.
/// edge_mm : float, optional
///     Edge of a tile, mm; 20, or with ``paper`` the largest in whole mm that fits it.
/// family : Family, str or path-like, optional
///     Family of the tags, see :meth:`Family.shipped`; delTag25h7 if left out.
/// tags : bool, optional
///     ``False`` for a board without tags.
/// tag_spacing : int, optional
///     A tag in every n-th row and column.
/// tag_border : float, optional
///     Black border of a tag, in widths of a bit.
/// first_id : int, optional
///     Id of the first tag; the others follow.
/// boards : int, optional
///     Number of boards, alike but for their ids, each on a sheet of its own.
/// board_id : int, optional
///     Id of the first board.
/// inverted : bool, optional
///     Whether black and white are exchanged.
/// paper : str, optional
///     ``"A4"``, ``"letter"``, ``"297x420mm"``, …; the smallest of A4 to A0 that takes the board if left out.
/// orientation : str, optional
///     ``"auto"``, ``"portrait"`` or ``"landscape"``.
/// margin_mm : float, optional
///     Blank along the edges of the paper, mm.
/// poster : bool, optional
///     Whether a board that is larger than the paper is printed over several pages, to be joined.
/// packed : bool, optional
///     Whether as many boards as fit are printed on each sheet, to be cut apart.
/// two_sided_mm : float, optional
///     Thickness of a plate that carries a board on its back, too, mm.
/// tag_ids : bool, optional
///     Whether the id of each tag is printed beside it, in small type.
/// guide_page : bool, optional
///     Whether a page with a picture, what to do, and a ruler is added.
/// logo : str or path-like, optional
///     An SVG, or the text of one, that is printed black at the other end of the label's strip: filled paths and strokes; \
///     white is paper.
/// logo_height_mm : float, optional
///     Height of the logo, mm; that of the strip if left out.
/// name : str, optional
///     Stem of the names of its files, printed on the sheet.
///
/// Raises
/// ------
/// TargetError
///     Where no such board can be made.
///
/// Examples
/// --------
/// >>> import deltille
/// >>> board = deltille.Board(10, 11, edge_mm=20)
/// >>> board.corners.shape
/// (110, 3)
#[pyclass(frozen, extends = Target, module = "deltille")]
pub struct Board;

#[pymethods]
impl Board {
    #[new]
    #[pyo3(signature = (rows, cols, *, edge_mm = None, family = None, tags = true, tag_spacing = None,
        tag_border = None, first_id = 0, boards = 1, board_id = 0, inverted = false, paper = None,
        orientation = "auto", margin_mm = None, poster = false, packed = false, two_sided_mm = None,
        tag_ids = false, guide_page = false, logo = None, logo_height_mm = None, name = "board"))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        rows: i64,
        cols: i64,
        edge_mm: Option<f64>,
        family: Option<FamilyChoice>,
        tags: bool,
        tag_spacing: Option<i64>,
        tag_border: Option<f64>,
        first_id: i64,
        boards: i64,
        board_id: i64,
        inverted: bool,
        paper: Option<&str>,
        orientation: &str,
        margin_mm: Option<f64>,
        poster: bool,
        packed: bool,
        two_sided_mm: Option<f64>,
        tag_ids: bool,
        guide_page: bool,
        logo: Option<PathBuf>,
        logo_height_mm: Option<f64>,
        name: &str,
    ) -> PyResult<PyClassInitializer<Self>> {
        let paper = self::paper(paper, orientation, margin_mm, SolidSheets::default())?;
        let paper = PaperSpec { poster, packed, tag_ids, guide_page, ..paper };
        let paper = with_logo(paper, logo, logo_height_mm)?;
        let spacing = spacing_of(tag_spacing)?;
        let first_id = whole("first_id", first_id, errors::target)?;
        let of_tags =
            || Tags { family, tags_in: TagsIn::Black, spacing, border_bits: tag_border, first_id };
        let wanted = Wanted {
            grid: GridKind::Deltille,
            size: size_of(rows, cols)?,
            edge_mm,
            tags: tags.then(of_tags),
            boards: whole("boards", boards, errors::target)?,
            board_id: whole("board_id", board_id, errors::target)?,
            inverted,
            two_sided_mm,
            name: name.to_owned(),
            paper,
        };
        Ok(PyClassInitializer::from(wanted.make()?).add_subclass(Self))
    }
}

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
/// tag_spacing, tag_border, first_id, boards, board_id, inverted, paper, orientation, margin_mm, poster, packed, \
/// two_sided_mm, tag_ids, guide_page, logo, logo_height_mm, name
///     As of :class:`Board`.
#[pyclass(frozen, extends = Target, module = "deltille")]
pub struct Checkerboard;

#[pymethods]
impl Checkerboard {
    #[new]
    #[pyo3(signature = (rows, cols, *, edge_mm = None, family = None, tags_in = "black", tag_spacing = None,
        tag_border = None, first_id = 0, boards = 1, board_id = 0, inverted = false, paper = None,
        orientation = "auto", margin_mm = None, poster = false, packed = false, two_sided_mm = None,
        tag_ids = false, guide_page = false, logo = None, logo_height_mm = None, name = "checkerboard"))]
    #[expect(clippy::too_many_arguments, reason = "keywords")]
    fn new(
        rows: i64,
        cols: i64,
        edge_mm: Option<f64>,
        family: Option<FamilyChoice>,
        tags_in: &str,
        tag_spacing: Option<i64>,
        tag_border: Option<f64>,
        first_id: i64,
        boards: i64,
        board_id: i64,
        inverted: bool,
        paper: Option<&str>,
        orientation: &str,
        margin_mm: Option<f64>,
        poster: bool,
        packed: bool,
        two_sided_mm: Option<f64>,
        tag_ids: bool,
        guide_page: bool,
        logo: Option<PathBuf>,
        logo_height_mm: Option<f64>,
        name: &str,
    ) -> PyResult<PyClassInitializer<Self>> {
        let tags_in = match tags_in {
            "black" => TagsIn::Black,
            "white" => TagsIn::White,
            _ => return Err(raised::TargetError::new_err("tags_in: give black or white")),
        };
        let paper = self::paper(paper, orientation, margin_mm, SolidSheets::default())?;
        let paper = PaperSpec { poster, packed, tag_ids, guide_page, ..paper };
        let paper = with_logo(paper, logo, logo_height_mm)?;
        let spacing = spacing_of(tag_spacing)?;
        let first_id = whole("first_id", first_id, errors::target)?;
        let of_tags = |family| Tags {
            family: Some(family),
            tags_in,
            spacing,
            border_bits: tag_border,
            first_id,
        };
        let wanted = Wanted {
            grid: GridKind::Checker,
            size: size_of(rows, cols)?,
            edge_mm,
            tags: family.map(of_tags),
            boards: whole("boards", boards, errors::target)?,
            board_id: whole("board_id", board_id, errors::target)?,
            inverted,
            two_sided_mm,
            name: name.to_owned(),
            paper,
        };
        Ok(PyClassInitializer::from(wanted.make()?).add_subclass(Self))
    }
}
