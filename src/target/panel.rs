use std::collections::BTreeSet;

use super::{Outline, Panel};
use crate::lattice::{ROW_HEIGHT, Tile, Vertex};

/// White left around the tiles of a panel, in edges. All six tiles of every corner lie inside the
/// tiles' bounding box, so that nothing is measured beyond it; the quiet zone only has to keep
/// foreign marks from touching the outermost tiles in a blurred image, and a quarter of an edge is
/// more than the blur at which the corners themselves are lost.
const QUIET_EDGES: f64 = 0.25;

/// The least quiet zone, mm: on fine boards text stays clear of the tiles for the eye as well.
const QUIET_MIN_MM: f64 = 5.0;

impl Panel {
    /// The upright tiles that are drawn, ordered by row, then column: black ones on white, or, on
    /// an inverted panel, white ones on black.
    pub fn upright_tiles(&self) -> Vec<Tile> {
        let corners = self.corners.iter().map(|corner| Vertex::new(corner.row, corner.col));
        let mut anchors: BTreeSet<Vertex> =
            corners.flat_map(Tile::upright_around).map(|tile| tile.anchor).collect();
        if self.outline == Outline::Zigzag
            && let Some(lowest) = anchors.first().map(|anchor| anchor.row)
            && let Some(last) = anchors.range(..Vertex::new(lowest + 1, i32::MIN)).next_back()
        {
            anchors.insert(*last + Vertex::new(0, 1));
        }
        anchors.into_iter().map(Tile::upright).collect()
    }

    /// Bounding box of the drawn tiles in the panel frame: lower-left and upper-right corner, mm.
    pub fn bounds_mm(&self) -> [[f64; 2]; 2] {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for tile in self.upright_tiles() {
            // Left, right and lower end are those of the base, the upper end is the apex.
            let [left, bottom] = tile.anchor.position();
            for axis in 0..2 {
                low[axis] = low[axis].min([left, bottom][axis]);
                high[axis] = high[axis].max([left + 1.0, bottom + ROW_HEIGHT][axis]);
            }
        }
        [low, high].map(|point| point.map(|v| v * self.edge_mm))
    }

    /// Width of the quiet zone around [`Self::bounds_mm`], mm. Nothing else is printed in it; on
    /// an inverted panel it is black.
    pub fn quiet_zone_mm(&self) -> f64 {
        (QUIET_EDGES * self.edge_mm).max(QUIET_MIN_MM)
    }

    /// The bounding box with its quiet zone: on an inverted panel, the black field.
    pub fn field_mm(&self) -> [[f64; 2]; 2] {
        let quiet = self.quiet_zone_mm();
        let [low, high] = self.bounds_mm();
        [low.map(|v| v - quiet), high.map(|v| v + quiet)]
    }
}
