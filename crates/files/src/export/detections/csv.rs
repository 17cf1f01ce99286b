//! Detections as comma-separated values, one corner per line, for spreadsheets and data frames; and a reader of lists of points.
//!
//! Columns: `grid` (counted from 0 in the image), `kind`, `panel` (`target:panel` with several targets), `row`, `col`, `id`,
//! `x`, `y` (px, pixel centres at integers, y down), `cov_xx`, `cov_xy`, `cov_yy` (px²), `target` (fingerprint of the target of
//! the corner), `image` (name of the image), `target_x_mm`, `target_y_mm`, `target_z_mm` (position on the target). A cell is
//! empty if the value is not known.

use std::fmt::Write;

use glam::{DVec2, DVec3};

use super::positions::Positions;
use crate::export::writing::cell::quoted;
use deltille_core::detection::Detection;
use deltille_core::lattice::GridKind;
use deltille_core::targets::Target;

/// The header line.
pub const HEADER: &str = "grid,kind,panel,row,col,id,x,y,cov_xx,cov_xy,cov_yy,target,image,target_x_mm,target_y_mm,target_z_mm";

/// Returns the text of the CSV file of one image; `targets` are those that were searched for, if known.
///
/// ```
/// use deltille_core::detection::Detection;
/// use deltille_files::export::csv;
///
/// assert_eq!(csv::write(&Detection::default(), &[]).lines().next(), Some(csv::HEADER));
/// ```
pub fn write(detection: &Detection, targets: &[&Target]) -> String {
    let positions = Positions::of(targets);
    let image = quoted(&detection.image);
    let mut text = format!("{HEADER}\n");
    for (index, grid) in detection.grids.iter().enumerate() {
        let kind = match grid.kind {
            GridKind::Deltille => "deltille",
            GridKind::Checker => "checker",
        };
        let panel = match (&grid.target, grid.panel) {
            (_, None) => String::new(),
            (None, Some(id)) => id.to_string(),
            (Some(target), Some(id)) => format!("{target}:{id}"),
        };
        let target = detection.target_of(grid).filter(|_| grid.panel.is_some());
        let target = target.map_or_else(String::new, |target| target.fingerprint.to_string());
        let positions = positions.of_grid(grid);
        for corner in &grid.corners {
            let (row, col, x, y) = (corner.row, corner.col, corner.x, corner.y);
            let id = corner.id.map_or_else(String::new, |id| id.to_string());
            let cov = corner
                .cov
                .map_or_else(|| ",,".to_owned(), |[xx, xy, yy]| format!("{xx},{xy},{yy}"));
            let position = positions.and_then(|all| all.get(&(row, col)));
            let position = position
                .map_or_else(|| ",,".to_owned(), |DVec3 { x, y, z }| format!("{x},{y},{z}"));
            // Writing to a String cannot fail.
            let _ = writeln!(
                text,
                "{index},{kind},{panel},{row},{col},{id},{x},{y},{cov},{target},{image},{position}"
            );
        }
    }
    text
}

/// Reads points, px, one `x,y` per line; a header line `x,y` and empty lines are skipped.
///
/// # Errors
/// Returns the number of the first line that is not a point.
pub fn read_points(text: &str) -> Result<Vec<DVec2>, String> {
    let mut points = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let numbers: Option<Vec<f64>> =
            fields.iter().map(|f| f.parse().ok().filter(|n: &f64| n.is_finite())).collect();
        match numbers.as_deref() {
            Some(&[x, y]) => points.push(DVec2::new(x, y)),
            _ if line.trim().is_empty() => {}
            _ if i == 0 && fields == ["x", "y"] => {}
            _ => return Err(format!("line {}: expected x,y in px, not {line:?}", i + 1)),
        }
    }
    Ok(points)
}
