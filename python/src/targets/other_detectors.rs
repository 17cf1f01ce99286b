//! Targets defined by other programs: ChArUco boards, AprilGrids, circle grids.

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

/// Checks columns and rows, in OpenCV's order.
fn size_of(name: &str, (columns, rows): (i64, i64)) -> PyResult<[u32; 2]> {
    Ok([whole(name, columns, errors::target)?, whole(name, rows, errors::target)?])
}

flat! {
    /// A ChArUco board, with OpenCV's ids and frame: the origin is the upper left corner of the board, y points down and z
    /// into the board.
    ///
    /// Parameters
    /// ----------
    /// squares : tuple of int
    ///     Squares per row, and rows of squares, 3 to 200: OpenCV's ``size``.
    /// square_mm : float, optional
    ///     Edge of a square, mm: OpenCV's ``squareLength``.
    /// marker_mm : float, optional
    ///     Side of a marker with its black border, mm: ``markerLength``; defaults to three quarters of the square.
    /// dictionary : str, optional
    ///     OpenCV's dictionary, such as ``"5x5_100"``, ``"DICT_6X6_250"`` or ``"apriltag_36h11"``.
    /// first_id : int, optional
    ///     Id of the first marker; the others follow.
    /// legacy : bool, optional
    ///     Use the pattern of OpenCV before 4.6.
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
        // Unknown names are rejected later, with the other settings.
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

/// Returns the full name of a dictionary.
fn named(text: &str) -> String {
    dictionary(text).map_or(text, |(name, _)| name).to_owned()
}

flat! {
    /// An AprilGrid, with Kalibr's ids and frame; ``save(folder, ["pdf", "kalibr"])`` also writes Kalibr's target file.
    ///
    /// Parameters
    /// ----------
    /// tags : tuple of int
    ///     Tags per row, and rows of tags, 2 to 100: Kalibr's ``tagCols`` and ``tagRows``.
    /// tag_mm : float, optional
    ///     Side of a tag with its black border, mm: Kalibr's ``tagSize``.
    /// gap : float, optional
    ///     Width of the gaps between tags, as a fraction of the tag, 0.1 to 0.9: Kalibr's ``tagSpacing``.
    /// family : Family, str or path-like, optional
    ///     Family of the tags; Kalibr supports only aprilTag36h11.
    /// first_id : int, optional
    ///     Id of the first tag, at the lower left; the others follow row by row.
    /// tag_border : float, optional
    ///     Width of the black border of a tag, in cells, 1 to 10: Kalibr supports only 2, most other programs only 1.
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
    ///     Circles per row, and rows, 2 to 200: OpenCV's ``patternSize``.
    /// asymmetric : bool, optional
    ///     Shift every second row: ``CALIB_CB_ASYMMETRIC_GRID``.
    /// spacing_mm : float, optional
    ///     Distance between rows, mm. Circles of a row have the same distance; in an asymmetric grid, twice that.
    /// diameter_mm : float, optional
    ///     Diameter of a circle, mm; defaults to half of the spacing.
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
