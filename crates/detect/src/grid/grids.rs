//! Finds all grids of an image: grown, filled and joined, with each corner in one of them.

use std::collections::BTreeMap;

use glam::DVec2;

use super::effort::Effort;
use super::gaps::fill::fill_gaps;
use super::grow::{Growth, Place, Placed, seeds};
use super::links::link::links;
use super::outer_edges::trim;
use super::outline::WholeBoard;
use super::parts::join;
use super::saddle_grid::{Growing, GrownSaddle, PlacedSaddle, SaddleGrid};
use crate::corners::buckets::Buckets;
use crate::corners::saddles::{Saddle, SaddleFinder, merge_px, too_many};
use crate::tiling::tiles_from;
use deltille_core::lattice::Vertex;
use deltille_core::raster::Pyramid;

/// Distance below which corners are the same, as a fraction of the distance to the nearest neighbour. Under blur and
/// motion, a corner may be detected twice.
const SAME_PART: f64 = 0.2;

/// Returns all grids among the saddle points, by lattice vertex, the largest first. The result is
/// empty if there are more saddle points than any board has. Gaps of a grid and its surroundings
/// are searched for missing corners, unless a grid shows the `whole` board.
pub(crate) fn grids<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    saddles: &[Saddle<N>],
    whole: Option<&WholeBoard>,
) -> Vec<SaddleGrid> {
    if too_many(pyramid, saddles.len()) {
        return Vec::new();
    }
    let links = links(pyramid, saddles);
    let mut growth = Growth::new(&links);
    let mut effort = Effort::default();
    let finest = &pyramid.levels()[0];
    let no_places = Buckets::new(finest.width(), finest.height());
    let mut index = no_places.clone();
    saddles.iter().for_each(|saddle| index.insert(saddle.position));
    let (mut growing, mut members) = (Vec::new(), Vec::new());
    for seed in seeds(&links) {
        if seed.iter().any(|placed| growth.taken[placed.corner]) {
            continue;
        }
        let places = growth.grow(&seed);
        let mut own: BTreeMap<usize, Vertex> =
            places.iter().map(|placed| (placed.corner, placed.place.vertex)).collect();
        let placed = places.into_iter().map(|Placed { corner, place: Place { vertex, turn } }| {
            (vertex, GrownSaddle { saddle: saddles[corner], turn })
        });
        let mut grid: Growing<N> = placed.collect();
        if !whole.is_some_and(|whole| whole.is_shown_by(&grid)) {
            fill_gaps(finder, pyramid, &mut grid, &mut effort);
        }
        // A corner found in a gap may be a known saddle point that was not linked. It is dropped if another grid has
        // that point, or if it is in this grid under another vertex.
        grid.retain(|&vertex, grown| match same(&index, &grown.saddle) {
            Some(corner) if growth.taken[corner] => false,
            Some(corner) => *own.entry(corner).or_insert(vertex) == vertex,
            None => true,
        });
        own.keys().for_each(|&corner| growth.taken[corner] = true);
        growing.push(grid);
        members.push(own);
    }
    let mut grids: Vec<SaddleGrid> = join(pyramid, saddles, &index, growing, members, &mut effort)
        .into_iter()
        .map(|(mut grid, has_grown)| {
            if has_grown {
                fill_gaps(finder, pyramid, &mut grid, &mut effort);
            }
            trim(pyramid, &mut grid);
            grid.into_iter().map(|(v, grown)| (v, plain(&grown))).collect()
        })
        .collect();
    grids.sort_by_key(|grid: &SaddleGrid| std::cmp::Reverse(grid.len()));
    let mut grids = without_tag_cells::<N>(grids);
    each_once(&mut grids, no_places);
    grids
}

/// Returns a corner without the data that only growing needs.
fn plain<const N: usize>(grown: &GrownSaddle<N>) -> PlacedSaddle {
    PlacedSaddle { position: grown.saddle.position, amplitude: grown.saddle.sectors.amplitude }
}

/// Returns the index of the nearest known saddle point that counts as the same as `saddle`.
fn same<const N: usize>(places: &Buckets, saddle: &Saddle<N>) -> Option<usize> {
    let near = places.within(saddle.position, merge_px(saddle.level));
    near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map(|(i, _)| i)
}

/// Removes corners that also are in a larger grid, or under another vertex of the same grid. `places` is an empty index
/// over the image, to which the remaining positions are added.
fn each_once(grids: &mut Vec<SaddleGrid>, mut places: Buckets) {
    for grid in grids.iter_mut() {
        let whole = grid.clone();
        grid.retain(|&vertex, placed| {
            let position = placed.position;
            let neighbours = Vertex::STEPS.iter().filter_map(|&step| whole.get(&(vertex + step)));
            let nearest_px = neighbours
                .map(|neighbour| neighbour.position.distance(position))
                .reduce(f64::min)
                .unwrap_or(0.0);
            let is_new = places.within(position, SAME_PART * nearest_px).next().is_none();
            if is_new {
                places.insert(position);
            }
            is_new
        });
    }
    grids.retain(|grid| !grid.is_empty());
}

/// Drops every grid that lies within a single tile of a larger one, because the cells of a tag form a tiling, too.
/// `grids` are sorted with the largest first.
fn without_tag_cells<const N: usize>(mut grids: Vec<SaddleGrid>) -> Vec<SaddleGrid> {
    if grids.len() < 2 {
        return grids;
    }
    let tiles = grids
        .iter()
        .enumerate()
        .flat_map(|(i, grid)| tiles_of::<N>(grid).map(move |tile| (i, tile)));
    let tiles: Vec<(usize, Vec<DVec2>)> = tiles.collect();
    let middle = |tile: &[DVec2]| tile.iter().sum::<DVec2>() / tile.len() as f64;
    let middles: Vec<DVec2> = tiles.iter().map(|(_, tile)| middle(tile)).collect();
    let from_middle = tiles
        .iter()
        .zip(&middles)
        .flat_map(|((_, tile), &middle)| tile.iter().map(move |p| p.distance(middle)));
    let reach_px = from_middle.fold(0.0, f64::max);
    let middles = Buckets::of(&middles);
    let mut index = 0..;
    grids.retain(|grid| {
        let own = index.next();
        let Some(first) = grid.values().next() else {
            return false;
        };
        // The larger grid may be dropped itself. Its tile then lies in the tile of a third grid, which contains this
        // one as well.
        !middles.within(first.position, reach_px).any(|(index, _)| {
            let (i, tile) = &tiles[index];
            Some(*i) < own && grid.values().all(|placed| is_inside(tile, placed.position))
        })
    });
    grids
}

/// Returns the vertex positions, px, of every complete tile of a grid.
fn tiles_of<const N: usize>(grid: &SaddleGrid) -> impl Iterator<Item = Vec<DVec2>> {
    let place = |v: &Vertex| grid.get(v).map(|p| p.position);
    let tiles = grid.keys().flat_map(|&v| tiles_from::<N>(v));
    tiles.filter_map(move |tile| tile.iter().map(place).collect())
}

/// Returns whether a point lies within a tile, px. Vertices that are counter-clockwise on the print have a negative
/// signed area in the image, where y runs down.
fn is_inside(tile: &[DVec2], p: DVec2) -> bool {
    (0..tile.len()).all(|i| {
        let (a, b) = (tile[i], tile[(i + 1) % tile.len()]);
        (b - a).perp_dot(p - a) < 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tiling::{CHECKER, DELTILLE};
    use deltille_core::lattice::GridKind;

    /// Creates a lattice of rows and columns about a position, with edges of this length, px.
    fn lattice(kind: GridKind, side: i32, origin: [f64; 2], edge_px: f64) -> SaddleGrid {
        let corner = |row: i32, col: i32| {
            let place = kind.position(f64::from(row), f64::from(col));
            let position = DVec2::from(origin) + edge_px * place * DVec2::new(1.0, -1.0);
            (Vertex::new(row, col), PlacedSaddle { position, amplitude: 100.0 })
        };
        (0..side).flat_map(|row| (0..side).map(move |col| corner(row, col))).collect()
    }

    /// Cells of a tag lie in one tile of the grid around them. A grid beside another, or across its
    /// edges, is kept.
    #[test]
    fn only_grids_within_one_tile_of_a_larger_grid_are_dropped() {
        fn check<const N: usize>(kind: GridKind) {
            let board = lattice(kind, 6, [100.0, 900.0], 100.0);
            // The centre of a tile, the midpoint of an edge, and a point outside.
            let [in_tile, on_edge, beside] = match kind {
                GridKind::Deltille => [[245.0, 875.0], [250.0, 905.0], [1500.0, 500.0]],
                GridKind::Checker => [[240.0, 870.0], [240.0, 905.0], [1500.0, 500.0]],
            };
            let of_tag = |at| lattice(kind, 3, at, 5.0);
            let grids = vec![board.clone(), of_tag(in_tile), of_tag(on_edge), of_tag(beside)];
            let kept = without_tag_cells::<N>(grids);
            assert_eq!(kept, [board, of_tag(on_edge), of_tag(beside)], "{kind:?}");
        }
        check::<DELTILLE>(GridKind::Deltille);
        check::<CHECKER>(GridKind::Checker);
    }

    #[test]
    fn a_grid_alone_is_never_dropped() {
        let board = lattice(GridKind::Deltille, 4, [10.0, 90.0], 20.0);
        assert_eq!(without_tag_cells::<DELTILLE>(vec![board.clone()]), [board]);
        assert_eq!(without_tag_cells::<DELTILLE>(Vec::new()), []);
    }
}
