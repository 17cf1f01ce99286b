//! Detections as comma-separated values, one corner a line, for spreadsheets and data frames.
//!
//! Columns: `grid` (counted from 0 in the image), `kind`, `panel`, `row`, `col`, `id`, `x`, `y`
//! (px, pixel centres at integers, y down), `cov_xx`, `cov_xy`, `cov_yy` (px²). A cell is empty
//! where nothing is known.

use std::fmt::Write;

use crate::detect::Detection;
use crate::target::GridKind;

/// The header line.
pub const HEADER: &str = "grid,kind,panel,row,col,id,x,y,cov_xx,cov_xy,cov_yy";

/// The text of the CSV file of one image.
pub fn write(detection: &Detection) -> String {
    let mut text = format!("{HEADER}\n");
    for (index, grid) in detection.grids.iter().enumerate() {
        let kind = match grid.kind {
            GridKind::Deltille => "deltille",
            GridKind::Checker => "checker",
        };
        let panel = grid.panel.map_or_else(String::new, |id| id.to_string());
        for corner in &grid.corners {
            let (row, col, x, y) = (corner.row, corner.col, corner.x, corner.y);
            let id = corner.id.map_or_else(String::new, |id| id.to_string());
            let cov = corner
                .cov
                .map_or_else(|| ",,".to_owned(), |[xx, xy, yy]| format!("{xx},{xy},{yy}"));
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{index},{kind},{panel},{row},{col},{id},{x},{y},{cov}");
        }
    }
    text
}
