//! From linked corners to grids: initial quads, then breadth-first growth, then the gaps.
//!
//! Every corner of a grid has a lattice vertex and a *turn*: ray k of the corner points along step
//! `k + turn` of [`Vertex::STEPS`]. Even rays begin dark sectors, so turns are even, and in every
//! grid the upright tiles are the dark ones, whatever the board's colours.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::edge::is_clean;
use super::links::{Link, facing_ray, links};
use super::saddles::{Saddle, SaddleFinder};
use super::sectors::turn;
use crate::lattice::{Tile, Vertex};
use crate::raster::Pyramid;

/// Largest distance of a corner from where its neighbours predict it, over the edge length.
const MAX_SURPRISE: f64 = 0.2;

/// A corner's place in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    vertex: Vertex,
    turn: usize,
}

/// A corner in a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSaddle {
    /// The corner.
    pub saddle: Saddle,
    /// Its ray k points along step `k + turn` (mod 6) of the lattice.
    pub turn: usize,
}

/// Corners by lattice vertex.
pub type SaddleGrid = BTreeMap<Vertex, PlacedSaddle>;

/// All grids among the saddles, largest first.
pub fn grids(finder: &SaddleFinder, pyramid: &Pyramid, saddles: &[Saddle]) -> Vec<SaddleGrid> {
    let image = &pyramid.levels()[0];
    let links = links(image, saddles);
    let mut taken = vec![false; saddles.len()];
    let mut grids = Vec::new();
    for seed in quads(&links) {
        if seed.iter().any(|&(corner, _)| taken[corner]) {
            continue;
        }
        let places = grow(&links, &seed, &taken);
        let mut grid: SaddleGrid = places
            .iter()
            .map(|(&corner, place)| {
                taken[corner] = true;
                (place.vertex, PlacedSaddle { saddle: saddles[corner], turn: place.turn })
            })
            .collect();
        fill_gaps(finder, pyramid, &mut grid);
        grids.push(grid);
    }
    grids.sort_by_key(|grid| std::cmp::Reverse(grid.len()));
    without_tag_cells(grids)
}

/// Drops grids that lie within one tile of a larger grid: the cells of a tag are a tiling too.
fn without_tag_cells(grids: Vec<SaddleGrid>) -> Vec<SaddleGrid> {
    let mut kept: Vec<SaddleGrid> = Vec::new();
    for grid in grids {
        if !kept.iter().any(|larger| in_one_tile(larger, &grid)) {
            kept.push(grid);
        }
    }
    kept
}

fn in_one_tile(larger: &SaddleGrid, grid: &SaddleGrid) -> bool {
    let tiles = larger.keys().flat_map(|&v| [Tile::upright(v), Tile::inverted(v)]);
    let mut triangles = tiles.filter_map(|tile| {
        let [a, b, c] = tile.vertices().map(|v| larger.get(&v).map(|p| p.saddle.position));
        Some([a?, b?, c?])
    });
    let inside = |[a, b, c]: [[f64; 2]; 3], p: [f64; 2]| {
        let side = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) < 0.0
        };
        // Counter-clockwise on the print is clockwise in the image's axes.
        side(a, b, p) && side(b, c, p) && side(c, a, p)
    };
    triangles.any(|t| grid.values().all(|placed| inside(t, placed.saddle.position)))
}

/// Four corners of two tiles that share an edge, with their places.
type Quad = [(usize, Place); 4];

/// The initial quads, those with the most complete surroundings first.
///
/// ```text
///     C ─────── B'       A at (0,0), B at (0,1), C at (1,0), and D at (1,−1) or B' … : the two
///      ╲███████╱ ╲       tiles A B C and A C D, all five edges linked both ways
/// ```
fn quads(links: &[[Option<Link>; 6]]) -> Vec<Quad> {
    let origin = Vertex::new(0, 0);
    let mut quads: Vec<(usize, Quad)> = Vec::new();
    for (a, rays) in links.iter().enumerate() {
        let root = Place { vertex: origin, turn: 0 };
        let neighbour =
            |step: usize| rays[step].map(|link| (link.corner, across(root, step, link)));
        let Some(quad) = (|| {
            let [b, c, d] = [neighbour(0)?, neighbour(1)?, neighbour(2)?];
            let joined = |p: (usize, Place), q: (usize, Place), step: usize| {
                let link = links[p.0][(step + 6 - p.1.turn) % 6];
                link.is_some_and(|link| link.corner == q.0 && across(p.1, step, link) == q.1)
            };
            (joined(b, c, 2) && joined(c, d, 3)).then_some([(a, root), b, c, d])
        })() else {
            continue;
        };
        let complete = quad.iter().map(|&(i, _)| links[i].iter().flatten().count()).sum();
        quads.push((complete, quad));
    }
    quads.sort_by_key(|(complete, quad)| (std::cmp::Reverse(*complete), quad[0].0));
    quads.into_iter().map(|(_, quad)| quad).collect()
}

/// The place at the far end of the link that leaves `from` along lattice step `step`.
fn across(from: Place, step: usize, link: Link) -> Place {
    // The ray that looks back points along the opposite step.
    Place { vertex: from.vertex + Vertex::STEPS[step], turn: (step + 3 + 6 - link.ray) % 6 }
}

/// Breadth-first growth: a corner joins when two corners of the grid agree on its place.
fn grow(links: &[[Option<Link>; 6]], seed: &Quad, taken: &[bool]) -> BTreeMap<usize, Place> {
    let mut places: BTreeMap<usize, Place> = seed.iter().copied().collect();
    let mut occupied: BTreeMap<Vertex, usize> =
        seed.iter().map(|&(corner, place)| (place.vertex, corner)).collect();
    let mut queue: VecDeque<usize> = seed.iter().map(|&(corner, _)| corner).collect();
    while let Some(corner) = queue.pop_front() {
        for (step, link) in steps_of(links, corner, places[&corner]) {
            let next = link.corner;
            if taken[next] || places.contains_key(&next) {
                continue;
            }
            let place = across(places[&corner], step, link);
            if occupied.contains_key(&place.vertex) {
                continue;
            }
            let (mut agree, mut disagree) = (0, 0);
            for (back, link) in steps_of(links, next, place) {
                match places.get(&link.corner) {
                    Some(known) if *known == across(place, back, link) => agree += 1,
                    Some(_) => disagree += 1,
                    None => {}
                }
            }
            if agree >= 2 && disagree == 0 {
                places.insert(next, place);
                occupied.insert(place.vertex, next);
                queue.push_back(next);
                // Corners that were one vote short may now have it.
                queue.extend(
                    steps_of(links, next, place)
                        .filter(|(_, l)| places.contains_key(&l.corner))
                        .map(|(_, l)| l.corner),
                );
            }
        }
    }
    places
}

/// The links of a corner with the lattice steps that they follow.
fn steps_of(
    links: &[[Option<Link>; 6]],
    corner: usize,
    place: Place,
) -> impl Iterator<Item = (usize, Link)> {
    let rays = links[corner];
    (0..6).filter_map(move |ray| rays[ray].map(|link| ((ray + place.turn) % 6, link)))
}

/// Looks for missing corners where their neighbours predict them, until none is found.
fn fill_gaps(finder: &SaddleFinder, pyramid: &Pyramid, grid: &mut SaddleGrid) {
    let mut tried = BTreeSet::new();
    loop {
        let empty: BTreeSet<Vertex> = grid
            .keys()
            .flat_map(|v| v.neighbours())
            .filter(|v| !grid.contains_key(v) && !tried.contains(v))
            .collect();
        let mut grown = false;
        for vertex in empty {
            let Some((position, edge)) = predict(grid, vertex) else { continue };
            if let Some(placed) = corner_near(finder, pyramid, grid, vertex, position, edge) {
                grid.insert(vertex, placed);
                grown = true;
                // What this corner's surroundings predict has changed.
                tried.retain(|v: &Vertex| !vertex.neighbours().contains(v));
            } else {
                tried.insert(vertex);
            }
        }
        if !grown {
            return;
        }
    }
}

/// Where the straight (or evenly bent) rows through `vertex` continue to, and the length of an
/// edge there; `None` unless two rows predict it.
fn predict(grid: &SaddleGrid, vertex: Vertex) -> Option<([f64; 2], f64)> {
    let at = |v: Vertex| grid.get(&v).map(|placed| placed.saddle.position);
    let mut sum = [0.0; 2];
    let (mut count, mut edge) = (0.0, 0.0);
    for step in Vertex::STEPS {
        let first = vertex + step;
        let second = first + step;
        let (Some(p), Some(q)) = (at(first), at(second)) else { continue };
        let predicted: [f64; 2] = std::array::from_fn(|k| match at(second + step) {
            Some(r) => 3.0 * p[k] - 3.0 * q[k] + r[k],
            None => 2.0 * p[k] - q[k],
        });
        sum = [sum[0] + predicted[0], sum[1] + predicted[1]];
        edge += (p[0] - q[0]).hypot(p[1] - q[1]);
        count += 1.0;
    }
    (count >= 2.0).then(|| ([sum[0] / count, sum[1] / count], edge / count))
}

/// The corner at `vertex`, if one is found near `position` with clean edges to two neighbours.
fn corner_near(
    finder: &SaddleFinder,
    pyramid: &Pyramid,
    grid: &SaddleGrid,
    vertex: Vertex,
    position: [f64; 2],
    edge_px: f64,
) -> Option<PlacedSaddle> {
    let image = &pyramid.levels()[0];
    let reach = (MAX_SURPRISE * edge_px).max(1.0);
    let saddle = finder.near(pyramid, position, reach)?;
    // The turn that the neighbours agree on.
    let mut votes = [0usize; 6];
    for (step, neighbour) in vertex.neighbours().into_iter().enumerate() {
        let Some(other) = grid.get(&neighbour) else { continue };
        let back = (step + 3 + 6 - other.turn) % 6;
        if let Some(ray) = facing_ray(&other.saddle, back, &saddle)
            && is_clean(image, &other.saddle, back, &saddle, ray)
        {
            votes[(step + 6 - ray) % 6] += 1;
        }
    }
    let turn = (0..6).max_by_key(|&t| votes[t])?;
    (votes[turn] >= 2 && parallel_to_neighbours(grid, vertex, &saddle, turn))
        .then_some(PlacedSaddle { saddle, turn })
}

/// Whether all six rays point where those of each neighbour do, within what one tile may bend.
fn parallel_to_neighbours(
    grid: &SaddleGrid,
    vertex: Vertex,
    saddle: &Saddle,
    own_turn: usize,
) -> bool {
    use super::edge::MAX_CHORD_RAD;
    vertex.neighbours().iter().filter_map(|v| grid.get(v)).all(|other| {
        (0..6).all(|step| {
            let own = saddle.sectors.rays[(step + 6 - own_turn) % 6];
            let theirs = other.saddle.sectors.rays[(step + 6 - other.turn) % 6];
            turn(own, theirs).abs() <= 2.0 * MAX_CHORD_RAD
        })
    })
}
