//! An untagged board given without a description file.

use std::collections::BTreeSet;

use glam::DVec3;

use deltille_core::detection::Grid;
use deltille_core::lattice::{GridKind, LatticeMap};
use deltille_core::setting::Setting::{
    DetectionAssumeTargets, UntaggedGridEdgeMm, UntaggedGridSize,
};
use deltille_core::targets::{
    BoardSpec, Target, TargetError, TargetIdentity, TargetSpec, board_vertices, symmetries,
};

/// Advice for a detection of another target.
pub(super) fn assume_target() -> String {
    format!(
        "give the description that was used for detection, or set {DetectionAssumeTargets} to use this one"
    )
}

/// An untagged board given without a description file. Its labels may differ between views by a symmetry of
/// the lattice, which the pose of the view absorbs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UntaggedGrid {
    /// The tiling.
    pub kind: GridKind,
    /// Edge length of a tile, mm.
    pub edge_mm: f64,
    /// Rows and columns of corners, if they are known.
    pub size: Option<[u32; 2]>,
}

impl UntaggedGrid {
    /// Returns the board as a target; `None` if its size is not known.
    ///
    /// # Errors
    /// Returns an error if the size is too small or too large for a board.
    pub fn target(&self, name: &str) -> Option<Result<Target, TargetError>> {
        let [rows, cols] = self.size?;
        let plain = BoardSpec::new(self.kind, rows, cols, self.edge_mm);
        let spec = BoardSpec { tags: None, ..plain };
        Some(Target::build(name, &TargetSpec::Board(spec), None))
    }

    /// Position of a corner, mm.
    pub(crate) fn place(&self, row: i32, col: i32) -> DVec3 {
        self.edge_mm * self.kind.position(row.into(), col.into()).extend(0.0)
    }

    /// Rejects a grid that was detected as a target of another tile size or corner count.
    pub(super) fn check_target(&self, seen: Option<&TargetIdentity>) -> Result<(), String> {
        match seen {
            Some(seen) if seen.edge_mm != [self.edge_mm; 2] => Err(format!(
                "it was detected as {seen}, but {UntaggedGridEdgeMm} is {} mm: {}",
                self.edge_mm,
                assume_target()
            )),
            Some(seen) if self.size.is_some_and(|[rows, cols]| rows * cols != seen.corners) => {
                Err(format!(
                    "it was detected as {seen}, but the board specified by {UntaggedGridSize} has {} corners: {}",
                    self.size.map_or(0, |[rows, cols]| rows * cols),
                    assume_target()
                ))
            }
            _ => Ok(()),
        }
    }

    /// Checks whether a detected grid can be this board. The error states the reason if it cannot.
    pub(crate) fn check(&self, grid: &Grid) -> Result<(), String> {
        let Some([rows, cols]) = self.size else { return Ok(()) };
        let found = grid.corners.len();
        let most = rows as usize * cols as usize;
        if found > most {
            return Err(format!(
                "it has {found} corners, more than the {rows} × {cols} of the board"
            ));
        }
        if found < most {
            return Ok(());
        }
        let labels: BTreeSet<_> = grid.corners.iter().map(|c| (c.row, c.col)).collect();
        if labels == self.labels(rows, cols) {
            return Ok(());
        }
        Err(if labels == self.labels(cols, rows) {
            format!("it has {cols} rows × {rows} columns: swap the values of {UntaggedGridSize}")
        } else {
            format!("its rows and columns do not match a board of {rows} × {cols} corners")
        })
    }

    /// The rotations of its labels that look the same in an image, see
    /// [`Panel::label_symmetries`](deltille_core::targets::Panel::label_symmetries); none if its size is not known.
    pub(super) fn label_symmetries(&self) -> Vec<LatticeMap> {
        self.size.map_or(Vec::new(), |[rows, cols]| {
            symmetries(self.kind, board_vertices(self.kind, rows, cols))
        })
    }

    /// Whether the labels reach the first and last row and column of the board.
    pub(super) fn is_spanned_by(&self, labels: &BTreeSet<(i32, i32)>) -> bool {
        let ends = |labels: &BTreeSet<(i32, i32)>| {
            let rows = labels.iter().map(|(row, _)| *row);
            let cols = labels.iter().map(|(_, col)| *col);
            (rows.clone().min(), rows.max(), cols.clone().min(), cols.max())
        };
        self.size.is_some_and(|[rows, cols]| ends(labels) == ends(&self.labels(rows, cols)))
    }

    fn labels(&self, rows: u32, cols: u32) -> BTreeSet<(i32, i32)> {
        board_vertices(self.kind, rows, cols).into_iter().map(|v| (v.row, v.col)).collect()
    }
}
