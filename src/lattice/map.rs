use super::{Orientation, Tile, Vertex};

/// A proper motion of the lattice onto itself: a turn by a multiple of 60°, then a shift.
///
/// Turns by 120° keep upright tiles upright; odd multiples of 60° exchange the two colours.
/// Reflections are left out on purpose: a mirrored board is an error, never a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LatticeMap {
    turns: u8,
    shift: Vertex,
}

impl LatticeMap {
    /// The map that leaves everything where it is.
    pub const IDENTITY: LatticeMap = LatticeMap { turns: 0, shift: Vertex::new(0, 0) };

    /// A counter-clockwise turn about vertex (0,0) by `turns` times 60°, then a shift.
    pub fn new(turns: i32, shift: Vertex) -> Self {
        Self { turns: turns.rem_euclid(6) as u8, shift }
    }

    /// The map with `turns` times 60° that takes `from` to `to`.
    pub fn taking(from: Vertex, to: Vertex, turns: i32) -> Self {
        let turned = Self::new(turns, Vertex::new(0, 0)).apply(from);
        Self::new(turns, to - turned)
    }

    /// Number of counter-clockwise turns by 60°, 0 to 5.
    pub fn turns(self) -> u8 {
        self.turns
    }

    /// Where `v` goes.
    pub fn apply(self, v: Vertex) -> Vertex {
        // One turn sends the column step to the row step, and the row step to row − column.
        let (mut row, mut col) = (v.row, v.col);
        for _ in 0..self.turns {
            (row, col) = (row + col, -row);
        }
        Vertex::new(row, col) + self.shift
    }

    /// Where `tile` goes.
    pub fn apply_tile(self, tile: Tile) -> Tile {
        let [a, b, c] = tile.vertices().map(|v| self.apply(v));
        let row = a.row.min(b.row).min(c.row);
        let col = a.col.min(b.col).min(c.col);
        let flips = self.turns % 2 == 1;
        let orientation = match (tile.orientation, flips) {
            (Orientation::Upright, false) | (Orientation::Inverted, true) => Orientation::Upright,
            _ => Orientation::Inverted,
        };
        Tile { anchor: Vertex::new(row, col), orientation }
    }

    /// The map that undoes this one.
    pub fn inverse(self) -> Self {
        let back = Self::new(-i32::from(self.turns), Vertex::new(0, 0));
        let shift = back.apply(self.shift);
        Self { turns: back.turns, shift: Vertex::new(-shift.row, -shift.col) }
    }

    /// This map after `first`.
    pub fn after(self, first: LatticeMap) -> Self {
        Self::new(i32::from(self.turns) + i32::from(first.turns), self.apply(first.shift))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    prop_compose! {
        fn vertex()(row in -50..50, col in -50..50) -> Vertex { Vertex::new(row, col) }
    }
    prop_compose! {
        fn map()(turns in 0..6, shift in vertex()) -> LatticeMap { LatticeMap::new(turns, shift) }
    }

    proptest! {
        #[test]
        fn maps_are_rigid_and_keep_handedness(m in map(), v in vertex(), step in 0..6usize) {
            let (a, b, c) = (v, v + Vertex::STEPS[step], v + Vertex::STEPS[(step + 1) % 6]);
            let [p, q, r] = [a, b, c].map(|v| m.apply(v).position());
            let cross = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            prop_assert!((cross - crate::lattice::ROW_HEIGHT).abs() < 1e-9);
        }

        #[test]
        fn inverse_and_composition(m in map(), n in map(), v in vertex()) {
            prop_assert_eq!(m.inverse().apply(m.apply(v)), v);
            prop_assert_eq!(m.after(n).apply(v), m.apply(n.apply(v)));
            prop_assert_eq!(m.after(m.inverse()), LatticeMap::IDENTITY);
        }

        #[test]
        fn tiles_go_where_their_vertices_go(m in map(), v in vertex(), upright: bool) {
            let tile = if upright { Tile::upright(v) } else { Tile::inverted(v) };
            let mut by_vertices = tile.vertices().map(|v| m.apply(v));
            let mut by_tile = m.apply_tile(tile).vertices();
            by_vertices.sort();
            by_tile.sort();
            prop_assert_eq!(by_vertices, by_tile);
        }

        #[test]
        fn taking_takes(from in vertex(), to in vertex(), turns in -9..9) {
            prop_assert_eq!(LatticeMap::taking(from, to, turns).apply(from), to);
        }
    }
}
