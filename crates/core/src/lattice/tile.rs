use serde::{Deserialize, Serialize};

use super::{GridKind, Vertex};

/// Which tile of those with the same anchor.
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
/// The anchor of a triangle is the lower-left vertex of the rhombus that holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Tile {
    /// The lower-left vertex of the square, or of the rhombus that holds the triangle.
    pub anchor: Vertex,
    /// Square, or which half of the rhombus.
    pub orientation: Orientation,
}

impl Tile {
    /// The upright tile whose lower-left vertex is `anchor`.
    pub const fn upright(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Upright }
    }

    /// The inverted tile of the rhombus at `anchor`.
    pub const fn inverted(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Inverted }
    }

    /// The square whose lower-left vertex is `anchor`.
    pub const fn square(anchor: Vertex) -> Self {
        Self { anchor, orientation: Orientation::Square }
    }

    /// The tiling that it is of.
    pub fn kind(self) -> GridKind {
        match self.orientation {
            Orientation::Upright | Orientation::Inverted => GridKind::Deltille,
            Orientation::Square => GridKind::Checker,
        }
    }

    /// Whether the tile is black on a board that is not inverted.
    pub fn is_dark(self) -> bool {
        match self.orientation {
            Orientation::Upright => true,
            Orientation::Inverted => false,
            Orientation::Square => (self.anchor.row + self.anchor.col) % 2 == 0,
        }
    }

    /// The corners A, B, C of a tag in the tile: a point has the tile coordinates (u, v) of
    /// A + u·(B − A) + v·(C − A).
    ///
    /// An upright tile starts at its lower-left vertex, then lower right, then apex; an inverted
    /// tile is the same figure turned by 180° and starts at its upper-right vertex. A square has
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

    /// The vertices, counter-clockwise on the print, from A on.
    pub fn vertices(self) -> impl Iterator<Item = Vertex> + Clone {
        let [a, b, c] = self.frame();
        let opposite = (self.orientation == Orientation::Square).then_some(b + c - a);
        [a, b].into_iter().chain(opposite).chain([c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_run_counter_clockwise() {
        let anchor = Vertex::new(2, -3);
        for tile in [Tile::upright(anchor), Tile::inverted(anchor)] {
            let [a, b, c] = tile.frame().map(Vertex::position);
            let cross = (b - a).perp_dot(c - a);
            assert!((cross - super::super::ROW_HEIGHT).abs() < 1e-12);
            assert!(tile.vertices().eq(tile.frame()));
        }
        let square = Tile::square(anchor).vertices().map(|v| v - anchor);
        assert!(square.eq([(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, c)| Vertex::new(r, c))));
    }
}
