//! ChArUco boards: checkerboards with a marker in every white square, as defined and numbered by OpenCV.
//!
//! ```text
//!       x →
//!     ┌──────────────►     The target frame is that of OpenCV's object points: its origin is the upper left
//!   y │ ■ 0 ■ 1 ■          corner of the board, x runs right, y down, z into the board. Markers are numbered
//!   ↓ │ 2 ■ 3 ■ 4          row by row from the upper left, like the corners, which lie between four squares.
//!     ▼ ■ 5 ■ 6 ■          The panel frame is that of every checkerboard: y up, z towards the viewer.
//! ```
//!
//! Since OpenCV 4.6 the upper left square is black. Before, it was the lower left one. With an even number of rows
//! that is a different pattern, OpenCV's `setLegacyPattern(true)`.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::capacity::{TagSettings, check_ids};
use crate::family::{Family, dictionary, dictionary_names};
use crate::lattice::{Dimension, GridKind, TagCells, Vertex};
use crate::quantity;
use crate::setting::Setting::{
    BoardBoardId, CharucoDictionary, CharucoMarkerMm, CharucoSquareMm, CharucoSquares,
};
use crate::targets::length::format_mm;
use crate::targets::{
    Corner, FamilyRef, Outline, Panel, PanelPose, TagPlacement, TagsIn, TargetError,
};

/// Range of squares along a side: three squares give a row of two corners.
const SIDES: std::ops::RangeInclusive<u32> = 3..=200;

/// Range of a square's edge, mm.
const SQUARE_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Range of a marker's side, in squares. OpenCV finds markers reliably up to the maximum; markers
/// below the minimum waste the square.
const MARKER_SQUARES: std::ops::RangeInclusive<f64> = 0.3..=0.9;

/// Border of a marker, bit-widths: OpenCV's default, which everybody uses.
const BORDER_BITS: f64 = 1.0;

/// A ChArUco board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CharucoSpec {
    /// Number of squares in each row and number of rows of squares, 3 to 200.
    pub squares: [u32; 2],
    /// Length of a square's edge, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub square_mm: f64,
    /// Length of a marker's side with its black border, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub marker_mm: f64,
    /// Name of the OpenCV dictionary, for example `DICT_5X5_100`.
    pub dictionary: String,
    /// Id of the first marker; the others follow.
    #[serde(default)]
    pub first_id: u32,
    /// Id of the board.
    #[serde(default)]
    pub board_id: u32,
    /// Whether the pattern is that of OpenCV before version 4.6.
    #[serde(default)]
    pub legacy: bool,
}

impl CharucoSpec {
    /// Creates a board of the current pattern, with markers of 0.75 squares.
    pub fn new(squares: [u32; 2], square_mm: f64, dictionary: &str) -> Self {
        let (marker_mm, dictionary) = (0.75 * square_mm, dictionary.to_owned());
        Self { squares, square_mm, marker_mm, dictionary, first_id: 0, board_id: 0, legacy: false }
    }

    /// Returns the number of markers, one per white square.
    pub fn markers(&self) -> u32 {
        let [columns, rows] = self.squares;
        let all = columns * rows;
        // With an odd number of squares, both patterns have black squares at the corners.
        all / 2
    }

    /// Checks each number on its own and returns the dimension of the markers.
    ///
    /// # Errors
    /// Returns an error if a setting is invalid.
    #[doc(hidden)]
    pub fn check(&self) -> Result<Dimension, TargetError> {
        if let Some(side) = self.squares.iter().find(|side| !SIDES.contains(side)) {
            let problem = format!("{side} is not between {} and {}", SIDES.start(), SIDES.end());
            return Err(TargetError::invalid(CharucoSquares, problem));
        }
        if !SQUARE_MM.contains(&self.square_mm) {
            let problem = format!("{} is not between 1 mm and 1000 mm", format_mm(self.square_mm));
            return Err(TargetError::invalid(CharucoSquareMm, problem));
        }
        if !MARKER_SQUARES.contains(&(self.marker_mm / self.square_mm)) {
            let [least, most] = [MARKER_SQUARES.start(), MARKER_SQUARES.end()]
                .map(|part| format_mm((part * self.square_mm * 1e3).round() / 1e3));
            let marker = format_mm(self.marker_mm);
            let problem =
                format!("{marker} is not between {least} and {most} for squares of this size");
            return Err(TargetError::invalid(CharucoMarkerMm, problem));
        }
        if self.board_id == u32::MAX {
            let problem =
                format!("{} is too large: it leaves no id for a following board", self.board_id);
            return Err(TargetError::invalid(BoardBoardId, problem));
        }
        let Some((_, dimension)) = dictionary(&self.dictionary) else {
            let names: Vec<&str> = dictionary_names().collect();
            let problem = format!(
                "unknown OpenCV dictionary `{}` (known: {})",
                self.dictionary,
                names.join(", ")
            );
            return Err(TargetError::invalid(CharucoDictionary, problem));
        };
        Ok(dimension)
    }

    /// Returns the first column of the corners in the lattice. Squares whose lower left vertex has an even sum of row
    /// and column are black there.
    fn first_col(&self) -> i32 {
        let even_rows = self.squares[1].is_multiple_of(2);
        i32::from(even_rows && !self.legacy)
    }

    /// Returns the panel of a checked spec with markers of this dimension.
    #[doc(hidden)]
    pub fn panel(&self, dimension: Dimension) -> Panel {
        let [columns, rows] = self.squares.map(|side| side as i32);
        let (first, kind, edge_mm) = (self.first_col(), GridKind::Checker, self.square_mm);
        let bit_mm = self.marker_mm / TagCells::of(kind, dimension).width(BORDER_BITS);
        // From the lower left corner in the panel frame to the upper left corner of the board.
        let translation =
            DVec3::new(f64::from(1 - first) * edge_mm, f64::from(rows - 1) * edge_mm, 0.0);
        let downwards = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let pose = PanelPose::new(downwards, translation);
        let corner = |row: i32, col: i32| {
            let panel_mm = kind.position(row.into(), (first + col).into()) * edge_mm;
            Corner {
                id: ((rows - 2 - row) * (columns - 1) + col) as u32,
                row,
                col: first + col,
                panel_mm,
                target_mm: pose.target_from_panel(panel_mm),
                measured: None,
            }
        };
        let in_order = (-1..rows - 1)
            .rev()
            .flat_map(|row| (first - 1..first - 1 + columns).map(move |col| Vertex::new(row, col)));
        let white = in_order.filter(|&v| !kind.tag_tile(v).is_dark());
        let mut tags: Vec<TagPlacement> = white
            .zip(self.first_id..)
            .map(|(Vertex { row, col }, id)| TagPlacement { id, row, col })
            .collect();
        tags.sort_by_key(|tag| (tag.row, tag.col));
        Panel {
            id: self.board_id,
            kind,
            edge_mm,
            border_bits: Some(BORDER_BITS),
            tags_in: TagsIn::White,
            tag_margin_bits: Some((edge_mm - self.marker_mm) / 2.0 / bit_mm),
            gap_edges: None,
            discs_mm: None,
            hole_mm: None,
            rim_mm: None,
            inverted: false,
            outline: Outline::Touching,
            matrix: [(columns - 1 + first) as u32, (rows - 1) as u32],
            pose,
            corners: (0..rows - 1)
                .flat_map(|row| (0..columns - 1).map(move |col| (row, col)))
                .map(|(row, col)| corner(row, col))
                .collect(),
            tags,
        }
    }
}

/// Returns the panels of a spec, regardless of the size of its dictionary.
pub(in crate::targets) fn untied_panels(spec: &CharucoSpec) -> Result<Vec<Panel>, TargetError> {
    Ok(vec![spec.panel(spec.check()?)])
}

/// Returns the panel of a board and its dictionary.
pub(in crate::targets) fn tagged(
    spec: &CharucoSpec,
    family: &Family,
) -> Result<(Vec<Panel>, FamilyRef), TargetError> {
    let panels = untied_panels(spec)?;
    if dictionary(&spec.dictionary).is_none_or(|(name, _)| name != family.name()) {
        let given = format!("but {} was given", family.name());
        return Err(TargetError::Family { wanted: spec.dictionary.clone(), given });
    }
    let family =
        check_ids(TagSettings::TAGS, spec.first_id, spec.markers().into(), family, || {
            format!("use a larger {CharucoDictionary}, or fewer {CharucoSquares}")
        })?;
    Ok((panels, family))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::targets::Target;

    proptest! {
        /// OpenCV: corner i is at ((i mod (w − 1) + 1) s, (i div (w − 1) + 1) s). The square in column x, row y has a
        /// marker if x + y is odd; in the legacy pattern with an even number of rows, if x + y is even.
        #[test]
        fn corners_and_markers_match_opencv(
            w in 3u32..12, h in 3u32..12, square_mm in 10.0..50.0f64, legacy: bool,
        ) {
            let spec = CharucoSpec { legacy, ..CharucoSpec::new([w, h], square_mm, "DICT_5X5_100") };
            let panel = spec.panel(spec.check().unwrap());
            prop_assert_eq!(panel.corners.len() as u32, (w - 1) * (h - 1));
            for corner in &panel.corners {
                let (x, y) = (corner.id % (w - 1) + 1, corner.id / (w - 1) + 1);
                let at = DVec3::new(x.into(), y.into(), 0.0) * square_mm;
                prop_assert!(corner.target_mm.abs_diff_eq(at, 1e-9));
            }
            let odd = u32::from(!(legacy && h.is_multiple_of(2)));
            let squares = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
            let marked: Vec<(u32, u32)> = squares.filter(|(x, y)| (x + y) % 2 == odd).collect();
            let mut tags = panel.tags.clone();
            tags.sort_by_key(|tag| tag.id);
            prop_assert_eq!(tags.len(), marked.len());
            prop_assert_eq!(tags.len() as u32, spec.markers());
            for (tag, (x, y)) in tags.iter().zip(marked) {
                let middle = DVec3::new(f64::from(x) + 0.5, f64::from(y) + 0.5, 0.0) * square_mm;
                prop_assert!(panel.tag_centre_mm(tag).abs_diff_eq(middle, 1e-9));
            }
        }

        #[test]
        fn boards_survive_a_target_file(w in 3u32..12, h in 3u32..12, legacy: bool) {
            let spec = CharucoSpec { legacy, ..CharucoSpec::new([w, h], 20.0, "4x4_1000") };
            let target = Target::new("board", spec).unwrap();
            prop_assert_eq!(Target::from_json(&target.to_json()).unwrap(), target);
        }
    }

    #[test]
    fn invalid_settings_are_rejected() {
        let good = CharucoSpec::new([8, 6], 30.0, "5x5_100");
        let family = Family::shipped("5x5_100").unwrap();
        let message = |spec: CharucoSpec| {
            Target::build("board", &spec.into(), Some(&family)).unwrap_err().to_string()
        };
        let cases = [
            (CharucoSpec { squares: [2, 6], ..good.clone() }, "`CharucoSpec::squares`: 2 is not"),
            (CharucoSpec { square_mm: f64::NAN, ..good.clone() }, "`CharucoSpec::square_mm`"),
            (CharucoSpec { marker_mm: 29.0, ..good.clone() }, "`CharucoSpec::marker_mm`: 29 mm"),
            (
                CharucoSpec { dictionary: "7".to_owned(), ..good.clone() },
                "`CharucoSpec::dictionary`",
            ),
            (CharucoSpec { first_id: 77, ..good.clone() }, "`TagSpec::first_id`: tags 77 to 100"),
            (CharucoSpec { squares: [90, 90], ..good }, "`TagSpec::first_id`"),
        ];
        for (spec, start) in cases {
            let message = message(spec);
            assert!(message.starts_with(start), "{message}");
        }
    }
}
