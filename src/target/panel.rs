use std::collections::BTreeSet;

use super::{Corner, GridKind, Outline, Panel};
use crate::lattice::{ROW_HEIGHT, Tile, Vertex};

/// White left around the tiles of a panel, in edges. All six tiles of every corner lie inside the
/// tiles' bounding box, so that nothing is measured beyond it; the quiet zone only has to keep
/// foreign marks from touching the outermost tiles in a blurred image, and a quarter of an edge is
/// more than the blur at which the corners themselves are lost.
const QUIET_EDGES: f64 = 0.25;

/// The least quiet zone, mm: on fine boards text stays clear of the tiles for the eye as well.
const QUIET_MIN_MM: f64 = 5.0;

impl Panel {
    /// Whether it is a single tag, with no corner of the lattice around it.
    pub fn is_tag_alone(&self) -> bool {
        self.corners.is_empty() && self.tags.len() == 1
    }

    /// The corner at a vertex.
    pub fn corner_at(&self, vertex: Vertex) -> Option<&Corner> {
        let found = self.corners.binary_search_by_key(&vertex, |c| Vertex::new(c.row, c.col));
        found.ok().map(|index| &self.corners[index])
    }

    /// Where a vertex of the panel's lattice lies in the panel frame, mm.
    pub fn lattice_mm(&self, vertex: Vertex) -> [f64; 2] {
        let place = match self.kind {
            GridKind::Deltille => vertex.position(),
            GridKind::Checker => [f64::from(vertex.col), f64::from(vertex.row)],
        };
        place.map(|v| v * self.edge_mm)
    }

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
        if self.outline == Outline::Triangle
            && let Some(top) = self.corners.iter().map(|corner| corner.row).max()
        {
            let ends = [(-1, -1), (-1, top + 1), (top + 1, -1)];
            anchors.extend(ends.map(|(row, col)| Vertex::new(row, col)));
        }
        // A tag has a tile, also where it stands alone.
        anchors.extend(self.tags.iter().map(|tag| Vertex::new(tag.row, tag.col)));
        anchors.into_iter().map(Tile::upright).collect()
    }

    /// Bounding box of the drawn tiles in the panel frame, mm: left, lower, right and upper end.
    pub fn bounds_mm(&self) -> [f64; 4] {
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for tile in self.upright_tiles() {
            // Left, right and lower end are those of the base, the upper end is the apex.
            let [x, y] = tile.anchor.position();
            bounds[0] = bounds[0].min(x);
            bounds[1] = bounds[1].min(y);
            bounds[2] = bounds[2].max(x + 1.0);
            bounds[3] = bounds[3].max(y + ROW_HEIGHT);
        }
        bounds.map(|v| v * self.edge_mm)
    }

    /// Width of the quiet zone around [`Self::bounds_mm`], mm. Nothing else is printed in it; on
    /// an inverted panel it is black.
    pub fn quiet_zone_mm(&self) -> f64 {
        Self::quiet_zone_at_mm(self.edge_mm)
    }

    /// The bounding box with its quiet zone, mm: on an inverted panel, the black field.
    pub fn field_mm(&self) -> [f64; 4] {
        let quiet = self.quiet_zone_mm();
        let [left, lower, right, upper] = self.bounds_mm();
        [left - quiet, lower - quiet, right + quiet, upper + quiet]
    }

    /// Width of the quiet zone around tiles of a given edge, mm.
    pub(super) fn quiet_zone_at_mm(edge_mm: f64) -> f64 {
        (QUIET_EDGES * edge_mm).max(QUIET_MIN_MM)
    }

    /// Width and height of the drawn tiles of a zigzag board, mm; what [`Self::bounds_mm`] finds
    /// without a panel at hand.
    pub(super) fn zigzag_size_mm(rows: u32, cols: u32, edge_mm: f64) -> [f64; 2] {
        let (rows, cols) = (f64::from(rows), f64::from(cols));
        [(cols + 1.5) * edge_mm, (rows + 1.0) * ROW_HEIGHT * edge_mm]
    }
}
