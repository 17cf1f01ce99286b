use serde::{Deserialize, Serialize};

use super::Vertex;

/// Which way a tile points on the print.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// Apex up; black on a board that is not inverted.
    Upright,
    /// Apex down; white on a board that is not inverted.
    Inverted,
}

/// A triangle of the lattice, named by its anchor vertex.
///
/// ```text
///      (r+1,c) ·───────· (r+1,c+1)
///             ╱█╲     ╱
///            ╱███╲   ╱        upright (r,c)   █   anchor at its lower-left vertex
///           ╱█████╲ ╱         inverted (r,c)      the other half of the same rhombus
///    (r,c) ·───────· (r,c+1)
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Tile {
    /// The lower-left vertex of the rhombus that holds the tile.
    pub anchor: Vertex,
    /// Which half of the rhombus.
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

    /// The three vertices, counter-clockwise on the print.
    ///
    /// An upright tile starts at its lower-left vertex, then lower right, then apex: the corners
    /// A, B, C of a tag. An inverted tile is the same figure turned by 180° and starts at its
    /// upper-right vertex.
    pub fn vertices(self) -> [Vertex; 3] {
        let a = self.anchor;
        match self.orientation {
            Orientation::Upright => [a, a + Vertex::new(0, 1), a + Vertex::new(1, 0)],
            Orientation::Inverted => {
                [a + Vertex::new(1, 1), a + Vertex::new(1, 0), a + Vertex::new(0, 1)]
            }
        }
    }

    /// The three upright tiles that meet at `vertex`.
    pub fn upright_around(vertex: Vertex) -> [Tile; 3] {
        [Vertex::new(0, 0), Vertex::new(0, -1), Vertex::new(-1, 0)]
            .map(|step| Tile::upright(vertex + step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_run_counter_clockwise() {
        for tile in [Tile::upright(Vertex::new(2, -3)), Tile::inverted(Vertex::new(2, -3))] {
            let [a, b, c] = tile.vertices().map(Vertex::position);
            let cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!((cross - super::super::ROW_HEIGHT).abs() < 1e-12);
        }
    }

    #[test]
    fn three_upright_tiles_share_a_vertex() {
        let v = Vertex::new(4, 7);
        assert!(Tile::upright_around(v).iter().all(|tile| tile.vertices().contains(&v)));
    }
}
