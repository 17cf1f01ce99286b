//! Motions of the lattice from a grid to a panel.

use std::collections::BTreeSet;

use deltille_core::lattice::{LatticeMap, Orientation, Tile, Vertex};
use deltille_core::targets::Panel;

/// Returns the rotation of the panel's tags in a tile of the grid, given the map from the grid to
/// the panel. It is a number of counter-clockwise steps of 120° or 90°.
pub(super) fn turns_of(panel_from_grid: LatticeMap, on_grid: Tile) -> usize {
    let a = panel_from_grid.inverse().apply(panel_from_grid.apply_tile(on_grid).frame()[0]);
    on_grid.vertices().position(|v| v == a).unwrap_or(0)
}

/// Returns the lattice vertices of the corners of a panel.
pub(crate) fn panel_vertices(panel: &Panel) -> BTreeSet<Vertex> {
    panel.corners.iter().map(|corner| Vertex::new(corner.row, corner.col)).collect()
}

/// Returns the motion that takes the grid tile to the panel's `tile`. The tag in it is rotated
/// counter-clockwise relative to the grid by `rotations` steps of 120° or 90°.
pub(crate) fn panel_from_grid(on_grid: Tile, tile: Tile, rotations: u8) -> LatticeMap {
    // The tag's lower-left vertex lies on vertex `turns` of the grid tile. Its lower edge points along step 2·turns,
    // rotated by 180° on an inverted tile. On a square it points along step `turns`.
    let kind = tile.kind();
    let steps = kind.steps().len() as i32 / i32::from(kind.rotations());
    let half_turn = if on_grid.orientation == Orientation::Inverted { 3 } else { 0 };
    let from = on_grid.vertices().nth(usize::from(rotations)).unwrap_or(on_grid.anchor);
    LatticeMap::taking(kind, from, tile.anchor, -(steps * i32::from(rotations) + half_turn))
}
