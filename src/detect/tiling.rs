//! Where the two tilings differ: N rays meet at a corner, six of a deltille grid, four of a
//! checkerboard. What follows from N alone is written once, generic over it.
//!
//! ```text
//!        2 ╱ 1                1          steps along the rays, counter-clockwise on the print;
//!     3 ──·── 0          2 ── · ── 0     a ray with a dark sector on its left is *even*, so from
//!        4 ╱ 5                3          corner to corner of a checkerboard the colours alternate
//! ```

use crate::lattice::{Tile, Vertex};
use crate::target::GridKind;

/// Rays at a corner of a deltille grid.
pub const DELTILLE: usize = 6;

/// Rays at a corner of a checkerboard.
pub const CHECKER: usize = 4;

/// The steps to the four neighbours on a square lattice, counter-clockwise, starting along the row.
const SQUARE_STEPS: [Vertex; CHECKER] =
    [Vertex::new(0, 1), Vertex::new(1, 0), Vertex::new(0, -1), Vertex::new(-1, 0)];

/// The tiling with N rays at a corner.
pub const fn kind<const N: usize>() -> GridKind {
    if N == DELTILLE { GridKind::Deltille } else { GridKind::Checker }
}

/// The step along direction `k` of the lattice, counted modulo N.
pub fn step<const N: usize>(k: usize) -> Vertex {
    match kind::<N>() {
        GridKind::Deltille => Vertex::STEPS[k % N],
        GridKind::Checker => SQUARE_STEPS[k % N],
    }
}

/// The N neighbours of a vertex, counter-clockwise.
pub fn neighbours<const N: usize>(vertex: Vertex) -> [Vertex; N] {
    std::array::from_fn(|k| vertex + step::<N>(k))
}

/// Vertices of the tiles whose lowest, leftmost vertices are at `vertex`, counter-clockwise.
pub fn tiles_at<const N: usize>(vertex: Vertex) -> Vec<Vec<Vertex>> {
    match kind::<N>() {
        GridKind::Deltille => [Tile::upright(vertex), Tile::inverted(vertex)]
            .map(|tile| tile.vertices().to_vec())
            .to_vec(),
        GridKind::Checker => {
            vec![[(0, 0), (0, 1), (1, 1), (1, 0)].map(|(r, c)| vertex + Vertex::new(r, c)).to_vec()]
        }
    }
}
