//! The tilings and their tiles.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{ROW_HEIGHT, Vertex};

/// The tiling of a grid, and the properties that depend on it.
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

/// Returns the largest integer that is not greater. Unlike [`f64::floor`], this is no function call on processors
/// without SSE 4.1, for which programs are compiled.
fn floor(value: f64) -> i32 {
    let whole = value as i32;
    whole.saturating_sub(i32::from(value < f64::from(whole)))
}

impl GridKind {
    /// Returns the steps to the neighbours of a vertex, counterclockwise on the print, starting along the row.
    pub const fn steps(self) -> &'static [Vertex] {
        match self {
            Self::Deltille => &Vertex::STEPS,
            Self::Checker => &SQUARE_STEPS,
        }
    }

    /// Returns the neighbours of a vertex, counterclockwise.
    pub fn neighbours(self, vertex: Vertex) -> impl Iterator<Item = Vertex> {
        self.steps().iter().map(move |&step| vertex + step)
    }

    /// Returns the number of rotations that map a tile onto itself, which is also the number of its vertices.
    pub const fn rotations(self) -> u8 {
        match self {
            Self::Deltille => 3,
            Self::Checker => 4,
        }
    }

    /// Returns the relative loss of edge length per unit of inset. If all edges of a tile move
    /// inwards by `part` (in tile coordinates, see [`Tile::frame`]), the fraction 1 − insets · part
    /// of an edge remains.
    pub const fn insets(self) -> f64 {
        match self {
            Self::Deltille => 3.0,
            Self::Checker => 2.0,
        }
    }

    /// Returns the centre of a tile in tile coordinates.
    pub const fn middle(self) -> DVec2 {
        DVec2::splat(1.0 / self.insets())
    }

    /// Returns the position in the plane of a vertex, or of a point between vertices, in edges: x right, y up.
    ///
    /// `x = col + row/2, y = row·√3/2` on a deltille grid, `x = col, y = row` on a checkerboard.
    pub fn position(self, row: f64, col: f64) -> DVec2 {
        match self {
            Self::Deltille => DVec2::new(col + 0.5 * row, row * ROW_HEIGHT),
            Self::Checker => DVec2::new(col, row),
        }
    }

    /// Returns the tile at a position in the plane, in edges.
    pub fn tile_at(self, DVec2 { x, y }: DVec2) -> Tile {
        let row = if self == Self::Deltille { y / ROW_HEIGHT } else { y };
        let col = if self == Self::Deltille { x - row / 2.0 } else { x };
        let anchor = Vertex::new(floor(row), floor(col));
        match self {
            Self::Checker => Tile::square(anchor),
            Self::Deltille if row - f64::from(anchor.row) + col - f64::from(anchor.col) < 1.0 => {
                Tile::upright(anchor)
            }
            Self::Deltille => Tile::inverted(anchor),
        }
    }

    /// Returns the tile that carries the tag at `anchor`.
    pub fn tag_tile(self, anchor: Vertex) -> Tile {
        match self {
            Self::Deltille => Tile::upright(anchor),
            Self::Checker => Tile::square(anchor),
        }
    }

    /// Returns the tiles whose anchor is `vertex`: two triangles, or one square.
    pub fn tiles_at(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        let second = (self == Self::Deltille).then_some(Tile::inverted(vertex));
        std::iter::once(self.tag_tile(vertex)).chain(second)
    }

    /// Returns the tiles that meet at `vertex`: three upright and three inverted ones, or four squares.
    pub fn tiles_around(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        let anchors = [(0, 0), (0, -1), (-1, 0), (-1, -1)].map(|(r, c)| vertex + Vertex::new(r, c));
        let tiles = anchors.into_iter().flat_map(move |anchor| self.tiles_at(anchor));
        tiles.filter(move |tile| tile.vertices().any(|v| v == vertex))
    }

    /// Returns the tiles whose first vertex is `vertex`. Over a set of vertices, this yields every
    /// tile whose vertices are all in the set, exactly once. The anchor of an inverted triangle is
    /// not one of its vertices.
    pub fn tiles_from(self, vertex: Vertex) -> impl Iterator<Item = Tile> {
        self.tiles_around(vertex).filter(move |tile| tile.vertices().next() == Some(vertex))
    }
}

/// The orientation of a tile among those with the same anchor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// A triangle, apex up; black on a board that is not inverted.
    Upright,
    /// A triangle, apex down; white on a board that is not inverted.
    Inverted,
    /// A square; black on a board that is not inverted where row + column of its anchor is even.
    Square,
}

/// A triangle or square of the lattice, named by its anchor vertex.
///
/// ```text
///      (r+1,c) ·───────· (r+1,c+1)               (r+1,c) ·───────· (r+1,c+1)
///             ╱█╲     ╱                                  │███████│
///            ╱███╲   ╱        upright (r,c)   █          │███████│   square (r,c): anchor at
///           ╱█████╲ ╱         inverted (r,c)             │███████│   its lower-left vertex
///    (r,c) ·───────· (r,c+1)                       (r,c) ·───────· (r,c+1)
/// ```
///
/// The anchor of a triangle is the lower-left vertex of the enclosing rhombus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Tile {
    /// Lower-left vertex of the square, or of the rhombus that encloses the triangle.
    pub anchor: Vertex,
    /// Square, or the half of the rhombus.
    pub orientation: Orientation,
}

impl Tile {
    /// Returns the upright tile whose lower-left vertex is `anchor`.
    pub const fn upright(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Upright }
    }

    /// Returns the inverted tile of the rhombus at `anchor`.
    pub const fn inverted(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Inverted }
    }

    /// Returns the square whose lower-left vertex is `anchor`.
    pub const fn square(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Square }
    }

    /// Returns the tiling of the tile.
    pub fn kind(self) -> GridKind {
        match self.orientation {
            Orientation::Upright | Orientation::Inverted => GridKind::Deltille,
            Orientation::Square => GridKind::Checker,
        }
    }

    /// Returns whether the tile is black on a board that is not inverted.
    pub fn is_dark(self) -> bool {
        match self.orientation {
            Orientation::Upright => true,
            Orientation::Inverted => false,
            Orientation::Square => (self.anchor.row + self.anchor.col) % 2 == 0,
        }
    }

    /// Returns the corners A, B, C of a tag in the tile: a point has the tile coordinates (u, v) of
    /// A + u·(B − A) + v·(C − A).
    ///
    /// An upright tile starts at its lower-left vertex, then lower right, then apex; an inverted
    /// tile is the same figure rotated by 180° and starts at its upper-right vertex. A square has
    /// its lower-left, lower-right and upper-left vertex.
    pub fn frame(self) -> [Vertex; 3] {
        let a = self.anchor;
        match self.orientation {
            Orientation::Upright | Orientation::Square => {
                [a, a + Vertex::new(0, 1), a + Vertex::new(1, 0)]
            }
            Orientation::Inverted => {
                [a + Vertex::new(1, 1), a + Vertex::new(1, 0), a + Vertex::new(0, 1)]
            }
        }
    }

    /// Returns the vertices, counterclockwise on the print, starting with A.
    pub fn vertices(self) -> impl Iterator<Item = Vertex> + Clone {
        let [a, b, c] = self.frame();
        let opposite = (self.orientation == Orientation::Square).then_some(b + c - a);
        [a, b].into_iter().chain(opposite).chain([c])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const KINDS: [GridKind; 2] = [GridKind::Deltille, GridKind::Checker];

    proptest! {
        #[test]
        fn each_tile_has_one_first_vertex(row in -9..9, col in -9..9) {
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
                    let middle = places.sum::<DVec2>() / f64::from(kind.rotations());
                    prop_assert_eq!(kind.tile_at(middle), tile);
                }
            }
        }
    }

    #[test]
    fn vertices_run_counter_clockwise() {
        let anchor = Vertex::new(2, -3);
        for tile in [Tile::upright(anchor), Tile::inverted(anchor)] {
            let [a, b, c] = tile.frame().map(Vertex::position);
            let cross = (b - a).perp_dot(c - a);
            assert!((cross - ROW_HEIGHT).abs() < 1e-12);
            assert!(tile.vertices().eq(tile.frame()));
        }
        let square = Tile::square(anchor).vertices().map(|v| v - anchor);
        assert!(square.eq([(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, c)| Vertex::new(r, c))));
    }
}
