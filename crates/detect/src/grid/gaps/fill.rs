//! Searches for missing corners at empty vertices of a grid and around it, where their neighbours predict them.

use std::collections::BTreeSet;

use glam::DVec2;

use super::edge_crossing::{EdgeCrossing, Neighbour};
use super::rectified::Rectified;
use crate::corners::saddles::{Saddle, SaddleFinder};
use crate::corners::sectors::{Sectors, turn};
use crate::grid::effort::Effort;
use crate::grid::links::edge::{End, MAX_CHORD_RAD, is_clean_somehow};
use crate::grid::links::link::{facing_ray, have_similar_contrast};
use crate::grid::map::local_map::{LocalMap, Shape};
use crate::grid::map::spacing::Spacing;
use crate::grid::saddle_grid::{Growing, GrownSaddle};
use crate::grid::untagged::checker_tiles::parity;
use crate::tiling::{kind, neighbours, step};
use deltille_core::lattice::Vertex;
use deltille_core::raster::Pyramid;

/// Maximum distance of a missing corner from its predicted position, as a fraction of the edge length there.
const MAX_SURPRISE: f64 = 0.2;

/// Effort of a search for a missing corner in the image and in several rectified views of it.
const LOOKS_FOR_CORNER: usize = 20;

/// Searches for corners at the empty vertices within a grid and around it, until no more are found.
pub(crate) fn fill_gaps<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    grid: &mut Growing<N>,
    effort: &mut Effort,
) {
    let mut tried = BTreeSet::new();
    loop {
        let empty: BTreeSet<Vertex> = grid
            .keys()
            .flat_map(|&v| neighbours::<N>(v))
            .filter(|v| !grid.contains_key(v) && !tried.contains(v))
            .collect();
        let mut grown = false;
        let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
        let spacing = Spacing::of(kind::<N>(), grid.keys().copied(), at);
        for vertex in empty {
            let Some(predicted) = predict(grid, spacing, vertex) else {
                continue;
            };
            if let Some(placed) = corner_near(finder, pyramid, grid, vertex, predicted, effort) {
                grid.insert(vertex, placed);
                grown = true;
                // The vertices around it have new predictions, so they are tried again.
                tried.retain(|v: &Vertex| !neighbours::<N>(vertex).contains(v));
            } else {
                tried.insert(vertex);
            }
        }
        if !grown {
            return;
        }
    }
}

/// Prediction of a missing corner.
#[derive(Clone, Copy, Debug)]
struct Predicted {
    /// Its position, px.
    position: DVec2,
    /// Length of an edge there, px.
    edge_px: f64,
    /// Spacing of the grid.
    spacing: Spacing,
}

/// Predicts a missing corner as the mean of the predictions of the rows through `vertex`. If p, q, r are the next three
/// corners of a row, the position is
///
/// ```text
///     3 p − 3 q + r        a row that bends evenly (its second difference is constant)
///     2 p − q              where r is missing: a straight row with equal edges
/// ```
///
/// or the same polynomials with the spacing of the grid.
///
/// If fewer than two rows predict it, a local map of the corners around is used, provided that there are two
/// neighbours. Otherwise returns `None`.
fn predict<const N: usize>(
    grid: &Growing<N>,
    spacing: Spacing,
    vertex: Vertex,
) -> Option<Predicted> {
    let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
    let mut sum = DVec2::ZERO;
    let (mut count, mut edge) = (0.0, 0.0);
    for step in (0..N).map(step::<N>) {
        let first = vertex + step;
        let second = first + step;
        let (Some(p), Some(q)) = (at(first), at(second)) else {
            continue;
        };
        let width = |from: Vertex| spacing.width(from, step);
        let (to_p, pq) = (width(vertex), width(first));
        let slope = (p - q) / pq;
        let bend = at(second + step).map_or(DVec2::ZERO, |r| {
            let qr = width(second);
            (slope - (q - r) / qr) / (pq + qr)
        });
        sum += p + to_p * (slope + (to_p + pq) * bend);
        edge += slope.length() * to_p.min(pq);
        count += 1.0;
    }
    if count >= 2.0 {
        return Some(Predicted { position: sum / count, edge_px: edge / count, spacing });
    }
    // The seed of a grid has no rows yet, but has two corners next to the vertex.
    let beside: Vec<DVec2> = neighbours::<N>(vertex).into_iter().filter_map(at).collect();
    let map =
        (beside.len() >= 2).then(|| LocalMap::about::<N>(vertex, at, Shape::usual(spacing)))??;
    let px = |p: &DVec2| (p.x - map.place.x).hypot(p.y - map.place.y);
    let edge_px = beside.iter().map(px).sum::<f64>() / beside.len() as f64;
    Some(Predicted { position: map.place, edge_px, spacing })
}

/// Returns the corner at `vertex`, if one is found near its prediction. The search uses the image.
/// For a board at a steep angle, it uses a view rectified by the edges to the neighbours. If there is no saddle, the
/// edges may still meet.
fn corner_near<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    Predicted { position, edge_px, spacing }: Predicted,
    effort: &mut Effort,
) -> Option<GrownSaddle<N>> {
    if !effort.spend(LOOKS_FOR_CORNER) {
        return None;
    }
    let reach = (MAX_SURPRISE * edge_px).max(1.0);
    let neighbours = neighbours::<N>(vertex);
    // A blurred corner is found best on the pyramid level of its neighbours.
    let levels = neighbours.iter().filter_map(|v| Some(grid.get(v)?.saddle.level));
    let level = levels.max().unwrap_or(0);
    let meeting = |place| met_by_edges(pyramid, grid, spacing, vertex, place, level);
    let at_place = |saddle: Saddle<N>| {
        placed_at(pyramid, grid, vertex, saddle).or_else(|| meeting(saddle.position))
    };
    let found = finder.near(pyramid, level, position, reach, at_place).or_else(|| {
        let seen = |k: usize| grid.get(&(vertex + step::<N>(k))).map(|g| g.saddle.position);
        let width = |k: usize| spacing.width(vertex, step::<N>(k));
        let edge = |k: usize| seen(k).map(|place| (place - position) / width(k));
        (0..N).find_map(|k| {
            let edges = [edge(k)?, edge(k + 1)?];
            Rectified::views::<N>(position, k, edges)
                .into_iter()
                .find_map(|view| view?.find(finder, pyramid, level, at_place))
        })
    });
    found.or_else(|| meeting(position))
}

/// Returns the corner of a checkerboard in which the edges to the neighbours of a vertex meet, on a level of the pyramid. All its edges must
/// be visible, with the colours and the contrast of the neighbours.
fn met_by_edges<const N: usize>(
    pyramid: &Pyramid,
    grid: &Growing<N>,
    spacing: Spacing,
    vertex: Vertex,
    position: DVec2,
    level: usize,
) -> Option<GrownSaddle<N>> {
    let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
    let map = LocalMap::about::<N>(vertex, at, Shape::usual(spacing))?;
    let on_level = |place: DVec2| Pyramid::from_level_0(level, place);
    let beside = |k: usize| {
        let seen = at(vertex + step::<N>(k));
        let place = seen.unwrap_or_else(|| position + map.along(step::<N>(k)));
        Neighbour { way: on_level(place) - on_level(position), is_seen: seen.is_some() }
    };
    let beside: [Neighbour; N] = std::array::from_fn(beside);
    let met = EdgeCrossing::find((&pyramid.levels()[level]).into(), on_level(position), &beside)?;
    // Even rays have the dark side on their left.
    let turn = parity(vertex);
    let rays = std::array::from_fn(|ray| met.rays[(ray + turn) % N]);
    let sectors = Sectors { rays, level: met.level, amplitude: met.amplitude };
    let saddle = Saddle { position: Pyramid::to_level_0(level, met.position), sectors, level };
    let grown = GrownSaddle { saddle, turn };
    let is_alike = neighbours::<N>(vertex)
        .iter()
        .filter_map(|v| grid.get(v))
        .all(|other| have_similar_contrast(&other.saddle, &saddle));
    let has_colours = met.is_dark_left == turn.is_multiple_of(2);
    (has_colours && is_alike && parallel_to_neighbours(grid, vertex, &grown)).then_some(grown)
}

/// Returns a saddle point as the corner at `vertex` of a grid. It must have clean edges to at least two neighbours that
/// agree on its turn, and rays parallel to theirs.
fn placed_at<const N: usize>(
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    saddle: Saddle<N>,
) -> Option<GrownSaddle<N>> {
    // The turn that the neighbours agree on.
    let mut votes = [0usize; N];
    for (k, neighbour) in neighbours::<N>(vertex).into_iter().enumerate() {
        let Some(other) = grid.get(&neighbour) else {
            continue;
        };
        let back = other.ray(k + N / 2);
        if let Some(ray) = facing_ray(&other.saddle, back, &saddle)
            && is_clean_somehow(pyramid, End::of(&other.saddle, back), End::of(&saddle, ray))
        {
            votes[(k + N - ray) % N] += 1;
        }
    }
    let turn = (0..N).max_by_key(|&t| votes[t])?;
    let grown = GrownSaddle { saddle, turn };
    (votes[turn] >= 2 && parallel_to_neighbours(grid, vertex, &grown)).then_some(grown)
}

/// Returns whether all rays of a corner are parallel to those of each neighbour, within the angle by which distortion
/// and perspective may bend a tile.
fn parallel_to_neighbours<const N: usize>(
    grid: &Growing<N>,
    vertex: Vertex,
    grown: &GrownSaddle<N>,
) -> bool {
    let along = |corner: &GrownSaddle<N>, k: usize| corner.saddle.sectors.rays[corner.ray(k)];
    neighbours::<N>(vertex).iter().filter_map(|v| grid.get(v)).all(|other| {
        (0..N).all(|k| turn(along(grown, k), along(other, k)).abs() <= 2.0 * MAX_CHORD_RAD)
    })
}
