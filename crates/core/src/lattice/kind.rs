use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{ROW_HEIGHT, Tile, Vertex};

/// Which tiling a grid is, and what follows from that.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum GridKind {
    /// Triangles; six tiles meet at a corner.
    #[default]
    Deltille,
    /// Squares; four tiles meet at a corner.
    Checker,
}

/// The steps to the four neighbours on the square lattice.
const SQUARE_STEPS: [Vertex; 4] =
    [Vertex::new(0, 1), Vertex::new(1, 0), Vertex::new(0, -1), Vertex::new(-1, 0)];

impl GridKind {
    /// The steps to the neighbours of a vertex, counter-clockwise on the print, starting along the
    /// row.
    pub const fn steps(self) -> &'static [Vertex] {
        match self {
            Self::Deltille => &Vertex::STEPS,
            Self::Checker => &SQUARE_STEPS,
        }
    }

    /// The neighbours of a vertex, counter-clockwise.
    pub fn neighbours(self, vertex: Vertex) -> impl Iterator<Item = Vertex> {
        self.steps().iter().map(move |&step| vertex + step)
    }

    /// How many turns take a tile onto itself, which is also the number of its vertices.
    pub const fn turns(self) -> u8 {
        match self {
            Self::Deltille => 3,
            Self::Checker => 4,
        }
    }

    /// How many edge lengths, of 1 along an edge, are lost when all edges of a tile move inside by a
    /// part of it (in tile coordinates, see [`Tile::frame`]): 1 − insets · part is left.
    pub const fn insets(self) -> f64 {
        match self {
            Self::Deltille => 3.0,
            Self::Checker => 2.0,
        }
    }

    /// The middle of a tile in tile coordinates.
    pub const fn middle(self) -> DVec2 {
        DVec2::splat(1.0 / self.insets())
    }

    /// Position in the plane of a vertex, or of a place between vertices, in edges: x right, y up.
    ///
    /// `x = col + row/2, y = row·√3/2` on a deltille grid, `x = col, y = row` on a checkerboard.
    pub fn position(self, row: f64, col: f64) -> DVec2 {
        match self {
            Self::Deltille => DVec2::new(col + 0.5 * row, row * ROW_HEIGHT),
            Self::Checker => DVec2::new(col, row),
        }
    }

    /// The tile at a position in the plane, in edges.
    pub fn tile_at(self, DVec2 { x, y }: DVec2) -> Tile {
        let row = if self == Self::Deltille { y / ROW_HEIGHT } else { y };
        let col = if self == Self::Deltille { x - row / 2.0 } else { x };
        let anchor = Vertex::new(row.floor() as i32, col.floor() as i32);
        match self {
            Self::Checker => Tile::square(anchor),
            Self::Deltille if row - row.floor() + col - col.floor() < 1.0 => Tile::upright(anchor),
            Self::Deltille => Tile::inverted(anchor),
        }
    }

    /// The tile that carries the tag whose place is `anchor`.
    pub fn tag_tile(self, anchor: Vertex) -> Tile {
        match self {
            Self::Deltille => Tile::upright(anchor),
            Self::Checker => Tile::square(anchor),
        }
    }

    /// The tiles whose anchor is `vertex`: two triangles, or one square.
    pub fn tiles_at(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        let second = (self == Self::Deltille).then_some(Tile::inverted(vertex));
        std::iter::once(self.tag_tile(vertex)).chain(second)
    }

    /// The tiles that meet at `vertex`: three upright and three inverted ones, or four squares.
    pub fn tiles_around(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        let anchors = [(0, 0), (0, -1), (-1, 0), (-1, -1)].map(|(r, c)| vertex + Vertex::new(r, c));
        let tiles = anchors.into_iter().flat_map(move |anchor| self.tiles_at(anchor));
        tiles.filter(move |tile| tile.vertices().any(|v| v == vertex))
    }

    /// The tiles whose first vertex is `vertex`. Of a set of vertices they are all tiles that have none but these, each
    /// once; the anchor of an inverted triangle is none of its vertices.
    pub fn tiles_from(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        self.tiles_around(vertex).filter(move |tile| tile.vertices().next() == Some(vertex))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const KINDS: [GridKind; 2] = [GridKind::Deltille, GridKind::Checker];

    proptest! {
        #[test]
        fn each_tile_comes_from_one_of_its_vertices(row in -9..9, col in -9..9) {
            for kind in KINDS {
                for tile in kind.tiles_around(Vertex::new(row, col)) {
                    let from = tile.vertices().flat_map(|v| kind.tiles_from(v));
                    prop_assert_eq!(from.filter(|&other| other == tile).count(), 1);
                }
            }
        }

        #[test]
        fn as_many_tiles_as_neighbours_meet_at_a_vertex(row in -9..9, col in -9..9) {
            for kind in KINDS {
                let around: Vec<Tile> = kind.tiles_around(Vertex::new(row, col)).collect();
                prop_assert_eq!(around.len(), kind.steps().len());
                let dark = around.iter().filter(|tile| tile.is_dark()).count();
                prop_assert_eq!(2 * dark, around.len());
            }
        }

        #[test]
        fn the_middle_of_a_tile_lies_in_it(row in -9..9, col in -9..9) {
            for kind in KINDS {
                for tile in kind.tiles_at(Vertex::new(row, col)) {
                    let places = tile.vertices().map(|v| kind.position(v.row.into(), v.col.into()));
                    let middle = places.sum::<DVec2>() / f64::from(kind.turns());
                    prop_assert_eq!(kind.tile_at(middle), tile);
                }
            }
        }
    }
}
