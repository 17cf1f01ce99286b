//! How the lattice of a grid moves onto that of a panel.

use std::collections::BTreeSet;

use deltille_core::lattice::{LatticeMap, Orientation, Tile, Vertex};
use deltille_core::targets::Panel;

/// Number of counter-clockwise turns, by 120° or 90°, by which a tag in the panel's frame is turned in a
/// tile of the grid that this map takes to the panel.
pub(super) fn turns_of(panel_from_grid: LatticeMap, on_grid: Tile) -> usize {
    let a = panel_from_grid.inverse().apply(panel_from_grid.apply_tile(on_grid).frame()[0]);
    on_grid.vertices().position(|v| v == a).unwrap_or(0)
}

/// The lattice vertices of the corners of a panel.
pub(crate) fn panel_vertices(panel: &Panel) -> BTreeSet<Vertex> {
    panel.corners.iter().map(|corner| Vertex::new(corner.row, corner.col)).collect()
}

/// The motion that takes the grid tile to the panel's `tile` when the tag in it is turned
/// counter-clockwise `turns` times, by 120° or 90°, against the grid.
pub(crate) fn panel_from_grid(on_grid: Tile, tile: Tile, turns: u8) -> LatticeMap {
    // The tag's lower-left vertex lies on vertex `turns` of the grid tile, and its lower edge
    // points along step 2·turns, on an inverted tile half a turn further; on a square along step
    // `turns`.
    let kind = tile.kind();
    let steps = kind.steps().len() as i32 / i32::from(kind.turns());
    let half_turn = if on_grid.orientation == Orientation::Inverted { 3 } else { 0 };
    let from = on_grid.vertices().nth(usize::from(turns)).unwrap_or(on_grid.anchor);
    LatticeMap::taking(kind, from, tile.anchor, -(steps * i32::from(turns) + half_turn))
}
