//! From linked corners to grids: initial quads, then breadth-first growth, then the gaps.
//!
//! Every corner of a grid has a lattice vertex and a *turn*: ray k of the corner points along step
//! `k + turn` of the lattice ([`step`]). Even rays begin dark sectors. On a deltille grid turns are
//! even, and the upright tiles are the dark ones, whatever the board's colours. On a checkerboard
//! the turn is even where row + column is, and there the square up and right is dark.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::buckets::Buckets;
use super::edge::{MAX_CHORD_RAD, is_clean_somehow};
use super::links::{Link, Links, facing_ray, links};
use super::local_map::{Bend, LocalMap};
use super::parts::join;
use super::rectified::Rectified;
use super::saddles::{Saddle, SaddleFinder, merge_px};
use super::sectors::turn;
use super::tiling::{kind, neighbours, step, tiles_at};
use crate::lattice::Vertex;
use crate::raster::Pyramid;
use crate::target::GridKind;

/// Largest distance of a corner from where its neighbours predict it, over the edge length.
const MAX_SURPRISE: f64 = 0.2;

/// Corners nearer to each other than this part of an edge are the same: under blur and motion one may be
/// found twice.
const SAME_PART: f64 = 0.2;

/// A corner's place in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    vertex: Vertex,
    turn: usize,
}

/// What the later stages know of a corner of either tiling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSaddle {
    /// Position, px.
    pub position: [f64; 2],
    /// Half the contrast around it.
    pub amplitude: f64,
}

/// Corners by lattice vertex.
pub type SaddleGrid = BTreeMap<Vertex, PlacedSaddle>;

/// A corner in a grid while it grows.
#[derive(Clone, Copy, Debug)]
pub struct GrownSaddle<const N: usize> {
    /// The corner.
    pub saddle: Saddle<N>,
    /// Ray k points along step `k + turn` (mod N) of the lattice.
    pub turn: usize,
}

impl<const N: usize> GrownSaddle<N> {
    /// The ray along step `k` of the lattice.
    pub fn ray(&self, k: usize) -> usize {
        (k + N - self.turn) % N
    }
}

/// A grid while it grows.
pub type Growing<const N: usize> = BTreeMap<Vertex, GrownSaddle<N>>;

/// All grids among the saddles, largest first.
pub fn grids<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    saddles: &[Saddle<N>],
) -> Vec<SaddleGrid> {
    let links = links(pyramid, saddles);
    let mut taken = vec![false; saddles.len()];
    let finest = &pyramid.levels()[0];
    let no_places = Buckets::new(finest.width(), finest.height());
    let mut index = no_places.clone();
    saddles.iter().for_each(|saddle| index.insert(saddle.position));
    let (mut growing, mut members) = (Vec::new(), Vec::new());
    for seed in seeds(&links) {
        if seed.iter().any(|&(corner, _)| taken[corner]) {
            continue;
        }
        let places = grow(&links, &seed, &taken);
        let mut own: BTreeMap<usize, Vertex> = BTreeMap::new();
        let mut grid: Growing<N> = BTreeMap::new();
        for (corner, Place { vertex, turn }) in places {
            own.insert(corner, vertex);
            grid.insert(vertex, GrownSaddle { saddle: saddles[corner], turn });
        }
        fill_gaps(finder, pyramid, &mut grid);
        // What is found in a gap may have been found before, without its links.
        grid.retain(|&vertex, grown| match same(&index, &grown.saddle) {
            Some(corner) if taken[corner] => false,
            Some(corner) => *own.entry(corner).or_insert(vertex) == vertex,
            None => true,
        });
        own.keys().for_each(|&corner| taken[corner] = true);
        growing.push(grid);
        members.push(own);
    }
    let mut grids: Vec<SaddleGrid> = join(pyramid, saddles, growing, members)
        .into_iter()
        .map(|(mut grid, has_grown)| {
            if has_grown {
                fill_gaps(finder, pyramid, &mut grid);
            }
            grid.into_iter().map(|(v, grown)| (v, plain(&grown))).collect()
        })
        .collect();
    grids.sort_by_key(|grid: &SaddleGrid| std::cmp::Reverse(grid.len()));
    let mut grids = without_tag_cells::<N>(grids);
    each_once(&mut grids, no_places);
    grids
}

fn plain<const N: usize>(grown: &GrownSaddle<N>) -> PlacedSaddle {
    PlacedSaddle { position: grown.saddle.position, amplitude: grown.saddle.sectors.amplitude }
}

/// The known saddle that is the same as another one.
fn same<const N: usize>(places: &Buckets, saddle: &Saddle<N>) -> Option<usize> {
    let near = places.within(saddle.position, merge_px(saddle.level));
    near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map(|(i, _)| i)
}

/// Leaves out of grids the corners that are in a larger one, or under another vertex of the same; no
/// `places` are known at first.
fn each_once(grids: &mut Vec<SaddleGrid>, mut places: Buckets) {
    for grid in grids.iter_mut() {
        let whole = grid.clone();
        grid.retain(|&vertex, placed| {
            let [x, y] = placed.position;
            let neighbours = Vertex::STEPS.iter().filter_map(|&step| whole.get(&(vertex + step)));
            let nearest_px = neighbours
                .map(|p| (p.position[0] - x).hypot(p.position[1] - y))
                .reduce(f64::min)
                .unwrap_or(0.0);
            let is_new = places.within([x, y], SAME_PART * nearest_px).next().is_none();
            if is_new {
                places.insert([x, y]);
            }
            is_new
        });
    }
    grids.retain(|grid| !grid.is_empty());
}

/// Drops grids that lie within one tile of a larger grid: the cells of a tag are a tiling too.
fn without_tag_cells<const N: usize>(grids: Vec<SaddleGrid>) -> Vec<SaddleGrid> {
    let mut kept: Vec<SaddleGrid> = Vec::new();
    for grid in grids {
        if !kept.iter().any(|larger| in_one_tile::<N>(larger, &grid)) {
            kept.push(grid);
        }
    }
    kept
}

fn in_one_tile<const N: usize>(larger: &SaddleGrid, grid: &SaddleGrid) -> bool {
    let mut tiles = larger.keys().flat_map(|&v| tiles_at::<N>(v)).filter_map(|tile| {
        tile.into_iter().map(|v| larger.get(&v).map(|p| p.position)).collect::<Option<Vec<_>>>()
    });
    let inside = |tile: &[[f64; 2]], p: [f64; 2]| {
        // Counter-clockwise on the print is clockwise in the image's axes.
        (0..tile.len()).all(|i| {
            let (a, b) = (tile[i], tile[(i + 1) % tile.len()]);
            (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) < 0.0
        })
    };
    tiles.any(|tile| grid.values().all(|placed| inside(&tile, placed.position)))
}

/// A corner with its place.
type Placed = (usize, Place);

/// The four corners from which a grid grows.
type Seed = [Placed; 4];

/// The seeds, those with the most complete surroundings first.
///
/// ```text
///     D ───── C          A at (0,0), B at (0,1), C at (1,0), D at (1,−1): the two tiles A B C and
///      ╲ ░░░ ╱█╲         A C D share an edge
///       ╲ ░ ╱███╲
///        A ───── B       on a checkerboard C at (1,1) and D at (1,0): the one dark square A B C D
/// ```
///
/// All five edges, or four, are linked both ways.
fn seeds<const N: usize>(links: &[Links<N>]) -> Vec<Seed> {
    let root = Place { vertex: Vertex::new(0, 0), turn: 0 };
    let mut seeds: Vec<(usize, Seed)> = Vec::new();
    for a in 0..links.len() {
        let a = (a, root);
        let seed = match kind::<N>() {
            GridKind::Deltille => (|| {
                let [b, c, d] = [0, 1, 2].map(|k| follow(links, a, k));
                let (b, c, d) = (b?, c?, d?);
                let closed = follow(links, b, 2) == Some(c) && follow(links, c, 3) == Some(d);
                closed.then_some([a, b, c, d])
            })(),
            GridKind::Checker => square(links, a, 0, 1),
        };
        let Some(seed) = seed else { continue };
        let complete = seed.iter().map(|&(i, _)| links[i].iter().flatten().count()).sum();
        seeds.push((complete, seed));
    }
    seeds.sort_by_key(|(complete, seed)| (std::cmp::Reverse(*complete), seed[0].0));
    seeds.into_iter().map(|(_, seed)| seed).collect()
}

/// The corner that is linked to `from` along step `k` of the lattice.
fn follow<const N: usize>(links: &[Links<N>], (corner, place): Placed, k: usize) -> Option<Placed> {
    let link = links[corner][(k + N - place.turn) % N]?;
    Some((link.corner, across::<N>(place, k, link)))
}

/// The corners of the square that steps `k` and `l` span at `a`, when all four edges are linked.
fn square<const N: usize>(links: &[Links<N>], a: Placed, k: usize, l: usize) -> Option<Seed> {
    let (b, d) = (follow(links, a, k)?, follow(links, a, l)?);
    let c = follow(links, b, l)?;
    (follow(links, d, k) == Some(c)).then_some([a, b, c, d])
}

/// The place at the far end of the link that leaves `from` along step `k` of the lattice.
fn across<const N: usize>(from: Place, k: usize, link: Link) -> Place {
    // The ray that looks back points along the opposite step.
    Place { vertex: from.vertex + step::<N>(k), turn: (k + N / 2 + N - link.ray) % N }
}

/// A grid that grows along links.
struct Growth<'a, const N: usize> {
    links: &'a [Links<N>],
    /// Corners of other grids.
    taken: &'a [bool],
    places: BTreeMap<usize, Place>,
    occupied: BTreeSet<Vertex>,
    queue: VecDeque<usize>,
}

/// Breadth-first growth: corners join when they close a tile with the grid.
///
/// A corner closes a triangle, or a corner that a row bends around closes a square, when two of the
/// grid agree on its place. A square on a straight side is closed by two new corners at once.
fn grow<const N: usize>(links: &[Links<N>], seed: &Seed, taken: &[bool]) -> BTreeMap<usize, Place> {
    let mut growth = Growth {
        links,
        taken,
        places: seed.iter().copied().collect(),
        occupied: seed.iter().map(|&(_, place)| place.vertex).collect(),
        queue: seed.iter().map(|&(corner, _)| corner).collect(),
    };
    while let Some(corner) = growth.queue.pop_front() {
        let at = (corner, growth.places[&corner]);
        for k in 0..N {
            let Some(next) = follow(links, at, k).filter(|&next| growth.is_free(next)) else {
                continue;
            };
            match growth.votes(next) {
                Some(2..) => growth.join(next),
                Some(1) if kind::<N>() == GridKind::Checker => growth.join_by_square(at, k),
                _ => {}
            }
        }
    }
    growth.places
}

impl<const N: usize> Growth<'_, N> {
    /// Whether neither the corner nor its vertex belongs to a grid.
    fn is_free(&self, (corner, place): Placed) -> bool {
        !self.taken[corner]
            && !self.places.contains_key(&corner)
            && !self.occupied.contains(&place.vertex)
    }

    /// Number of corners of the grid that link to `next` at its place; `None` when one links to it
    /// as if it were elsewhere.
    fn votes(&self, next: Placed) -> Option<usize> {
        let linked = (0..N).filter_map(|k| follow(self.links, next, k));
        let mut known =
            linked.filter_map(|(corner, place)| Some(*self.places.get(&corner)? == place));
        known.try_fold(0, |votes, agrees| agrees.then_some(votes + 1))
    }

    fn join(&mut self, next: Placed) {
        self.places.insert(next.0, next.1);
        self.occupied.insert(next.1.vertex);
        self.queue.push_back(next.0);
        // Corners that were one vote short may now have it.
        let linked = (0..N).filter_map(|k| follow(self.links, next, k)).map(|(corner, _)| corner);
        self.queue.extend(linked.filter(|corner| self.places.contains_key(corner)));
    }

    /// The corner that follows `at` along step `k` joins together with the next one beside it.
    fn join_by_square(&mut self, at: Placed, k: usize) {
        for side in [k + 1, k + N - 1] {
            let Some([_, next, beside, known]) = square(self.links, at, k, side % N) else {
                continue;
            };
            let in_grid = self.places.get(&known.0) == Some(&known.1);
            if in_grid && self.is_free(beside) && self.votes(beside) == Some(1) {
                self.join(next);
                self.join(beside);
                return;
            }
        }
    }
}

/// Looks for missing corners where their neighbours predict them, until none is found.
fn fill_gaps<const N: usize>(finder: &SaddleFinder<N>, pyramid: &Pyramid, grid: &mut Growing<N>) {
    let mut tried = BTreeSet::new();
    loop {
        let empty: BTreeSet<Vertex> = grid
            .keys()
            .flat_map(|&v| neighbours::<N>(v))
            .filter(|v| !grid.contains_key(v) && !tried.contains(v))
            .collect();
        let mut grown = false;
        for vertex in empty {
            let Some((position, edge)) = predict(grid, vertex) else {
                continue;
            };
            if let Some(placed) = corner_near(finder, pyramid, grid, vertex, position, edge) {
                grid.insert(vertex, placed);
                grown = true;
                // What this corner's surroundings predict has changed.
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

/// Where the straight (or evenly bent) rows through `vertex` continue to, and the length of an
/// edge there; `None` unless two rows predict it, or two neighbours and those around them.
fn predict<const N: usize>(grid: &Growing<N>, vertex: Vertex) -> Option<([f64; 2], f64)> {
    let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
    let mut sum = [0.0; 2];
    let (mut count, mut edge) = (0.0, 0.0);
    for step in (0..N).map(step::<N>) {
        let first = vertex + step;
        let second = first + step;
        let (Some(p), Some(q)) = (at(first), at(second)) else {
            continue;
        };
        let predicted: [f64; 2] = std::array::from_fn(|k| match at(second + step) {
            Some(r) => 3.0 * p[k] - 3.0 * q[k] + r[k],
            None => 2.0 * p[k] - q[k],
        });
        sum = [sum[0] + predicted[0], sum[1] + predicted[1]];
        edge += (p[0] - q[0]).hypot(p[1] - q[1]);
        count += 1.0;
    }
    if count >= 2.0 {
        return Some(([sum[0] / count, sum[1] / count], edge / count));
    }
    // The first quad of a grid has no rows, but two of its corners beside the vertex.
    let beside: Vec<[f64; 2]> = neighbours::<N>(vertex).into_iter().filter_map(at).collect();
    let map = (beside.len() >= 2).then(|| LocalMap::about::<N>(vertex, at, Bend::usual()))??;
    let px = |p: &[f64; 2]| (p[0] - map.place[0]).hypot(p[1] - map.place[1]);
    Some((map.place, beside.iter().map(px).sum::<f64>() / beside.len() as f64))
}

/// The corner at `vertex`, if one is found near `position`, as the image shows it or in the frame of
/// its neighbours.
fn corner_near<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    position: [f64; 2],
    edge_px: f64,
) -> Option<GrownSaddle<N>> {
    let reach = (MAX_SURPRISE * edge_px).max(1.0);
    let neighbours = neighbours::<N>(vertex);
    // What is blurred around it is best looked for where its neighbours were found.
    let levels = neighbours.iter().filter_map(|v| Some(grid.get(v)?.saddle.level));
    let level = levels.max().unwrap_or(0);
    let at_place = |saddle| placed_at(pyramid, grid, vertex, saddle);
    finder.near(pyramid, level, position, reach, at_place).or_else(|| {
        let seen = |k: usize| grid.get(&(vertex + step::<N>(k))).map(|g| g.saddle.position);
        let edge = |k: usize| seen(k).map(|p| [p[0] - position[0], p[1] - position[1]]);
        (0..N).find_map(|k| {
            let edges = [edge(k)?, edge(k + 1)?];
            Rectified::views::<N>(position, k, edges)
                .into_iter()
                .find_map(|view| view?.find(finder, pyramid, level, at_place))
        })
    })
}

/// A corner at `vertex` of a grid, if it has clean edges to two neighbours that agree on its turn.
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
            && is_clean_somehow(pyramid, &other.saddle, back, &saddle, ray)
        {
            votes[(k + N - ray) % N] += 1;
        }
    }
    let turn = (0..N).max_by_key(|&t| votes[t])?;
    let grown = GrownSaddle { saddle, turn };
    (votes[turn] >= 2 && parallel_to_neighbours(grid, vertex, &grown)).then_some(grown)
}

/// Whether all rays point where those of each neighbour do, within what one tile may bend.
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
