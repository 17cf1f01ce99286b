//! Writer of `.dsc` target descriptions.

use std::fmt::Write;

use glam::DVec3;

use super::{Dialect, DscError, FAMILIES};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::setting::Setting::{DialectFork, TagFamily, TagsInBlack};
use deltille_core::targets::{Panel, TagsIn, Target};

/// Returns the text of the `.dsc` file of a target; positions are in the target frame, mm.
///
/// # Errors
/// Returns an error if the dialect cannot describe the target.
pub fn write(target: &Target, dialect: Dialect) -> Result<String, DscError> {
    let refused = |reason: &str| DscError::Refused {
        dialect,
        name: target.name.to_string(),
        reason: reason.to_owned(),
    };
    if target.tilings().count() > 1 {
        return Err(refused("its tags are of two families, but the format supports one"));
    }
    let name = target.family.as_ref().map(|family| family.name.as_str());
    let name = name.ok_or_else(|| refused("the format needs tags, but the board has none"))?;
    let known = FAMILIES.iter().find(|&known| {
        name.strip_prefix("delTag") == Some(known) || name.strip_prefix("aprilTag") == Some(known)
    });
    let known = known.ok_or_else(|| {
        let names = FAMILIES.map(|f| format!("delTag{f}"));
        refused(&format!(
            "its readers have only the codes of {}, not those of {name}: choose one of them with \
             {TagFamily}",
            names.join(", ")
        ))
    })?;
    let family = match dialect {
        Dialect::Fork => name.to_owned(),
        Dialect::Original => format!("t{known}"),
    };
    let mut text = String::new();
    for panel in &target.panels {
        if panel.inverted {
            return Err(refused("its readers search for black tags, but the board is inverted"));
        }
        if panel.tags_in == TagsIn::White {
            return Err(refused(&format!(
                "its readers search for tags in black squares: use {TagsInBlack}"
            )));
        }
        let [a, b] = header(panel, dialect).map_err(|reason| refused(&reason))?;
        let border = panel.border_bits.unwrap_or_default();
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{},{a},{b},{}", panel.id, panel.edge_mm);
        let _ = writeln!(text, "{family},{border}");
        for corner in &panel.corners {
            let tag = panel.tags.iter().find(|tag| (tag.row, tag.col) == (corner.row, corner.col));
            let tag = tag.map_or(-1, |tag| i64::from(tag.id));
            let DVec3 { x, y, z } = corner.target_mm;
            let _ = writeln!(text, "{tag},{},{},{x},{y},{z}", corner.col, corner.row);
        }
    }
    Ok(text)
}

/// A and B of a panel.
fn header(panel: &Panel, dialect: Dialect) -> Result<[u32; 2], String> {
    let [cols, rows] = panel.matrix;
    match (dialect, panel.kind) {
        (Dialect::Fork, _) => Ok([cols, rows]),
        (Dialect::Original, GridKind::Checker) => {
            let complete = panel.corners.len() as u64 == u64::from(cols) * u64::from(rows);
            let holes = || "a rectangular board must list every corner".to_owned();
            complete.then_some([cols + 1, rows + 1]).ok_or_else(holes)
        }
        (Dialect::Original, GridKind::Deltille) => {
            let side = panel.corners.iter().map(|corner| corner.row + 1).max().unwrap_or(0);
            let triangle =
                (0..side).flat_map(|row| (0..side - row).map(move |col| Vertex::new(row, col)));
            let listed = panel.corners.iter().map(|corner| Vertex::new(corner.row, corner.col));
            if triangle.eq(listed) {
                Ok([side as u32 + 2, 0])
            } else {
                Err(format!(
                    "triangular boards must have an equilateral outline; use {DialectFork}"
                ))
            }
        }
    }
}
