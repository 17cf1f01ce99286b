//! `.orpc` corner lists in the format of the reference detector (`docs/formats.md`, “.orpc corner lists”).
//!
//! ```text
//! filename: photo.png
//! width: 1600
//! height: 1200
//! num_corners: 110
//! encoding: ascii
//! 0,4,1,612.0313,804.774          board, point, ordered, x, y; pixel centres at integers
//! ```
//!
//! `board` is the index of the board among those of the target by ascending id; `point` is the index of the corner in its matrix
//! ([`super::dsc::point_id`]). A comment after the corners names the target that was searched for; readers that count corners do
//! not reach it. An unlabelled grid has board −1, ordered 0, and points counted in the smallest matrix that contains the grid.

use std::fmt::Write;

use super::dsc::{Dialect, point_id};
use deltille_core::detection::{Detection, Grid};
use deltille_core::lattice::Vertex;
use deltille_core::targets::Target;

/// The first word of a file.
pub const HEAD: &str = "filename:";

/// Returns the text of the `.orpc` file of one image; `target` is the target that was searched for, if known.
/// Positions are in px.
pub fn write(detection: &Detection, target: Option<&Target>) -> String {
    let lines: Vec<String> =
        detection.grids.iter().flat_map(|grid| corner_lines(grid, target)).collect();
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{HEAD} {}", detection.image);
    let _ = writeln!(text, "width: {}\nheight: {}", detection.width, detection.height);
    let _ = writeln!(text, "num_corners: {}\nencoding: ascii", lines.len());
    lines.iter().for_each(|line| {
        let _ = writeln!(text, "{line}");
    });
    for target in &detection.targets {
        let _ = writeln!(text, "# target {} {target}", target.fingerprint);
    }
    text
}

fn corner_lines(grid: &Grid, target: Option<&Target>) -> Vec<String> {
    let labelled = target.zip(grid.panel).and_then(|(target, id)| {
        let board = target.panels.iter().position(|panel| panel.id == id)?;
        Some((board, &target.panels[board], Dialect::of(target)))
    });
    // The product of two numbers from a file may exceed 32 bits.
    let low = |of: fn(&deltille_core::detection::GridCorner) -> i32| {
        grid.corners.iter().map(of).min().map_or(0, i64::from)
    };
    let (row0, col0) = (low(|c| c.row), low(|c| c.col));
    let cols = grid.corners.iter().map(|c| i64::from(c.col) - col0 + 1).max().unwrap_or(0);
    let line = |corner: &deltille_core::detection::GridCorner| {
        let (x, y) = (corner.x, corner.y);
        match labelled {
            Some((board, panel, dialect)) => {
                let point = point_id(panel, dialect, Vertex::new(corner.row, corner.col));
                format!("{board},{point},1,{x},{y}")
            }
            None => {
                let [row, col] = [corner.row, corner.col].map(i64::from);
                let point = (row - row0) * cols + col - col0;
                format!("-1,{point},0,{x},{y}")
            }
        }
    };
    grid.corners.iter().map(line).collect()
}
