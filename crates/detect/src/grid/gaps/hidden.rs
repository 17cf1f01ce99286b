//! Predicts corners that an occluder hides in tiles whose other corners are visible, so that tags in them can be read.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::grid::map::maps::Maps;
use crate::grid::saddle_grid::{PlacedSaddle, SaddleGrid};
use crate::tiling::{neighbours, tiles_from};
use deltille_core::lattice::Vertex;

/// Maximum standard deviation of a predicted corner, in edges: a third of a cell of a tag.
const MAX_SIGMA: f64 = 0.03;

/// Returns the hidden corners of tiles of which a grid has all corners but one.
pub(crate) fn hidden_corners<const N: usize>(grid: &SaddleGrid) -> SaddleGrid {
    let at = |v: Vertex| -> Option<DVec2> { grid.get(&v).map(|placed| placed.position) };
    let firsts: BTreeSet<Vertex> =
        grid.keys().flat_map(|&v| neighbours::<N>(v)).chain(grid.keys().copied()).collect();
    let mut hidden: BTreeMap<Vertex, f64> = BTreeMap::new();
    for tile in firsts.into_iter().flat_map(tiles_from::<N>) {
        let mut missing = tile.iter().filter(|v| !grid.contains_key(v));
        if let (Some(&vertex), None) = (missing.next(), missing.next()) {
            let seen = tile.iter().filter_map(|v| Some(grid.get(v)?.amplitude));
            hidden.insert(vertex, seen.fold(f64::INFINITY, f64::min));
        }
    }
    let maps = Maps::of::<N>(grid.keys().copied(), at, 0);
    let predicted = hidden.into_iter().filter_map(|(vertex, amplitude)| {
        let position = maps.about::<N>(vertex, at, MAX_SIGMA)?.place;
        Some((vertex, PlacedSaddle { position, amplitude }))
    });
    predicted.collect()
}
