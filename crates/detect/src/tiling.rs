//! Differences between the two tilings: N rays meet at a corner, six on a deltille grid, four on a checkerboard. Code
//! that depends only on N is generic over it.
//!
//! ```text
//!        2 ╱ 1                1          steps along the rays, counter-clockwise on the print;
//!     3 ──·── 0          2 ── · ── 0     a ray with a dark sector on its left is *even*, so from
//!        4 ╱ 5                3          corner to corner of a checkerboard the colours alternate
//! ```

use deltille_core::lattice::{GridKind, Vertex};

/// Number of rays at a corner of a deltille grid.
pub(crate) const DELTILLE: usize = 6;

/// Number of rays at a corner of a checkerboard.
pub(crate) const CHECKER: usize = 4;

/// Returns the tiling with N rays at a corner.
pub(crate) const fn kind<const N: usize>() -> GridKind {
    if N == DELTILLE { GridKind::Deltille } else { GridKind::Checker }
}

/// Returns the lattice step along direction `k`, counted modulo N.
pub(crate) fn step<const N: usize>(k: usize) -> Vertex {
    kind::<N>().steps()[k % N]
}

/// Returns the N neighbours of a vertex, counter-clockwise.
pub(crate) fn neighbours<const N: usize>(vertex: Vertex) -> [Vertex; N] {
    std::array::from_fn(|k| vertex + step::<N>(k))
}

/// Returns the vertices of the tiles whose first vertex is `vertex`, counter-clockwise.
pub(crate) fn tiles_from<const N: usize>(vertex: Vertex) -> Vec<Vec<Vertex>> {
    kind::<N>().tiles_from(vertex).map(|tile| tile.vertices().collect()).collect()
}
