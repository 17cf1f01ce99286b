//! A planar piece of a target: its tiling, corners and tags.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use serde::{Deserialize, Serialize};

use crate::lattice::{GridKind, Tile, Vertex};
use crate::polygon::{grown, hull, rectangle};
use crate::quantity;
use crate::targets::{Corner, PanelPose};

/// The tiles of a panel that are drawn beyond its corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Outline {
    /// The black tiles that touch a corner.
    #[default]
    Touching,
    /// The touching tiles and one more at the right end of the lowest row, so that all rows of a zigzag board have
    /// the same number of tiles.
    Zigzag,
    /// The touching tiles and one more at each end of a triangle of corners, so that the tiles fill a triangle.
    Triangle,
}

/// The tiles that carry tags, by their colour on a board that is not inverted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TagsIn {
    /// Black tiles: the tile itself is the tag's border.
    #[default]
    Black,
    /// White squares of a checkerboard: the tag has a border of its own, and white around it.
    White,
}

impl TagsIn {
    /// Returns whether this is the default, which files omit.
    pub fn is_black(&self) -> bool {
        *self == Self::Black
    }
}

/// A planar piece of a target: a board, or a face of a solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Board id, unique within the target.
    pub id: u32,
    /// The tiling.
    pub kind: GridKind,
    /// Length of a tile's edge, mm.
    #[serde(deserialize_with = "quantity::edge_mm::de")]
    pub edge_mm: f64,
    /// Border of its tags in bit-widths along the edge; `None` without tags.
    #[serde(default, deserialize_with = "quantity::border_bits::de")]
    pub border_bits: Option<f64>,
    /// Which squares of a checkerboard carry its tags.
    #[serde(default, skip_serializing_if = "TagsIn::is_black")]
    pub tags_in: TagsIn,
    /// Margin between a tile and the border of its tag, bit-widths, if it is not the usual one.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::border_bits::de"
    )]
    pub tag_margin_bits: Option<f64>,
    /// Width of the gaps between the tags of an AprilGrid, in edges. Gaps are the tiles whose lower
    /// left vertex has an odd row or an odd column.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::gap_edges::de"
    )]
    pub gap_edges: Option<f64>,
    /// Diameter of the discs that are drawn around the corners instead of tiles, mm.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub discs_mm: Option<f64>,
    /// Diameter of the hole in the centre of each tag, mm.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::edge_mm::de"
    )]
    pub hole_mm: Option<f64>,
    /// Whether the colours are inverted: white upright tiles, or squares, on a black field.
    pub inverted: bool,
    /// Width of the black rim around the tiles, mm, if it follows their outline: on an inverted face of a solid.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "quantity::rim_mm::de"
    )]
    pub rim_mm: Option<f64>,
    /// The tiles that are drawn around the corners.
    #[serde(default)]
    pub outline: Outline,
    /// Columns and rows of the matrix in which `.dsc` and `.orpc` files number the corners (`docs/formats.md`, “.dsc
    /// target descriptions”); it contains every corner.
    #[serde(deserialize_with = "quantity::side_of_matrix::de")]
    pub matrix: [u32; 2],
    /// Pose of the panel: from the panel frame to the target frame.
    pub pose: PanelPose,
    /// Saddle points, ordered by row, then column.
    pub corners: Vec<Corner>,
    /// Tags, in the same order as the corners.
    pub tags: Vec<TagPlacement>,
}

/// A tag in the upright tile, or the square, whose lower-left vertex is (row, col).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TagPlacement {
    /// Index of the code in the family.
    pub id: u32,
    /// Row of the tile's lower-left vertex.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub row: i32,
    /// Column of the tile's lower-left vertex.
    #[serde(deserialize_with = "quantity::place_in_lattice::de")]
    pub col: i32,
}

/// White margin around the tiles of a panel, in edges. All six tiles of every corner lie inside the bounding box of
/// the tiles, so nothing is measured beyond it. The quiet zone only keeps other marks from touching the outermost
/// tiles in a blurred image. A quarter of an edge is more than the blur at which the corners themselves are lost.
const QUIET_EDGES: f64 = 0.25;

/// Minimum quiet zone, mm: on boards with small tiles, it also separates text visually from the
/// tiles.
const QUIET_MIN_MM: f64 = 5.0;

/// Panels are coplanar if their normals differ by less than 3° (this is the cosine) and their centres by less than
/// this fraction of an edge. Listed positions have rounding errors only.
const SAME_WAY: f64 = 0.9986;
const IN_PLANE_EDGES: f64 = 0.05;

/// White margin between a white square and the border of its tag, bit-widths. Readers of AprilTags require one. The
/// corners of the square need as much distance from the tag as in a black square.
const TAG_MARGIN_BITS: f64 = 2.0;

impl TagsIn {
    /// Returns the margin between the edges of a tile and the border of its tag, bit-widths.
    pub fn margin_bits(self) -> f64 {
        match self {
            Self::Black => 0.0,
            Self::White => TAG_MARGIN_BITS,
        }
    }
}

impl Panel {
    /// Returns whether the panel is a single tag without lattice corners around it.
    pub fn is_tag_alone(&self) -> bool {
        self.corners.is_empty() && self.tags.len() == 1
    }

    /// Returns whether another panel has the same orientation in the same plane, and a corner of one lies on a tile
    /// between corners of the other. One would then hide the other.
    pub(crate) fn overlaps(&self, other: &Panel) -> bool {
        let normal = |panel: &Panel| panel.pose.matrix().z_axis;
        let apart_mm = (other.middle_mm() - self.middle_mm()).dot(normal(self)).abs();
        let is_plane = normal(self).dot(normal(other)) > SAME_WAY
            && apart_mm < IN_PLANE_EDGES * self.edge_mm.min(other.edge_mm);
        is_plane && (self.is_under_corner_of(other) || other.is_under_corner_of(self))
    }

    fn is_under_corner_of(&self, other: &Panel) -> bool {
        let vertices: BTreeSet<Vertex> =
            self.corners.iter().map(|corner| Vertex::new(corner.row, corner.col)).collect();
        other.corners.iter().any(|corner| {
            let at = self.pose.panel_from_target(corner.target_mm).truncate() / self.edge_mm;
            self.kind.tile_at(at).vertices().all(|vertex| vertices.contains(&vertex))
        })
    }

    /// Returns the mean of the corners in the target frame, mm.
    pub fn middle_mm(&self) -> DVec3 {
        let sum: DVec3 = self.corners.iter().map(|corner| corner.target_mm).sum();
        sum / self.corners.len() as f64
    }

    /// Returns the corner at a vertex.
    pub fn corner_at(&self, vertex: Vertex) -> Option<&Corner> {
        let found = self.corners.binary_search_by_key(&vertex, |c| Vertex::new(c.row, c.col));
        found.ok().map(|index| &self.corners[index])
    }

    /// Returns the position of a lattice vertex in the panel frame, mm.
    pub fn lattice_mm(&self, vertex: Vertex) -> DVec2 {
        self.position(vertex) * self.edge_mm
    }

    /// Returns the position of a lattice vertex in the panel frame, in edges.
    pub fn position(&self, Vertex { row, col }: Vertex) -> DVec2 {
        let Some(gap) = self.gap_edges else { return self.kind.position(row.into(), col.into()) };
        let along = |index: i32| {
            f64::from(index.div_euclid(2)) * (1.0 + gap) + f64::from(index.rem_euclid(2))
        };
        DVec2::new(along(col), along(row))
    }

    /// Converts coordinates of a tile to a position in the panel frame, in edges: see [`Tile::frame`].
    pub fn position_in_tile(&self, tile: Tile, DVec2 { x: u, y: v }: DVec2) -> DVec2 {
        if self.gap_edges.is_none() {
            let (row, col) = (f64::from(tile.anchor.row), f64::from(tile.anchor.col));
            return self.kind.position(row + v, col + u);
        }
        let [a, b, c] = tile.frame().map(|vertex| self.position(vertex));
        a + u * (b - a) + v * (c - a)
    }

    /// Returns the tile at a position in the panel frame, in edges.
    pub fn tile_at(&self, place: DVec2) -> Tile {
        let Some(gap) = self.gap_edges else { return self.kind.tile_at(place) };
        let index = |along: f64| {
            let pair = (along / (1.0 + gap)).floor();
            2 * pair as i32 + i32::from(along - pair * (1.0 + gap) >= 1.0)
        };
        self.kind.tag_tile(Vertex::new(index(place.y), index(place.x)))
    }

    /// Returns the position of a corner in the target frame, mm: the measured one, or else the planned one.
    pub fn position_mm(&self, corner: &Corner) -> DVec3 {
        corner.target_mm + self.pose.matrix() * corner.offset_mm()
    }

    /// Returns the centre of a tag in the target frame, mm.
    pub fn tag_centre_mm(&self, tag: &TagPlacement) -> DVec3 {
        self.pose.target_from_panel(self.tag_middle_mm(tag))
    }

    /// Returns the centre of a tag in the panel frame, mm.
    #[doc(hidden)]
    pub fn tag_middle_mm(&self, tag: &TagPlacement) -> DVec2 {
        let vertices = self.tag_tile(tag).vertices();
        let count = vertices.clone().count() as f64;
        vertices.map(|vertex| self.lattice_mm(vertex)).sum::<DVec2>() / count
    }

    /// Returns the tile of a tag.
    pub fn tag_tile(&self, tag: &TagPlacement) -> Tile {
        self.kind.tag_tile(Vertex::new(tag.row, tag.col))
    }

    /// Returns the margin between the edges of a tile and the border of its tag, bit-widths.
    pub fn tag_margin_bits(&self) -> f64 {
        self.tag_margin_bits.unwrap_or(self.tags_in.margin_bits())
    }

    /// Returns the distance from the edges of a tile to the cells of its tag, bit-widths along the edge.
    pub fn tag_inset_bits(&self) -> f64 {
        self.tag_margin_bits() + self.border_bits.unwrap_or_default()
    }

    /// Returns the tiles of both colours that meet at corners.
    fn tiles_around_corners(&self) -> impl Iterator<Item = Tile> {
        let corners = self.corners.iter().map(|corner| Vertex::new(corner.row, corner.col));
        corners.flat_map(|vertex| self.kind.tiles_around(vertex))
    }

    /// Returns the drawn tiles, and all tiles of the other colour that touch a corner.
    pub fn tiles(&self) -> BTreeSet<Tile> {
        if self.discs_mm.is_some() {
            return BTreeSet::new();
        }
        self.dark_tiles().into_iter().chain(self.tiles_around_corners()).collect()
    }

    /// Returns the dark tiles that are drawn, ordered by row, then column. They are black on white, or white on black
    /// on an inverted panel.
    pub fn dark_tiles(&self) -> Vec<Tile> {
        if self.discs_mm.is_some() {
            return Vec::new();
        }
        let dark = self.tiles_around_corners().filter(|tile| tile.is_dark());
        let mut anchors: BTreeSet<Vertex> = dark.map(|tile| tile.anchor).collect();
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
        // A tag has a tile even if it stands alone.
        let tagged = self.tags.iter().map(|tag| self.tag_tile(tag)).filter(|tile| tile.is_dark());
        anchors.extend(tagged.map(|tile| tile.anchor));
        anchors.into_iter().map(|anchor| self.kind.tag_tile(anchor)).collect()
    }

    /// Returns the bounding box of the drawn tiles or discs in the panel frame, mm: left, lower, right and upper end.
    pub fn bounds_mm(&self) -> [f64; 4] {
        let (mut least, mut most) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for vertex in self.dark_tiles().iter().flat_map(|tile| tile.vertices()) {
            let place = self.lattice_mm(vertex);
            (least, most) = (least.min(place), most.max(place));
        }
        if let Some(diameter) = self.discs_mm {
            for corner in &self.corners {
                least = least.min(corner.panel_mm - diameter / 2.0);
                most = most.max(corner.panel_mm + diameter / 2.0);
            }
        }
        [least.x, least.y, most.x, most.y]
    }

    /// Returns the width of the quiet zone around [`Self::bounds_mm`], mm. Nothing else is printed in it; on an
    /// inverted panel it is black.
    pub fn quiet_zone_mm(&self) -> f64 {
        Self::quiet_zone_at_mm(self.edge_mm)
    }

    /// Returns the bounding box with its quiet zone, mm; on an inverted panel this is the black field.
    pub fn field_mm(&self) -> [f64; 4] {
        let quiet = self.quiet_zone_mm();
        let [left, lower, right, upper] = self.bounds_mm();
        [left - quiet, lower - quiet, right + quiet, upper + quiet]
    }

    /// Returns the outline of the field, mm, counterclockwise: the rectangle of [`Self::field_mm`], or the outline
    /// around the tiles of an inverted face.
    pub fn field_outline_mm(&self) -> Vec<DVec2> {
        match self.rim_mm {
            Some(rim_mm) => self.outline_around_mm(rim_mm),
            None => rectangle(self.field_mm()).to_vec(),
        }
    }

    /// Returns the convex outline at a distance from the drawn tiles and those that touch a corner, mm,
    /// counterclockwise.
    pub fn outline_around_mm(&self, away_mm: f64) -> Vec<DVec2> {
        // Integer coordinates keep straight lines free of extra corners.
        let at = |vertex: Vertex| DVec2::new(vertex.col.into(), vertex.row.into());
        let around = hull(self.tiles().iter().flat_map(|tile| tile.vertices()).map(at).collect());
        let place = |at: DVec2| self.lattice_mm(Vertex::new(at.y as i32, at.x as i32));
        grown(&around.into_iter().map(place).collect::<Vec<_>>(), away_mm)
    }

    /// Returns the width of the quiet zone around tiles of a given edge, mm.
    #[doc(hidden)]
    pub fn quiet_zone_at_mm(edge_mm: f64) -> f64 {
        (QUIET_EDGES * edge_mm).max(QUIET_MIN_MM)
    }
}
