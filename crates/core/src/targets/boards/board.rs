//! Boards: positions of their corners and tags.

use std::collections::BTreeMap;

use glam::{DMat3, DVec2, DVec3};

use super::capacity::{TagSettings, check_family, wider_spacing};
use crate::family::Family;
use crate::lattice::{GridKind, ROW_HEIGHT, Vertex};
use crate::setting::Setting::BoardBoards;
use crate::targets::{
    BoardSpec, Corner, FamilyRef, Outline, Panel, PanelPose, TagSpec, TagsIn, TargetError,
};

/// Returns the corners of a zigzag board of `rows × cols` corners, by row, then column. Every second row starts one
/// column further left, so that odd rows are half an edge to the right of even ones. The smallest column is 0.
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

/// Returns the corners of a checkerboard, by row, then column.
///
/// Row 0, column 0 is the lower left corner. The square above and to the right of it is black, like all squares whose
/// lower left vertex has an even sum of row and column.
fn rectangle_vertices(rows: u32, cols: u32) -> impl Iterator<Item = Vertex> {
    let (rows, cols) = (rows as i32, cols as i32);
    (0..rows).flat_map(move |row| (0..cols).map(move |col| Vertex::new(row, col)))
}

/// Returns the corners of a board of a tiling, by row, then column.
pub fn board_vertices(kind: GridKind, rows: u32, cols: u32) -> Vec<Vertex> {
    match kind {
        GridKind::Deltille => zigzag_vertices(rows, cols).collect(),
        GridKind::Checker => rectangle_vertices(rows, cols).collect(),
    }
}

/// Returns the width and height of the drawn tiles, mm, like [`Panel::bounds_mm`] but without a panel.
pub fn size_mm(spec: &BoardSpec) -> DVec2 {
    let (rows, cols) = (f64::from(spec.rows), f64::from(spec.cols));
    let edges = match spec.grid {
        GridKind::Deltille => DVec2::new(cols + 1.5, (rows + 1.0) * ROW_HEIGHT),
        GridKind::Checker => DVec2::new(cols + 1.0, rows + 1.0),
    };
    edges * spec.edge_mm
}

/// Returns the tiles that carry tags, ordered by row, then column.
///
/// Reading a tag requires the corners of its tile, so these are corners of the board. Tagged tiles
/// are in every `spacing`-th row and column. On a checkerboard, the squares must also have the
/// right colour. Of the possible starts, the one with the
/// most tags is used; among equal ones, the one whose tags are most evenly distributed around the centre of the
/// board.
pub fn tagged_tiles(
    kind: GridKind,
    corners: &[Vertex],
    spacing: u32,
    tags_in: TagsIn,
) -> Vec<Vertex> {
    // Faster than a set for the quarter of a million corners of the largest boards.
    let mut corners = corners.to_vec();
    corners.sort_unstable();
    let carries = |&v: &Vertex| {
        let tile = kind.tag_tile(v);
        tile.is_dark() == (tags_in == TagsIn::Black)
            && tile.vertices().all(|v| corners.binary_search(&v).is_ok())
    };
    let spacing = spacing as i32;
    let mut by_start = BTreeMap::<(i32, i32), Vec<Vertex>>::new();
    for tile in corners.iter().copied().filter(carries) {
        by_start.entry((tile.row % spacing, tile.col % spacing)).or_default().push(tile);
    }
    let position = |v: Vertex| kind.position(v.row.into(), v.col.into());
    let mean = |points: &[DVec2]| points.iter().sum::<DVec2>() / points.len() as f64;
    let centre = mean(&corners.iter().map(|&v| position(v)).collect::<Vec<_>>());
    let off_centre = |tiles: &[Vertex]| {
        let vertices = tiles.iter().flat_map(|&v| kind.tag_tile(v).vertices()).map(position);
        let off = mean(&vertices.collect::<Vec<_>>()) - centre;
        // Rounding keeps noise in the last digit from deciding between equal starts.
        (off.length() * 1e6).round() as i64
    };
    by_start
        .into_values()
        .min_by_key(|tiles| (std::cmp::Reverse(tiles.len()), off_centre(tiles)))
        .unwrap_or_default()
}

/// Returns the panels of a checked spec and the family of their tags.
pub(crate) fn panels(
    spec: &BoardSpec,
    family: Option<&Family>,
) -> Result<(Vec<Panel>, Option<FamilyRef>), TargetError> {
    spec.check()?;
    let Some(tags) = &spec.tags else { return Ok((untied_panels(spec), None)) };
    let vertices = board_vertices(spec.grid, spec.rows, spec.cols);
    let on_each = |spacing| tagged_tiles(spec.grid, &vertices, spacing, tags.tags_in).len() as u64;
    let boards = u64::from(spec.panel_count());
    let on_one = on_each(tags.spacing);
    let instead = |available: u64| {
        let tiles = on_each(1);
        let wider = wider_spacing(tags, available, |spacing| {
            // The start with the most tags has at least the mean. On large boards, no other spacing needs counting.
            let least = boards * tiles.div_ceil(u64::from(spacing).pow(2));
            if least > available { least } else { boards * on_each(spacing) }
        });
        let fewer = available / on_one.max(1);
        let fewer =
            (fewer > 0 && spec.boards > 1).then(|| format!("use at most {fewer} {BoardBoards}"));
        wider.into_iter().chain(fewer).collect()
    };
    let needed = boards * on_one;
    let family =
        check_family(spec.grid, tags, spec.edge_mm, family, needed, TagSettings::TAGS, instead)?;
    Ok((untied_panels(spec), Some(family)))
}

/// Returns the panels of a checked spec, regardless of the size of its family.
pub fn untied_panels(spec: &BoardSpec) -> Vec<Panel> {
    let vertices = board_vertices(spec.grid, spec.rows, spec.cols);
    let tagged = |tags: &TagSpec| tagged_tiles(spec.grid, &vertices, tags.spacing, tags.tags_in);
    let tiles = spec.tags.as_ref().map_or_else(Vec::new, tagged);
    let matrix = [vertices.iter().map(|v| v.col as u32 + 1).max().unwrap_or(0), spec.rows];
    let panel = |board: u32| Panel {
        id: spec.board_id + board,
        kind: spec.grid,
        edge_mm: spec.edge_mm,
        border_bits: spec.tags.as_ref().map(|tags| tags.border_bits),
        tags_in: spec.tags.as_ref().map_or_else(TagsIn::default, |tags| tags.tags_in),
        tag_margin_bits: None,
        gap_edges: None,
        discs_mm: None,
        hole_mm: spec.tags.as_ref().and_then(|tags| tags.hole_mm),
        rim_mm: None,
        inverted: spec.inverted,
        outline: match spec.grid {
            GridKind::Deltille => Outline::Zigzag,
            GridKind::Checker => Outline::Touching,
        },
        matrix,
        pose: PanelPose::IDENTITY,
        corners: vertices
            .iter()
            .zip(board * vertices.len() as u32..)
            .map(|(v, id)| {
                let panel_mm = spec.grid.position(v.row.into(), v.col.into()) * spec.edge_mm;
                let target_mm = panel_mm.extend(0.0);
                Corner { id, row: v.row, col: v.col, panel_mm, target_mm, measured: None }
            })
            .collect(),
        tags: spec.tags.as_ref().map_or_else(Vec::new, |tags| {
            let first = tags.first_id.saturating_add(board * tiles.len() as u32);
            tags.placements(spec.board_id + board, first, &tiles)
        }),
    };
    let mut panels: Vec<Panel> = (0..spec.panel_count()).map(panel).collect();
    if let (Some(thickness_mm), [front, back]) = (spec.two_sided_mm, panels.as_mut_slice()) {
        let [left, _, right, _] = front.field_mm();
        put(back, &behind(left + right, thickness_mm));
    }
    panels
}

/// Returns the pose of the rear panel: rotated about the vertical axis at half of `across`, and
/// moved back by the thickness.
fn behind(across: f64, thickness_mm: f64) -> PanelPose {
    let turn = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0));
    PanelPose::new(turn, DVec3::new(across, 0.0, -thickness_mm))
}

/// Moves a panel to a pose.
fn put(panel: &mut Panel, pose: &PanelPose) {
    panel.pose = *pose;
    for corner in &mut panel.corners {
        corner.target_mm = pose.target_from_panel(corner.panel_mm);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::targets::TagSpec;

    fn spec(rows: u32, cols: u32, spacing: u32) -> BoardSpec {
        let tags = Some(TagSpec { spacing, ..TagSpec::default() });
        BoardSpec { tags, ..BoardSpec::new(GridKind::Deltille, rows, cols, 20.0) }
    }

    fn panel(spec: &BoardSpec) -> Panel {
        let untagged = BoardSpec { tags: None, ..spec.clone() };
        panels(&untagged, None).unwrap().0.remove(0)
    }

    /// The published print has 11 rows of 12 tiles, 250 mm × 11 · 10√3 mm.
    #[test]
    fn default_board_has_the_published_size() {
        let panel = panel(&spec(10, 11, 3));
        assert_eq!(panel.corners.len(), 110);
        assert_eq!(panel.dark_tiles().len(), 11 * 12);
        let [left, lower, right, upper] = panel.bounds_mm();
        assert!((right - left - 250.0).abs() < 1e-9);
        assert!((upper - lower - 110.0 * 3f64.sqrt()).abs() < 1e-9);
        assert_eq!(panel.matrix, [15, 10]);
    }

    #[test]
    fn default_tags_form_three_centred_rows() {
        let board = spec(10, 11, 3);
        let corners: Vec<Vertex> = zigzag_vertices(board.rows, board.cols).collect();
        let tiles = tagged_tiles(GridKind::Deltille, &corners, 3, TagsIn::Black);
        let rows: std::collections::BTreeSet<i32> = tiles.iter().map(|v| v.row).collect();
        assert_eq!(rows.into_iter().collect::<Vec<_>>(), [1, 4, 7]);
        assert!(tiles.len() >= 10, "{}", tiles.len());
    }

    /// Also covers smaller boards.
    #[test]
    fn position_codes_are_unique_up_to_256_rows_and_columns() {
        use crate::family::positions::{are_different, id};
        for (rows, cols) in
            [(256, 256), (256, 30), (30, 257), (257, 257), (300, 40), (20, 258), (500, 500)]
        {
            let ids: std::collections::BTreeSet<u32> =
                zigzag_vertices(rows, cols).map(|tile| id(0, tile)).collect();
            assert!(
                !are_different(rows, cols) || ids.len() as u32 == rows * cols,
                "{rows} × {cols}"
            );
        }
        assert!(are_different(256, 256));
        assert!(!are_different(500, 500));
    }

    proptest! {
        #[test]
        fn every_board_is_a_zigzag_rectangle(rows in 3u32..30, cols in 3u32..30) {
            let panel = panel(&spec(rows, cols, 1));
            prop_assert_eq!(panel.corners.len() as u32, rows * cols);
            prop_assert_eq!(panel.dark_tiles().len() as u32, (rows + 1) * (cols + 1));
            prop_assert_eq!(panel.corners.iter().map(|c| c.col).min(), Some(0));
            let [left, _, right, _] = panel.bounds_mm();
            prop_assert!((right - left - 20.0 * (f64::from(cols) + 1.5)).abs() < 1e-9);
            let row_ends = |row: i32| panel.corners.iter().filter(move |c| c.row == row);
            for row in 0..rows as i32 {
                let x = row_ends(row).map(|c| c.panel_mm.x).fold(f64::INFINITY, f64::min);
                let first = if row % 2 == 0 { 20.0 } else { 30.0 };
                prop_assert!((x - left - first).abs() < 1e-9);
            }
        }

        #[test]
        fn tags_keep_their_spacing_between_corners(
            rows in 2u32..20, cols in 2u32..20, spacing in 1u32..8, checker: bool, white: bool,
        ) {
            let board = spec(rows, cols, spacing);
            let tags_in = if white { TagsIn::White } else { TagsIn::Black };
            let grid = if checker { GridKind::Checker } else { GridKind::Deltille };
            let board = BoardSpec { grid, ..board };
            let corners = board_vertices(board.grid, board.rows, board.cols);
            let tags_in = if checker { tags_in } else { TagsIn::Black };
            let tiles = tagged_tiles(grid, &corners, spacing, tags_in);
            // A board of 2 × 2 corners has a single square, which is black.
            prop_assert!(!tiles.is_empty() || (rows, cols, tags_in) == (2, 2, TagsIn::White));
            prop_assert!(tiles.is_sorted());
            for tile in &tiles {
                prop_assert!(grid.tag_tile(*tile).vertices().all(|v| corners.contains(&v)));
                prop_assert_eq!(grid.tag_tile(*tile).is_dark(), tags_in == TagsIn::Black);
                let d = *tile - tiles[0];
                prop_assert!(d.row % spacing as i32 == 0 && d.col % spacing as i32 == 0);
            }
        }
    }
}
