//! Grids from linked corners: initial quads, breadth-first growth, and filling of gaps.
//!
//! A corner has N rays, six or four, along the edges that meet there, and is *linked* along a ray to
//! the corner at the other end of the edge. In a grid it has a lattice vertex and a *turn*: its ray k
//! points along step `k + turn` (mod N) of the lattice ([`step`]). Rays with even numbers begin dark
//! sectors. On a deltille grid turns are therefore even, and the upright tiles are the dark ones,
//! whatever the board's colours. On a checkerboard the turn is even where row + column is, and there
//! the square up and right is dark.
//!
//! Every grid has a lattice frame of its own, known up to a motion of the lattice;
//! [`label`](crate::labels::placement) finds what it is on the target.

use std::collections::{BTreeMap, BTreeSet, HashSet, VecDeque};

use glam::DVec2;

use super::edge::{End, MAX_CHORD_RAD, is_clean_somehow};
use super::effort::Effort;
use super::links::{Link, Links, facing_ray, links};
use super::local_map::{Bend, LocalMap};
use super::outline::WholeBoard;
use super::parts::join;
use super::rectified::Rectified;
use super::saddle_grid::{Growing, GrownSaddle, PlacedSaddle, SaddleGrid};
use crate::corners::buckets::Buckets;
use crate::corners::saddles::{Saddle, SaddleFinder, merge_px, too_many};
use crate::corners::sectors::turn;
use crate::tiling::{kind, neighbours, step, tiles_from};
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::raster::Pyramid;

/// Greatest distance of a missing corner from the position that its neighbours predict, as a fraction
/// of the edge length there.
const MAX_SURPRISE: f64 = 0.2;

/// Corners nearer to each other than this fraction of the distance to the nearest neighbour are the
/// same one: under blur and motion a corner may be detected twice.
const SAME_PART: f64 = 0.2;

/// Effort for a missing corner, which is sought in the picture and in several rectified views of it.
const LOOKS_FOR_CORNER: usize = 20;

/// A corner's place in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    /// Its lattice vertex.
    vertex: Vertex,
    /// Ray k points along step `k + turn` (mod N) of the lattice.
    turn: usize,
}

/// All grids among the saddle points, by lattice vertex, those with most corners first. There are none
/// where there are more saddle points than any board has. Corners that were not detected are sought
/// where a grid has gaps or goes on; not so in a grid that shows the `whole` board, if that is given.
pub fn grids<const N: usize>(
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
        // A corner that is found in a gap may be a known saddle point that was not linked: it is dropped
        // if another grid has that, or if it is in this grid under another vertex.
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
            grid.into_iter().map(|(v, grown)| (v, plain(&grown))).collect()
        })
        .collect();
    grids.sort_by_key(|grid: &SaddleGrid| std::cmp::Reverse(grid.len()));
    let mut grids = without_tag_cells::<N>(grids);
    each_once(&mut grids, no_places);
    grids
}

/// A corner without what only growing needs.
fn plain<const N: usize>(grown: &GrownSaddle<N>) -> PlacedSaddle {
    PlacedSaddle { position: grown.saddle.position, amplitude: grown.saddle.sectors.amplitude }
}

/// Index of the nearest known saddle point that counts as the same as `saddle`.
fn same<const N: usize>(places: &Buckets, saddle: &Saddle<N>) -> Option<usize> {
    let near = places.within(saddle.position, merge_px(saddle.level));
    near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))).map(|(i, _)| i)
}

/// Removes corners that also are in a larger grid, or under another vertex of the same grid. `places`
/// is an empty index over the image, to which the positions that stay are added.
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

/// Drops every grid that lies within a single tile of a larger one: the cells of a tag form a tiling,
/// too. `grids` are sorted with the largest first.
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
        // The larger grid may be dropped itself: its tile then lies in the tile of a third grid, which
        // holds this one as well.
        !middles.within(first.position, reach_px).any(|(index, _)| {
            let (i, tile) = &tiles[index];
            Some(*i) < own && grid.values().all(|placed| is_inside(tile, placed.position))
        })
    });
    grids
}

/// Positions of the vertices, px, of every tile all of whose vertices are in a grid.
fn tiles_of<const N: usize>(grid: &SaddleGrid) -> impl Iterator<Item = Vec<DVec2>> {
    let place = |v: &Vertex| grid.get(v).map(|p| p.position);
    let tiles = grid.keys().flat_map(|&v| tiles_from::<N>(v));
    tiles.filter_map(move |tile| tile.iter().map(place).collect())
}

/// Whether a point lies within a tile, px. Vertices that are counter-clockwise on the print have a
/// negative signed area in the image, where y runs down.
fn is_inside(tile: &[DVec2], p: DVec2) -> bool {
    (0..tile.len()).all(|i| {
        let (a, b) = (tile[i], tile[(i + 1) % tile.len()]);
        (b - a).perp_dot(p - a) < 0.0
    })
}

/// A corner at a place of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Placed {
    /// Index of the corner.
    corner: usize,
    /// Where it is.
    place: Place,
}

/// The four corners from which a grid grows.
type Seed = [Placed; 4];

/// All seeds, those whose corners have most links first, as links are missing near what is wrong.
///
/// ```text
///     D ───── C          A at (0,0), B at (0,1), C at (1,0), D at (1,−1): the two tiles A B C and
///      ╲ ░░░ ╱█╲         A C D share an edge
///       ╲ ░ ╱███╲
///        A ───── B       on a checkerboard C at (1,1) and D at (1,0): the one dark square A B C D
/// ```
///
/// All five edges of the two triangles, or four of the square, must be linked, which they are from both
/// ends.
fn seeds<const N: usize>(links: &[Links<N>]) -> Vec<Seed> {
    let root = Place { vertex: Vertex::new(0, 0), turn: 0 };
    let mut seeds: Vec<(usize, Seed)> = Vec::new();
    for corner in 0..links.len() {
        let a = Placed { corner, place: root };
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
        let complete = seed.iter().map(|at| links[at.corner].iter().flatten().count()).sum();
        seeds.push((complete, seed));
    }
    seeds.sort_by_key(|(complete, seed)| (std::cmp::Reverse(*complete), seed[0].corner));
    seeds.into_iter().map(|(_, seed)| seed).collect()
}

/// The corner that is linked to `from` along step `k` of the lattice.
fn follow<const N: usize>(links: &[Links<N>], from: Placed, k: usize) -> Option<Placed> {
    let link = links[from.corner][(k + N - from.place.turn) % N]?;
    Some(Placed { corner: link.corner, place: across::<N>(from.place, k, link) })
}

/// The corners of the square that steps `k` and `l` span at `a`, in order around it; `None` unless all
/// four edges are linked.
fn square<const N: usize>(links: &[Links<N>], a: Placed, k: usize, l: usize) -> Option<Seed> {
    let (b, d) = (follow(links, a, k)?, follow(links, a, l)?);
    let c = follow(links, b, l)?;
    (follow(links, d, k) == Some(c)).then_some([a, b, c, d])
}

/// The place at the far end of the link that leaves `from` along step `k` of the lattice.
fn across<const N: usize>(from: Place, k: usize, link: Link) -> Place {
    // `link.ray` is the ray of the other corner that looks back, so it points along the opposite step.
    Place { vertex: from.vertex + step::<N>(k), turn: (k + N / 2 + N - link.ray) % N }
}

/// Grids that grow along links, one after the other.
struct Growth<'a, const N: usize> {
    links: &'a [Links<N>],
    /// For each corner, whether an earlier grid has it.
    taken: Vec<bool>,
    /// For each corner, its place in the grid that grows.
    places: Vec<Option<Place>>,
    /// The corners of the grid that grows, in the order in which they joined.
    members: Vec<usize>,
    /// The vertices of these corners.
    occupied: HashSet<Vertex>,
    /// Corners whose links are to be followed.
    queue: VecDeque<usize>,
}

impl<'a, const N: usize> Growth<'a, N> {
    fn new(links: &'a [Links<N>]) -> Self {
        let count = links.len();
        let (members, occupied, queue) = (Vec::new(), HashSet::new(), VecDeque::new());
        Self {
            links,
            taken: vec![false; count],
            places: vec![None; count],
            members,
            occupied,
            queue,
        }
    }

    /// Grows a grid from a seed, breadth first, and returns its corners with their places.
    ///
    /// A corner joins when it closes a tile, as a single link may be wrong: it closes a triangle, or a
    /// square in a re-entrant angle of the grid, when two corners of the grid agree on its place. On a
    /// straight side of a checkerboard, a square is closed by two new corners at once.
    fn grow(&mut self, seed: &Seed) -> Vec<Placed> {
        self.occupied.clear();
        seed.iter().for_each(|&placed| self.add(placed));
        while let Some(corner) = self.queue.pop_front() {
            let Some(place) = self.places[corner] else {
                continue;
            };
            let at = Placed { corner, place };
            for k in 0..N {
                let Some(next) = follow(self.links, at, k).filter(|&next| self.is_free(next))
                else {
                    continue;
                };
                match self.votes(next) {
                    Some(2..) => self.join(next),
                    Some(1) if kind::<N>() == GridKind::Checker => self.join_by_square(at, k),
                    _ => {}
                }
            }
        }
        let members = std::mem::take(&mut self.members).into_iter();
        members
            .filter_map(|corner| Some(Placed { corner, place: self.places[corner].take()? }))
            .collect()
    }

    /// Adds a corner, whose links are then followed.
    fn add(&mut self, Placed { corner, place }: Placed) {
        self.places[corner] = Some(place);
        self.members.push(corner);
        self.occupied.insert(place.vertex);
        self.queue.push_back(corner);
    }

    /// Whether the corner belongs to no grid yet, and its vertex is not occupied in this one.
    fn is_free(&self, Placed { corner, place }: Placed) -> bool {
        !self.taken[corner]
            && self.places[corner].is_none()
            && !self.occupied.contains(&place.vertex)
    }

    /// Number of corners of the grid that are linked to `next` as its place requires; `None` where one
    /// is linked to it as if it had another place.
    fn votes(&self, next: Placed) -> Option<usize> {
        let linked = (0..N).filter_map(|k| follow(self.links, next, k));
        let mut known = linked.filter_map(|next| Some(self.places[next.corner]? == next.place));
        known.try_fold(0, |votes, agrees| agrees.then_some(votes + 1))
    }

    /// Adds a corner, and follows the links of its neighbours in the grid once more.
    fn join(&mut self, next: Placed) {
        self.add(next);
        // Corners beside it that lacked one vote may now have it.
        let linked = (0..N).filter_map(|k| follow(self.links, next, k)).map(|next| next.corner);
        self.queue.extend(linked.filter(|&corner| self.places[corner].is_some()));
    }

    /// Adds the corner that follows `at` along step `k` together with one beside it, where these two close
    /// a square with an edge of the grid.
    fn join_by_square(&mut self, at: Placed, k: usize) {
        for side in [k + 1, k + N - 1] {
            let Some([_, next, beside, known]) = square(self.links, at, k, side % N) else {
                continue;
            };
            let in_grid = self.places[known.corner] == Some(known.place);
            if in_grid && self.is_free(beside) && self.votes(beside) == Some(1) {
                self.join(next);
                self.join(beside);
                return;
            }
        }
    }
}

/// Seeks corners at empty vertices beside those of a grid, within it and around it, where neighbours
/// predict them, until no more are found.
fn fill_gaps<const N: usize>(
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
        for vertex in empty {
            let Some(predicted) = predict(grid, vertex) else {
                continue;
            };
            if let Some(placed) = corner_near(finder, pyramid, grid, vertex, predicted, effort) {
                grid.insert(vertex, placed);
                grown = true;
                // The vertices around it are predicted anew, so they are tried again.
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

/// Where a missing corner is sought.
#[derive(Clone, Copy, Debug)]
struct Predicted {
    /// Its position, px.
    position: DVec2,
    /// Length of an edge there, px.
    edge_px: f64,
}

/// Where a missing corner is: the mean of what the rows through `vertex` predict. With the next three corners p, q, r of a row, the position is
///
/// ```text
///     3 p − 3 q + r        a row that bends evenly (its second difference is constant)
///     2 p − q              where r is missing: a straight row with equal edges
/// ```
///
/// Where fewer than two rows predict it, a local map of the corners around does, if there are two
/// neighbours; else the result is `None`.
fn predict<const N: usize>(grid: &Growing<N>, vertex: Vertex) -> Option<Predicted> {
    let at = |v: Vertex| grid.get(&v).map(|grown| grown.saddle.position);
    let mut sum = DVec2::ZERO;
    let (mut count, mut edge) = (0.0, 0.0);
    for step in (0..N).map(step::<N>) {
        let first = vertex + step;
        let second = first + step;
        let (Some(p), Some(q)) = (at(first), at(second)) else {
            continue;
        };
        sum += match at(second + step) {
            Some(r) => 3.0 * p - 3.0 * q + r,
            None => 2.0 * p - q,
        };
        edge += (p.x - q.x).hypot(p.y - q.y);
        count += 1.0;
    }
    if count >= 2.0 {
        return Some(Predicted { position: sum / count, edge_px: edge / count });
    }
    // The seed of a grid has no rows yet, but two of its corners beside the vertex.
    let beside: Vec<DVec2> = neighbours::<N>(vertex).into_iter().filter_map(at).collect();
    let map = (beside.len() >= 2).then(|| LocalMap::about::<N>(vertex, at, Bend::usual()))??;
    let px = |p: &DVec2| (p.x - map.place.x).hypot(p.y - map.place.y);
    let edge_px = beside.iter().map(px).sum::<f64>() / beside.len() as f64;
    Some(Predicted { position: map.place, edge_px })
}

/// The corner at `vertex`, if one is found near where it is predicted: in the picture, or, where the
/// board is seen at a steep angle, in a view that is rectified by the edges to its neighbours.
fn corner_near<const N: usize>(
    finder: &SaddleFinder<N>,
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    Predicted { position, edge_px }: Predicted,
    effort: &mut Effort,
) -> Option<GrownSaddle<N>> {
    if !effort.spend(LOOKS_FOR_CORNER) {
        return None;
    }
    let reach = (MAX_SURPRISE * edge_px).max(1.0);
    let neighbours = neighbours::<N>(vertex);
    // A blurred corner is found best on the pyramid level on which its neighbours were found.
    let levels = neighbours.iter().filter_map(|v| Some(grid.get(v)?.saddle.level));
    let level = levels.max().unwrap_or(0);
    let at_place = |saddle| placed_at(pyramid, grid, vertex, saddle);
    finder.near(pyramid, level, position, reach, at_place).or_else(|| {
        let seen = |k: usize| grid.get(&(vertex + step::<N>(k))).map(|g| g.saddle.position);
        let edge = |k: usize| seen(k).map(|place| place - position);
        (0..N).find_map(|k| {
            let edges = [edge(k)?, edge(k + 1)?];
            Rectified::views::<N>(position, k, edges)
                .into_iter()
                .find_map(|view| view?.find(finder, pyramid, level, at_place))
        })
    })
}

/// A saddle point as the corner at `vertex` of a grid, if it has clean edges to two neighbours at least
/// that agree on its turn, and rays parallel to theirs.
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

/// Whether all rays of a corner are parallel to those of each neighbour, within the angle by which
/// distortion and perspective may bend a tile.
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

#[cfg(test)]
mod tests {
    use proptest::bool::weighted;
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;
    use crate::tiling::{CHECKER, DELTILLE};
    use deltille_core::lattice::GridKind;

    /// A lattice of rows and columns about a place, with edges of this length, px.
    fn lattice(kind: GridKind, side: i32, origin: [f64; 2], edge_px: f64) -> SaddleGrid {
        let corner = |row: i32, col: i32| {
            let place = kind.position(f64::from(row), f64::from(col));
            let position = DVec2::from(origin) + edge_px * place * DVec2::new(1.0, -1.0);
            (Vertex::new(row, col), PlacedSaddle { position, amplitude: 100.0 })
        };
        (0..side).flat_map(|row| (0..side).map(move |col| corner(row, col))).collect()
    }

    /// Cells of a tag lie in one tile of a grid around them; what lies beside a grid, or across its edges, stays.
    #[test]
    fn only_what_lies_in_one_tile_of_a_larger_grid_is_dropped() {
        fn check<const N: usize>(kind: GridKind) {
            let board = lattice(kind, 6, [100.0, 900.0], 100.0);
            // The middle of a tile, of an edge, and of nothing.
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

    /// A vertex turned about the origin by so many steps.
    fn turned<const N: usize>(vertex: Vertex, by: usize) -> Vertex {
        let [along, up] = [by, by + 1].map(step::<N>);
        let sum = |a: i32, b: i32| vertex.col * a + vertex.row * b;
        Vertex::new(sum(along.row, up.row), sum(along.col, up.col))
    }

    /// Links between the corners of a lattice of which some are missing, each with its rays counted from anywhere.
    fn linked<const N: usize>(
        vertices: &[Vertex],
        turns: &[usize],
        lost: &[bool],
    ) -> Vec<Links<N>> {
        let mut links = vec![[None; N]; vertices.len()];
        let mut lost = lost.iter().cycle();
        for a in 0..vertices.len() {
            for k in 0..N / 2 {
                let there = vertices[a] + step::<N>(k);
                let Some(b) = vertices.iter().position(|&v| v == there) else { continue };
                if *lost.next().unwrap() {
                    continue;
                }
                let ray = |corner: usize, k: usize| (k + N - turns[corner]) % N;
                let [out, back] = [ray(a, k), ray(b, k + N / 2)];
                links[a][out] = Some(Link { corner: b, ray: back });
                links[b][back] = Some(Link { corner: a, ray: out });
            }
        }
        links
    }

    /// Grids are parts of the lattice, turned and shifted, in which no corner has two places and no place two corners;
    /// without holes it is one grid of all corners.
    fn grids_are_the_lattice<const N: usize>(holes: &[bool], lost: &[bool], seed: usize) {
        let mut vertices: Vec<Vertex> = (0..49)
            .map(|i| Vertex::new(i / 7, i % 7))
            .zip(holes)
            .filter(|(_, hole)| !**hole)
            .map(|(v, _)| v)
            .collect();
        let middle = seed % vertices.len().max(1);
        vertices.rotate_left(middle);
        // Even rays begin dark sectors: on a checkerboard the colours alternate from corner to corner.
        let parity =
            |v: Vertex| if N == CHECKER { (v.row + v.col).rem_euclid(2) as usize } else { 0 };
        let turns: Vec<usize> = vertices
            .iter()
            .enumerate()
            .map(|(i, &v)| (2 * (i * seed % N) + parity(v)) % N)
            .collect();
        let links = linked::<N>(&vertices, &turns, lost);
        let (mut growth, mut seen) = (Growth::new(&links), BTreeSet::new());
        for seed in seeds(&links) {
            if seed.iter().any(|placed| growth.taken[placed.corner]) {
                continue;
            }
            let root = seed[0].corner;
            let grid = growth.grow(&seed);
            let places: BTreeSet<Vertex> = grid.iter().map(|placed| placed.place.vertex).collect();
            assert_eq!(places.len(), grid.len());
            for Placed { corner, place } in grid {
                growth.taken[corner] = true;
                assert!(seen.insert(corner), "corner {corner} has two places");
                let truth = vertices[root] + turned::<N>(place.vertex, turns[root]);
                assert_eq!(truth, vertices[corner]);
                assert_eq!((place.turn + turns[root]) % N, turns[corner]);
            }
        }
        if !holes.contains(&true) && !lost.contains(&true) {
            assert_eq!(seen.len(), vertices.len());
        }
    }

    proptest! {
        #[test]
        fn what_grows_is_the_lattice(
            holes in vec(weighted(0.15), 49), lost in vec(weighted(0.05), 100), seed in 0..1000usize,
        ) {
            let none = [false; 49];
            for (holes, lost) in [(&holes[..], &lost[..]), (&none, &none)] {
                grids_are_the_lattice::<DELTILLE>(holes, lost, seed);
                grids_are_the_lattice::<CHECKER>(holes, lost, seed);
            }
        }
    }

    #[test]
    fn a_grid_alone_is_never_dropped() {
        let board = lattice(GridKind::Deltille, 4, [10.0, 90.0], 20.0);
        assert_eq!(without_tag_cells::<DELTILLE>(vec![board.clone()]), [board]);
        assert_eq!(without_tag_cells::<DELTILLE>(Vec::new()), []);
    }
}
