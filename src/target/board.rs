//! Zigzag boards: where their corners and tags are.

use std::collections::BTreeMap;

use super::capacity::{check_family, wider_spacing};
use super::{
    BoardSpec, Corner, FamilyRef, GridKind, Outline, Panel, PanelPose, TagPlacement, TargetError,
};
use crate::family::Family;
use crate::lattice::{Tile, Vertex};

/// The corners of a zigzag board of `rows × cols` corners, by row, then column: every second row
/// starts one column further left, so that odd rows lie half an edge to the right of even ones;
/// the smallest column is 0.
///
/// ```text
///   row 3     ·   ·   ·        columns 0 1 2
///   row 2   ·   ·   ·          columns 0 1 2
///   row 1     ·   ·   ·        columns 1 2 3
///   row 0   ·   ·   ·          columns 1 2 3
/// ```
pub fn zigzag_vertices(rows: u32, cols: u32) -> impl Iterator<Item = Vertex> {
    let (rows, cols) = (rows as i32, cols as i32);
    (0..rows).flat_map(move |row| {
        let first = (rows - 1) / 2 - row / 2;
        (first..first + cols).map(move |col| Vertex::new(row, col))
    })
}

/// The tiles that carry tags, ordered by row, then column.
///
/// A tag needs three corners to be read, so its tile has corners for vertices, in every
/// `spacing`-th row and column. Of the possible starts the one with most tags is taken, and of
/// those the one whose tags lie most evenly about the centre of the board.
pub(super) fn tagged_tiles(corners: &[Vertex], spacing: u32) -> Vec<Vertex> {
    let corners: std::collections::BTreeSet<Vertex> = corners.iter().copied().collect();
    let complete = |&v: &Vertex| Tile::upright(v).vertices().iter().all(|v| corners.contains(v));
    let spacing = spacing as i32;
    let mut by_start = BTreeMap::<(i32, i32), Vec<Vertex>>::new();
    for tile in corners.iter().copied().filter(complete) {
        by_start.entry((tile.row % spacing, tile.col % spacing)).or_default().push(tile);
    }
    let centre = mean(&corners.iter().map(|v| v.position()).collect::<Vec<_>>());
    let off_centre = |tiles: &[Vertex]| {
        // The centre of a tile is a third of its edges' sum away from its anchor.
        let at = mean(&tiles.iter().map(|v| v.position()).collect::<Vec<_>>());
        let [dx, dy] = [at[0] + 0.5 - centre[0], at[1] + 0.5 / 3f64.sqrt() - centre[1]];
        // Rounded, so that noise in the last digit does not decide between equal starts.
        (dx.hypot(dy) * 1e6).round() as i64
    };
    by_start
        .into_values()
        .min_by_key(|tiles| (std::cmp::Reverse(tiles.len()), off_centre(tiles)))
        .unwrap_or_default()
}

fn mean(points: &[[f64; 2]]) -> [f64; 2] {
    let n = points.len() as f64;
    [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / n)
}

/// The panels of a checked spec, and the family of its tags.
pub(super) fn panels(
    spec: &BoardSpec,
    family: Option<&Family>,
) -> Result<(Vec<Panel>, Option<FamilyRef>), TargetError> {
    spec.check()?;
    let panels = untied_panels(spec);
    let Some(tags) = &spec.tags else { return Ok((panels, None)) };
    let vertices: Vec<Vertex> = zigzag_vertices(spec.rows, spec.cols).collect();
    let on_each = |spacing| tagged_tiles(&vertices, spacing).len() as u64;
    let boards = u64::from(spec.boards);
    let instead = |available: u64| {
        let wider = wider_spacing(tags, available, |spacing| boards * on_each(spacing));
        let fewer = available / on_each(tags.spacing).max(1);
        let fewer = (fewer > 0).then(|| format!("make at most {fewer} --boards"));
        wider.into_iter().chain(fewer).collect()
    };
    let family = check_family(tags, family, boards * on_each(tags.spacing), instead)?;
    Ok((panels, Some(family)))
}

/// The panels of a checked spec, whether or not its family has so many tags.
pub(super) fn untied_panels(spec: &BoardSpec) -> Vec<Panel> {
    let first_tag = spec.tags.as_ref().map_or(0, |tags| tags.first_id);
    let vertices: Vec<Vertex> = zigzag_vertices(spec.rows, spec.cols).collect();
    let spacing = spec.tags.as_ref().map(|tags| tags.spacing);
    let tiles = spacing.map_or_else(Vec::new, |spacing| tagged_tiles(&vertices, spacing));
    let matrix = [vertices.iter().map(|v| v.col as u32 + 1).max().unwrap_or(0), spec.rows];
    let panel = |board: u32| Panel {
        id: spec.board_id + board,
        kind: GridKind::Deltille,
        edge_mm: spec.edge_mm,
        border_bits: spec.tags.as_ref().map(|tags| tags.border_bits),
        inverted: spec.inverted,
        outline: Outline::Zigzag,
        matrix,
        pose: PanelPose::IDENTITY,
        corners: vertices
            .iter()
            .zip(board * vertices.len() as u32..)
            .map(|(v, id)| {
                let [x, y] = v.position().map(|p| p * spec.edge_mm);
                let (panel_mm, target_mm) = ([x, y], [x, y, 0.0]);
                Corner { id, row: v.row, col: v.col, panel_mm, target_mm }
            })
            .collect(),
        tags: tiles
            .iter()
            .enumerate()
            // No family has so many codes that ids overflow; a spec may ask for them.
            .map(|(i, tile)| TagPlacement {
                id: first_tag.saturating_add(board * tiles.len() as u32 + i as u32),
                row: tile.row,
                col: tile.col,
            })
            .collect(),
    };
    (0..spec.boards).map(panel).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::target::TagSpec;

    fn spec(rows: u32, cols: u32, spacing: u32) -> BoardSpec {
        let tags = Some(TagSpec { spacing, ..TagSpec::default() });
        BoardSpec { rows, cols, edge_mm: 20.0, boards: 1, board_id: 0, tags, inverted: false }
    }

    fn panel(spec: &BoardSpec) -> Panel {
        let untagged = BoardSpec { tags: None, ..spec.clone() };
        panels(&untagged, None).unwrap().0.remove(0)
    }

    /// The published print has 11 rows of 12 tiles, 250 mm × 11 · 10√3 mm.
    #[test]
    fn the_board_of_the_paper() {
        let panel = panel(&spec(10, 11, 3));
        assert_eq!(panel.corners.len(), 110);
        assert_eq!(panel.upright_tiles().len(), 11 * 12);
        let [left, lower, right, upper] = panel.bounds_mm();
        assert!((right - left - 250.0).abs() < 1e-9);
        assert!((upper - lower - 110.0 * 3f64.sqrt()).abs() < 1e-9);
        assert_eq!(panel.matrix, [15, 10]);
    }

    #[test]
    fn tags_of_the_default_board_lie_in_three_rows_about_the_centre() {
        let board = spec(10, 11, 3);
        let corners: Vec<Vertex> = zigzag_vertices(board.rows, board.cols).collect();
        let tiles = tagged_tiles(&corners, 3);
        let rows: std::collections::BTreeSet<i32> = tiles.iter().map(|v| v.row).collect();
        assert_eq!(rows.into_iter().collect::<Vec<_>>(), [1, 4, 7]);
        assert!(tiles.len() >= 10, "{}", tiles.len());
    }

    proptest! {
        #[test]
        fn every_board_is_a_zigzag_rectangle(rows in 3u32..30, cols in 3u32..30) {
            let panel = panel(&spec(rows, cols, 1));
            prop_assert_eq!(panel.corners.len() as u32, rows * cols);
            prop_assert_eq!(panel.upright_tiles().len() as u32, (rows + 1) * (cols + 1));
            prop_assert_eq!(panel.corners.iter().map(|c| c.col).min(), Some(0));
            let [left, _, right, _] = panel.bounds_mm();
            prop_assert!((right - left - 20.0 * (f64::from(cols) + 1.5)).abs() < 1e-9);
            let row_ends = |row: i32| panel.corners.iter().filter(move |c| c.row == row);
            for row in 0..rows as i32 {
                let x = row_ends(row).map(|c| c.panel_mm[0]).fold(f64::INFINITY, f64::min);
                let first = if row % 2 == 0 { 20.0 } else { 30.0 };
                prop_assert!((x - left - first).abs() < 1e-9);
            }
        }

        #[test]
        fn tags_keep_their_spacing_and_lie_between_corners(
            rows in 2u32..20, cols in 2u32..20, spacing in 1u32..8,
        ) {
            let board = spec(rows, cols, spacing);
            let corners: Vec<Vertex> = zigzag_vertices(board.rows, board.cols).collect();
            let tiles = tagged_tiles(&corners, spacing);
            prop_assert!(!tiles.is_empty());
            prop_assert!(tiles.is_sorted());
            for tile in &tiles {
                prop_assert!(Tile::upright(*tile).vertices().iter().all(|v| corners.contains(v)));
                let d = *tile - tiles[0];
                prop_assert!(d.row % spacing as i32 == 0 && d.col % spacing as i32 == 0);
            }
        }
    }
}
