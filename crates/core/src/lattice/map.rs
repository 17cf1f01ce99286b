use super::{GridKind, Orientation, Tile, Vertex};

/// A proper motion of a lattice onto itself: a rotation by a multiple of 60°, or 90° on the square lattice, then a
/// shift.
///
/// Rotations by 120° keep upright tiles upright; odd multiples of 60° exchange the two colours. On a checkerboard,
/// colours are exchanged if turns + row + column of the shift is odd. Reflections are excluded on
/// purpose: a mirrored board is an error, never a valid view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct LatticeMap {
    kind: GridKind,
    rotations: u8,
    shift: Vertex,
}

impl LatticeMap {
    /// Creates a counterclockwise rotation about vertex (0,0) by `rotations` times 60° or 90°, followed by a shift.
    pub fn new(kind: GridKind, rotations: i32, shift: Vertex) -> Self {
        let full = kind.steps().len() as i32;
        Self { kind, rotations: rotations.rem_euclid(full) as u8, shift }
    }

    /// Creates the map with a rotation of `rotations` times 60° or 90° that maps `from` to `to`.
    pub fn taking(kind: GridKind, from: Vertex, to: Vertex, rotations: i32) -> Self {
        let turned = Self::new(kind, rotations, Vertex::new(0, 0)).apply(from);
        Self::new(kind, rotations, to - turned)
    }

    /// Returns the number of counterclockwise rotations by 60° or 90°.
    pub fn rotations(self) -> u8 {
        self.rotations
    }

    /// Returns whether dark tiles map to dark tiles.
    pub fn keeps_colours(self) -> bool {
        let Vertex { row, col } = self.shift;
        let shift = match self.kind {
            GridKind::Deltille => 0,
            GridKind::Checker => row + col,
        };
        (i32::from(self.rotations) + shift) % 2 == 0
    }

    /// Returns the corresponding rotation of the plane, counterclockwise, rad.
    pub fn angle_rad(self) -> f64 {
        std::f64::consts::TAU * f64::from(self.rotations) / self.kind.steps().len() as f64
    }

    /// Maps the vertex `v`.
    pub fn apply(self, v: Vertex) -> Vertex {
        let (mut row, mut col) = (v.row, v.col);
        for _ in 0..self.rotations {
            (row, col) = match self.kind {
                // One rotation maps the column step to the row step, and the row step to row − column.
                GridKind::Deltille => (row + col, -row),
                // Here it maps the row step to the negative column step.
                GridKind::Checker => (col, -row),
            };
        }
        Vertex::new(row, col) + self.shift
    }

    /// Maps `tile`.
    pub fn apply_tile(self, tile: Tile) -> Tile {
        let [a, b, c] = tile.frame().map(|v| self.apply(v));
        let row = a.row.min(b.row).min(c.row);
        let col = a.col.min(b.col).min(c.col);
        let orientation = match (tile.orientation, self.rotations % 2) {
            (Orientation::Square, _) => Orientation::Square,
            (Orientation::Upright, 0) | (Orientation::Inverted, 1) => Orientation::Upright,
            _ => Orientation::Inverted,
        };
        Tile { anchor: Vertex::new(row, col), orientation }
    }

    /// Returns the inverse map.
    pub fn inverse(self) -> Self {
        let back = Self::new(self.kind, -i32::from(self.rotations), Vertex::new(0, 0));
        let shift = back.apply(self.shift);
        Self { shift: Vertex::new(-shift.row, -shift.col), ..back }
    }

    /// Returns the composition of this map after `first`, on the same lattice.
    pub fn after(self, first: LatticeMap) -> Self {
        let rotations = i32::from(self.rotations) + i32::from(first.rotations);
        Self::new(self.kind, rotations, self.apply(first.shift))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    prop_compose! {
        fn vertex()(row in -50..50, col in -50..50) -> Vertex { Vertex::new(row, col) }
    }

    fn kind() -> impl Strategy<Value = GridKind> {
        prop_oneof![Just(GridKind::Deltille), Just(GridKind::Checker)]
    }

    prop_compose! {
        fn maps()(kind in kind(), rotations: [u8; 2], shift in [vertex(), vertex()]) -> [LatticeMap; 2] {
            [0, 1].map(|i| LatticeMap::new(kind, rotations[i].into(), shift[i]))
        }
    }

    proptest! {
        #[test]
        fn maps_are_rigid_and_keep_handedness([m, _] in maps(), v in vertex(), step in 0..6usize) {
            let steps = m.kind.steps();
            let next = |k: usize| v + steps[k % steps.len()];
            let [p, q, r] = [v, next(step), next(step + 1)].map(|v| {
                let Vertex { row, col } = m.apply(v);
                m.kind.position(row.into(), col.into())
            });
            let cross = (q - p).perp_dot(r - p);
            let angle = std::f64::consts::TAU / steps.len() as f64;
            prop_assert!((cross - angle.sin()).abs() < 1e-9);
        }

        #[test]
        fn inverse_and_composition([m, n] in maps(), v in vertex()) {
            prop_assert_eq!(m.inverse().apply(m.apply(v)), v);
            prop_assert_eq!(m.after(n).apply(v), m.apply(n.apply(v)));
            prop_assert_eq!(m.after(m.inverse()), LatticeMap::new(m.kind, 0, Vertex::new(0, 0)));
        }

        #[test]
        fn tiles_go_where_their_vertices_go([m, _] in maps(), v in vertex()) {
            for tile in m.kind.tiles_at(v) {
                let mut by_vertices: Vec<Vertex> = tile.vertices().map(|v| m.apply(v)).collect();
                let mut by_tile: Vec<Vertex> = m.apply_tile(tile).vertices().collect();
                by_vertices.sort();
                by_tile.sort();
                prop_assert_eq!(by_vertices, by_tile);
            }
        }

        #[test]
        fn taking_maps_from_to_to(kind in kind(), from in vertex(), to in vertex(), rotations in -9..9) {
            prop_assert_eq!(LatticeMap::taking(kind, from, to, rotations).apply(from), to);
        }
    }
}
