//! AprilGrids as defined and numbered by Kalibr: tags in rows, with small black squares between their corners.
//!
//! ```text
//!     ▪   ▪   ▪      The lattice is that of a checkerboard in which every second row and column is a gap, so
//!       2   3        that each corner of a tag is a corner of four tiles: its own, a small square, and two white
//!     ▪   ▪   ▪      ones. Tags and corners are numbered row by row from the lower left; the frame is that of
//!       0   1        Kalibr: its origin is the lower left corner of tag 0, x runs right, y up.
//!     ▪   ▪   ▪
//! ```

use serde::{Deserialize, Serialize};

use super::capacity::{TagSettings, check_ids};
use super::tag_spec::BORDER_BITS;
use crate::family::Family;
use crate::lattice::{GridKind, Vertex};
use crate::quantity;
use crate::setting::Setting::{
    AprilGridGap, AprilGridTagMm, AprilGridTags, BoardBoardId, TagBorderBits, TagFamily,
};
use crate::targets::length::format_mm;
use crate::targets::{
    Corner, FamilyRef, Outline, Panel, PanelPose, TagPlacement, TagsIn, TargetError,
};

/// Range of the number of tags along a side. With fewer than four tags, random texture could pass for the grid.
const SIDES: std::ops::RangeInclusive<u32> = 2..=100;

/// Range of a tag's side, mm.
const TAG_MM: std::ops::RangeInclusive<f64> = 2.0..=1000.0;

/// Range of the gap between tags, in tags. A smaller gap leaves no corners to locate; a larger one makes the small
/// squares as large as the tags.
const GAP: std::ops::RangeInclusive<f64> = 0.1..=0.9;

/// An AprilGrid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AprilGridSpec {
    /// Number of tags in each row and number of rows, 2 to 100; Kalibr's `tagCols` and `tagRows`.
    pub tags: [u32; 2],
    /// Length of a tag's side with its black border, mm; Kalibr's `tagSize`.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub tag_mm: f64,
    /// Width of the gaps between tags, in tags; Kalibr's `tagSpacing`.
    #[serde(deserialize_with = "quantity::length_mm::de")]
    pub gap: f64,
    /// Family name, or path of a family file. Kalibr only reads aprilTag36h11.
    pub family: String,
    /// Id of the first tag; the others follow.
    #[serde(default)]
    pub first_id: u32,
    /// Width of a tag's border, bit-widths. Kalibr only reads a border of 2.
    #[serde(deserialize_with = "quantity::border_bits::de")]
    pub border_bits: f64,
    /// Id of the board.
    #[serde(default)]
    pub board_id: u32,
}

impl AprilGridSpec {
    /// Creates a grid with Kalibr's defaults: aprilTag36h11 with a border of 2 bits, and gaps of 0.3 tags.
    pub fn new(tags: [u32; 2], tag_mm: f64) -> Self {
        let family = "aprilTag36h11".to_owned();
        Self { tags, tag_mm, gap: 0.3, family, first_id: 0, border_bits: 2.0, board_id: 0 }
    }

    /// Returns the number of tags.
    pub fn count(&self) -> u32 {
        self.tags[0] * self.tags[1]
    }

    /// Returns the target file of Kalibr; `None` if Kalibr cannot read the grid. The file does not contain the family
    /// and the border, which must be those of [`Self::new`].
    pub fn to_kalibr_yaml(&self) -> Option<String> {
        let Self { tags: [columns, rows], tag_mm, gap, first_id, .. } = self;
        let known = Self::new(self.tags, self.tag_mm);
        if (&self.family, self.border_bits) != (&known.family, known.border_bits) {
            return None;
        }
        let lines = [
            "target_type: 'aprilgrid'".to_owned(),
            format!("tagCols: {columns}"),
            format!("tagRows: {rows}"),
            format!("tagSize: {:?}  # m", tag_mm / 1000.0),
            format!("tagSpacing: {gap:?}  # gap between tags / tagSize"),
            format!("codeOffset: {first_id}"),
        ];
        Some(lines.map(|line| line + "\n").concat())
    }

    pub(in crate::targets) fn check(&self) -> Result<(), TargetError> {
        if let Some(side) = self.tags.iter().find(|side| !SIDES.contains(side)) {
            let problem = format!("{side} is not between {} and {}", SIDES.start(), SIDES.end());
            return Err(TargetError::invalid(AprilGridTags, problem));
        }
        if !TAG_MM.contains(&self.tag_mm) {
            let problem = format!("{} is not between 2 mm and 1000 mm", format_mm(self.tag_mm));
            return Err(TargetError::invalid(AprilGridTagMm, problem));
        }
        if !GAP.contains(&self.gap) {
            let problem = format!("{} is not between {} and {}", self.gap, GAP.start(), GAP.end());
            return Err(TargetError::invalid(AprilGridGap, problem));
        }
        if !(1.0..=*BORDER_BITS.end()).contains(&self.border_bits) {
            let problem = format!("{} is not between 1 and 10 bit-widths", self.border_bits);
            return Err(TargetError::invalid(TagBorderBits, problem));
        }
        if self.board_id == u32::MAX {
            let problem =
                format!("{} is too large: it leaves no id for a following board", self.board_id);
            return Err(TargetError::invalid(BoardBoardId, problem));
        }
        Ok(())
    }

    /// Returns the panel of a checked spec.
    #[doc(hidden)]
    pub fn panel(&self) -> Panel {
        let [columns, rows] = self.tags;
        let mut panel = Panel {
            id: self.board_id,
            kind: GridKind::Checker,
            edge_mm: self.tag_mm,
            border_bits: Some(self.border_bits),
            tags_in: TagsIn::Black,
            tag_margin_bits: None,
            gap_edges: Some(self.gap),
            discs_mm: None,
            hole_mm: None,
            rim_mm: None,
            inverted: false,
            outline: Outline::Touching,
            matrix: [2 * columns, 2 * rows],
            pose: PanelPose::IDENTITY,
            corners: Vec::new(),
            tags: (0..rows)
                .flat_map(|row| (0..columns).map(move |col| [2 * row as i32, 2 * col as i32]))
                .zip(self.first_id..)
                .map(|([row, col], id)| TagPlacement { id, row, col })
                .collect(),
        };
        let places =
            (0..2 * rows as i32).flat_map(|row| (0..2 * columns as i32).map(move |col| (row, col)));
        panel.corners = places
            .zip(0..)
            .map(|((row, col), id)| {
                let panel_mm = panel.lattice_mm(Vertex::new(row, col));
                let target_mm = panel_mm.extend(0.0);
                Corner { id, row, col, panel_mm, target_mm, measured: None }
            })
            .collect();
        panel
    }
}

/// Returns the panels of a spec, regardless of the size of its family.
pub(in crate::targets) fn untied_panels(spec: &AprilGridSpec) -> Result<Vec<Panel>, TargetError> {
    spec.check()?;
    Ok(vec![spec.panel()])
}

/// Returns the panel of a grid and its family.
pub(in crate::targets) fn tagged(
    spec: &AprilGridSpec,
    family: &Family,
) -> Result<(Vec<Panel>, FamilyRef), TargetError> {
    let panels = untied_panels(spec)?;
    if family.kind() != GridKind::Checker {
        let problem = format!("{} has triangular tags, but square ones are needed", family.name());
        return Err(TargetError::invalid(TagFamily, problem));
    }
    let family = check_ids(TagSettings::TAGS, spec.first_id, spec.count().into(), family, || {
        format!("use fewer {AprilGridTags}")
    })?;
    Ok((panels, family))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::targets::Target;

    proptest! {
        /// Kalibr: corner c of row r is at (c div 2 · (1 + spacing) + c mod 2) · size along x; the same holds for r
        /// along y.
        #[test]
        fn corners_match_kalibr(
            columns in 2u32..8, rows in 2u32..8, tag_mm in 10.0..99.0f64, gap in 0.1..0.9f64,
        ) {
            let spec = AprilGridSpec { gap, ..AprilGridSpec::new([columns, rows], tag_mm) };
            let target = Target::build(
                "grid", &spec.clone().into(), Family::shipped("t36h11").ok().as_ref()).unwrap();
            let panel = &target.panels[0];
            prop_assert_eq!(panel.corners.len() as u32, 4 * columns * rows);
            let place = |i: u32| (f64::from(i / 2) * (1.0 + gap) + f64::from(i % 2)) * tag_mm;
            for corner in &panel.corners {
                let (row, col) = (corner.id / (2 * columns), corner.id % (2 * columns));
                let at = DVec3::new(place(col), place(row), 0.0);
                prop_assert!(corner.target_mm.abs_diff_eq(at, 1e-9));
            }
            for tag in &panel.tags {
                let (row, col) = (tag.id / columns, tag.id % columns);
                let middle = |i: u32| (f64::from(i) * (1.0 + gap) + 0.5) * tag_mm;
                let at = DVec3::new(middle(col), middle(row), 0.0);
                prop_assert!(panel.tag_centre_mm(tag).abs_diff_eq(at, 1e-9));
            }
            // A small square at each corner of each tag, and the tags.
            let small = (columns + 1) * (rows + 1);
            prop_assert_eq!(panel.dark_tiles().len() as u32, columns * rows + small);
            prop_assert_eq!(Target::from_json(&target.to_json()).unwrap(), target);
        }
    }

    #[test]
    fn written_files_match_kalibr() {
        let yaml = AprilGridSpec::new([6, 5], 88.0).to_kalibr_yaml().unwrap();
        let lines: Vec<&str> = yaml.lines().collect();
        assert_eq!(lines[..3], ["target_type: 'aprilgrid'", "tagCols: 6", "tagRows: 5"]);
        assert!(
            lines[3].starts_with("tagSize: 0.088 ") && lines[4].starts_with("tagSpacing: 0.3 ")
        );
    }
}
