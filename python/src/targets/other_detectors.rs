//! Targets that other programs define: ChArUco boards, AprilGrids, grids of circles.

use std::path::PathBuf;
use std::sync::Arc;

use deltille::family::{Family, dictionary};
use deltille::layout::PaperSpec;
use deltille::targets::{AprilGridSpec, CharucoSpec, CirclesSpec, TargetSpec};
use pyo3::prelude::*;

use super::families::FamilyChoice;
use super::paper::flat;
use super::target::Target;
use crate::boundary::arrays::whole;
use crate::boundary::errors;

/// Columns and rows, as OpenCV has them.
fn size_of(name: &str, (columns, rows): (i64, i64)) -> PyResult<[u32; 2]> {
    Ok([whole(name, columns, errors::target)?, whole(name, rows, errors::target)?])
}

flat! {
    /// A ChArUco board, with OpenCV's ids and frame: the origin is the upper left corner of the board, y runs down and
    /// z into it.
    ///
    /// Parameters
    /// ----------
    /// squares : tuple of int
    ///     Squares in each row, and rows of squares, 3 to 200: OpenCV's ``size``.
    /// square_mm : float, optional
    ///     Edge of a square, mm: OpenCV's ``squareLength``.
    /// marker_mm : float, optional
    ///     Side of a marker with its black border, mm, ``markerLength``; three quarters of the square if left out.
    /// dictionary : str, optional
    ///     OpenCV's, such as ``"5x5_100"``, ``"DICT_6X6_250"`` or ``"apriltag_36h11"``.
    /// first_id : int, optional
    ///     Id of the first marker; the others follow.
    /// legacy : bool, optional
    ///     Whether the pattern is that of OpenCV before 4.6.
    /// board_id : int, optional
    ///     Id of the board.
    Charuco, "charuco",
    (squares: (i64, i64)),
    (
        square_mm: f64 = 30.0,
        marker_mm: Option<f64> = None,
        dictionary: &str = "5x5_100",
        first_id: i64 = 0,
        legacy: bool = false,
        board_id: i64 = 0,
    ),
    |on| {
        // A name that is unknown is refused with the other numbers.
        let dictionary = named(dictionary);
        let usual = CharucoSpec::new(size_of("squares", squares)?, square_mm, &dictionary);
        let spec = CharucoSpec {
            marker_mm: marker_mm.unwrap_or(usual.marker_mm),
            first_id: whole("first_id", first_id, errors::target)?,
            board_id: whole("board_id", board_id, errors::target)?,
            legacy,
            ..usual
        };
        let family = Family::shipped(&spec.dictionary).ok();
        (TargetSpec::Charuco(spec), family.map(Arc::new))
    }
}

/// The whole name of a dictionary.
fn named(text: &str) -> String {
    dictionary(text).map_or(text, |(name, _)| name).to_owned()
}

flat! {
    /// An AprilGrid, with Kalibr's numbers and frame; ``save(folder, ["pdf", "kalibr"])`` writes its target file, too.
    ///
    /// Parameters
    /// ----------
    /// tags : tuple of int
    ///     Tags in each row, and rows of tags, 2 to 100: Kalibr's ``tagCols`` and ``tagRows``.
    /// tag_mm : float, optional
    ///     Side of a tag with its black border, mm, Kalibr's ``tagSize``.
    /// gap : float, optional
    ///     Width of the gaps between tags, in tags, 0.1 to 0.9, Kalibr's ``tagSpacing``.
    /// family : Family, str or path-like, optional
    ///     Family of the tags; Kalibr reads aprilTag36h11 only.
    /// first_id : int, optional
    ///     Id of the first tag, at the lower left; the others follow row by row.
    /// tag_border : float, optional
    ///     Black border of a tag, in widths of a bit, 1 to 10: Kalibr reads 2 only, most others 1.
    /// board_id : int, optional
    ///     Id of the board.
    AprilGrid, "aprilgrid",
    (tags: (i64, i64)),
    (
        tag_mm: f64 = 25.0,
        gap: f64 = 0.3,
        family: Option<FamilyChoice> = None,
        first_id: i64 = 0,
        tag_border: f64 = 2.0,
        board_id: i64 = 0,
    ),
    |on| {
        let usual = AprilGridSpec::new(size_of("tags", tags)?, tag_mm);
        let usual_family = || FamilyChoice::Name(PathBuf::from(&usual.family));
        let (name, family) = family.unwrap_or_else(usual_family).resolve()?;
        let spec = AprilGridSpec {
            gap,
            family: name,
            first_id: whole("first_id", first_id, errors::target)?,
            border_bits: tag_border,
            board_id: whole("board_id", board_id, errors::target)?,
            ..usual
        };
        (TargetSpec::AprilGrid(spec), Some(family))
    }
}

flat! {
    /// A grid of circles, as OpenCV's ``findCirclesGrid`` reads it.
    ///
    /// Parameters
    /// ----------
    /// circles : tuple of int
    ///     Circles in each row, and rows, 2 to 200: OpenCV's ``patternSize``.
    /// asymmetric : bool, optional
    ///     Whether every second row is shifted: ``CALIB_CB_ASYMMETRIC_GRID``.
    /// spacing_mm : float, optional
    ///     Distance from row to row, mm; along a row too, in an asymmetric grid half of it.
    /// diameter_mm : float, optional
    ///     Diameter of a circle, mm; half of the spacing if left out.
    /// board_id : int, optional
    ///     Id of the board.
    Circles, "circles",
    (circles: (i64, i64)),
    (
        asymmetric: bool = false,
        spacing_mm: f64 = 20.0,
        diameter_mm: Option<f64> = None,
        board_id: i64 = 0,
    ),
    |on| {
        let usual = CirclesSpec::new(size_of("circles", circles)?, spacing_mm);
        let spec = CirclesSpec {
            diameter_mm: diameter_mm.unwrap_or(usual.diameter_mm),
            asymmetric,
            board_id: whole("board_id", board_id, errors::target)?,
            ..usual
        };
        (TargetSpec::Circles(spec), None)
    }
}
