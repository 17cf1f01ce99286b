//! Plain and asymmetric grids of circles, as defined and numbered by OpenCV's `findCirclesGrid`.
//!
//! ```text
//!    x →            plain: circle j of row i is at (j, i)     asymmetric: at (2 j + i mod 2, i)
//!  y  ●  ●  ●           spacings                              ●     ●     ●
//!  ↓  ●  ●  ●                                                    ●     ●     ●
//!     ●  ●  ●                                                 ●     ●     ●
//! ```
//!
//! The target frame is that of OpenCV's object points: its origin is the first circle, at the upper left, x runs right,
//! y down, z into the board.

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use crate::lattice::GridKind;
use crate::quantity;
use crate::setting::Setting::{BoardBoardId, CirclesCircles, CirclesDiameterMm, CirclesSpacingMm};
use crate::targets::length::format_mm;
use crate::targets::{Corner, Outline, Panel, PanelPose, TagsIn, TargetError};

/// Range of circles along a side.
const SIDES: std::ops::RangeInclusive<u32> = 2..=200;

/// Range of the spacing, mm.
const SPACING_MM: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Range of a circle's diameter, in spacings: OpenCV separates circles by the white between them.
const DIAMETER: std::ops::RangeInclusive<f64> = 0.2..=0.8;

/// A grid of circles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CirclesSpec {
    /// Number of circles in each row and number of rows, 2 to 200; OpenCV's `patternSize`.
    pub circles: [u32; 2],
    /// Distance between rows, mm. It is also the distance within a row of a plain grid; in an asymmetric grid, that
    /// is twice as large.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub spacing_mm: f64,
    /// Diameter of the circles, mm.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub diameter_mm: f64,
    /// Whether every second row is shifted by half of the distance within a row.
    #[serde(default)]
    pub asymmetric: bool,
    /// Id of the board.
    #[serde(default)]
    pub board_id: u32,
}

impl CirclesSpec {
    /// Creates a plain grid with circles of half a spacing in diameter.
    pub fn new(circles: [u32; 2], spacing_mm: f64) -> Self {
        let diameter_mm = 0.5 * spacing_mm;
        Self { circles, spacing_mm, diameter_mm, asymmetric: false, board_id: 0 }
    }

    fn check(&self) -> Result<(), TargetError> {
        if let Some(side) = self.circles.iter().find(|side| !SIDES.contains(side)) {
            let problem = format!("{side} is not between {} and {}", SIDES.start(), SIDES.end());
            return Err(TargetError::invalid(CirclesCircles, problem));
        }
        if !SPACING_MM.contains(&self.spacing_mm) {
            let spacing = format_mm(self.spacing_mm);
            let problem = format!("{spacing} is not between 1 mm and 1000 mm");
            return Err(TargetError::invalid(CirclesSpacingMm, problem));
        }
        if !DIAMETER.contains(&(self.diameter_mm / self.spacing_mm)) {
            let [least, most] = [DIAMETER.start(), DIAMETER.end()]
                .map(|part| format_mm((part * self.spacing_mm * 1e3).round() / 1e3));
            let diameter = format_mm(self.diameter_mm);
            let problem = format!("{diameter} is not between {least} and {most} for this spacing");
            return Err(TargetError::invalid(CirclesDiameterMm, problem));
        }
        if self.board_id == u32::MAX {
            let problem =
                format!("{} is too large: it leaves no id for a following board", self.board_id);
            return Err(TargetError::invalid(BoardBoardId, problem));
        }
        Ok(())
    }

    /// Returns the panel of a checked spec: its corners are the centres of the circles.
    #[doc(hidden)]
    pub fn panel(&self) -> Panel {
        let [columns, rows] = self.circles.map(|side| side as i32);
        let (kind, edge_mm) = (GridKind::Checker, self.spacing_mm);
        let downwards = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let up = f64::from(rows - 1) * edge_mm;
        let pose = PanelPose::new(downwards, DVec3::new(0.0, up, 0.0));
        let col = |row: i32, j: i32| match self.asymmetric {
            true => 2 * j + (rows - 1 - row) % 2,
            false => j,
        };
        let corner = |row: i32, j: i32| {
            let panel_mm = kind.position(row.into(), col(row, j).into()) * edge_mm;
            let target_mm = pose.target_from_panel(panel_mm);
            let id = ((rows - 1 - row) * columns + j) as u32;
            Corner { id, row, col: col(row, j), panel_mm, target_mm, measured: None }
        };
        Panel {
            id: self.board_id,
            kind,
            edge_mm,
            border_bits: None,
            tags_in: TagsIn::Black,
            tag_margin_bits: None,
            gap_edges: None,
            discs_mm: Some(self.diameter_mm),
            hole_mm: None,
            rim_mm: None,
            inverted: false,
            outline: Outline::Touching,
            matrix: [if self.asymmetric { 2 * columns } else { columns }, rows].map(|n| n as u32),
            pose,
            corners: (0..rows)
                .flat_map(|row| (0..columns).map(move |j| (row, j)))
                .map(|(row, j)| corner(row, j))
                .collect(),
            tags: Vec::new(),
        }
    }
}

/// Returns the panels of a spec.
pub(in crate::targets) fn untied_panels(spec: &CirclesSpec) -> Result<Vec<Panel>, TargetError> {
    spec.check()?;
    Ok(vec![spec.panel()])
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::targets::Target;

    proptest! {
        #[test]
        fn circles_match_opencv(
            columns in 2u32..9, rows in 2u32..12, asymmetric: bool, spacing_mm in 5.0..20.0f64,
        ) {
            let spec = CirclesSpec { asymmetric, ..CirclesSpec::new([columns, rows], spacing_mm) };
            let target = Target::new("circles", spec).unwrap();
            prop_assert_eq!(target.panels[0].corners.len() as u32, columns * rows);
            for corner in &target.panels[0].corners {
                let (i, j) = (corner.id / columns, corner.id % columns);
                let x = if asymmetric { 2 * j + i % 2 } else { j };
                let at = DVec3::new(x.into(), i.into(), 0.0) * spacing_mm;
                prop_assert!(corner.target_mm.abs_diff_eq(at, 1e-9));
            }
            prop_assert_eq!(Target::from_json(&target.to_json()).unwrap(), target);
        }
    }
}
