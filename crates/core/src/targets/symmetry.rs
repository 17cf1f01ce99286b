//! Rotations that leave a panel without tags unchanged.

use std::collections::BTreeSet;

use crate::lattice::{GridKind, LatticeMap, Vertex};
use crate::targets::Panel;

impl Panel {
    /// Returns the rotations, other than the identity, that map the corners of a panel without tags to its corners
    /// and its dark tiles to dark tiles. An image cannot distinguish these labels.
    ///
    /// A checkerboard of r × c corners has a 180° rotation if r + c is even. A square one with an even number of rows
    /// also has 90° rotations. A deltille has 120° rotations only if its outline has them, like a triangle;
    /// rectangular ones have none. Panels with tags or discs have none.
    ///
    /// ```
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let symmetries = |rows, cols| {
    ///     let spec = BoardSpec { tags: None, ..BoardSpec::checkerboard(rows, cols, 30.0) };
    ///     Target::new("board", spec).map(|board| board.panels[0].label_symmetries().len())
    /// };
    /// assert_eq!([symmetries(4, 6)?, symmetries(4, 7)?, symmetries(6, 6)?, symmetries(5, 5)?], [1, 0, 3, 1]);
    /// # Ok::<(), deltille_core::targets::TargetError>(())
    /// ```
    pub fn label_symmetries(&self) -> Vec<LatticeMap> {
        match self.tags.is_empty() && self.discs_mm.is_none() {
            true => symmetries(self.kind, self.corners.iter().map(|c| Vertex::new(c.row, c.col))),
            false => Vec::new(),
        }
    }
}

/// Returns the symmetries of corners at these vertices.
pub fn symmetries(kind: GridKind, vertices: impl IntoIterator<Item = Vertex>) -> Vec<LatticeMap> {
    let vertices: BTreeSet<Vertex> = vertices.into_iter().collect();
    let of_turns = |rotations: i32| {
        let turned = LatticeMap::new(kind, rotations, Vertex::new(0, 0));
        let first = vertices.iter().map(|&v| turned.apply(v)).min()?;
        let map = LatticeMap::new(kind, rotations, *vertices.first()? - first);
        let is_onto = vertices.iter().all(|&v| vertices.contains(&map.apply(v)));
        (is_onto && map.keeps_colours()).then_some(map)
    };
    (1..kind.steps().len() as i32).filter_map(of_turns).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::targets::board_vertices;

    #[test]
    fn symmetries_of_boards() {
        let rotations = |kind, rows, cols| -> Vec<u8> {
            let maps = symmetries(kind, board_vertices(kind, rows, cols));
            maps.into_iter().map(LatticeMap::rotations).collect()
        };
        for (rows, cols, expected) in
            [(4, 6, &[2][..]), (5, 7, &[2]), (4, 7, &[]), (6, 6, &[1, 2, 3]), (7, 7, &[2])]
        {
            assert_eq!(rotations(GridKind::Checker, rows, cols), expected, "{rows} × {cols}");
        }
        for (rows, cols) in [(4, 5), (4, 6), (5, 5), (7, 10)] {
            assert!(rotations(GridKind::Deltille, rows, cols).is_empty(), "{rows} × {cols}");
        }
        let triangle = (0..6).flat_map(|row| (0..6 - row).map(move |col| Vertex::new(row, col)));
        let of_triangle = symmetries(GridKind::Deltille, triangle);
        assert_eq!(of_triangle.into_iter().map(LatticeMap::rotations).collect::<Vec<_>>(), [2, 4]);
    }
}
