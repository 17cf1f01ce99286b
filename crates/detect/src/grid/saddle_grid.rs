//! Grids of corners: with the half-edges of each corner while they grow, and in the form that later stages need.

use std::collections::BTreeMap;

use glam::DVec2;

use crate::corners::saddles::Saddle;
use deltille_core::lattice::Vertex;

/// A corner of either tiling, as later stages need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlacedSaddle {
    /// Position, px.
    pub position: DVec2,
    /// Half the difference of the grey values of bright and dark tiles around it.
    pub amplitude: f64,
}

/// Corners by lattice vertex.
pub(crate) type SaddleGrid = BTreeMap<Vertex, PlacedSaddle>;

/// Returns the mirror image of a vertex: rows and columns are exchanged, which leaves upright tiles upright and dark
/// squares dark.
pub(crate) fn mirrored(vertex: Vertex) -> Vertex {
    Vertex::new(vertex.col, vertex.row)
}

/// Returns a grid with mirrored vertices. This corrects the grid of a mirrored image.
pub(crate) fn mirror_image(grid: &SaddleGrid) -> SaddleGrid {
    grid.iter().map(|(&vertex, &placed)| (mirrored(vertex), placed)).collect()
}

/// A corner in a growing grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GrownSaddle<const N: usize> {
    /// The corner.
    pub saddle: Saddle<N>,
    /// Ray k points along step `k + turn` (mod N) of the lattice.
    pub turn: usize,
}

impl<const N: usize> GrownSaddle<N> {
    /// Returns the index of the ray along step `k` of the lattice.
    pub(crate) fn ray(&self, k: usize) -> usize {
        (k + N - self.turn) % N
    }
}

/// A growing grid.
pub(crate) type Growing<const N: usize> = BTreeMap<Vertex, GrownSaddle<N>>;
