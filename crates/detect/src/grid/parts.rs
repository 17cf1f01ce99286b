//! Joins the parts of a partly covered board through the local map of one part.
//!
//! A finger over a board splits it into grids that no link joins, and single corners without a
//! completely visible tile. The local map of a grid ([`LocalMap`]) predicts where its lattice
//! continues behind the finger. A corner there belongs to the board if it lies at a vertex and all
//! its edges have the predicted directions and dark sides. A grid belongs to the same board if all
//! its corners that are near enough do.

use std::collections::BTreeMap;

use glam::DVec2;

use super::effort::Effort;
use super::links::edge::{End, MAX_CHORD_RAD, is_clean};
use super::links::link::MAX_CONTRAST_RATIO;
use super::map::local_map::{LocalMap, Shape};
use super::saddle_grid::{Growing, GrownSaddle};
use crate::corners::buckets::Buckets;
use crate::corners::saddles::Saddle;
use crate::corners::sectors::turn;
use crate::tiling::{kind, neighbours, step};
use deltille_core::lattice::{GridKind, LatticeMap, Vertex};
use deltille_core::raster::Pyramid;

/// Maximum distance of a vertex from the corners of a grid, in edges of the map. Farther away, the map predicts almost
/// nothing.
const MAX_REACH: f64 = 4.0;

/// Maximum mean length of the edges beyond a grid that approaches the camera, relative to the
/// longest edge of the grid.
const NEARER: f64 = 2.0;

/// Maximum standard deviations of a predicted position, in edges, in the order in which they are
/// tried: reliable corners improve the predictions of the rest. Within 3σ at the largest, a
/// position is nearer to its vertex than to anything else in a tile.
const SIGMAS: [f64; 3] = [0.02, 0.04, 0.08];

/// Maximum distance of a corner from its predicted position, in standard deviations.
const MAX_SIGMAS: f64 = 3.0;

/// At least one in this many edges to neighbours must be visible.
const MAX_COVERED: usize = 3;

/// Minimum number of corners of a grid that predicts others; an initial quad has four.
const LEAST: usize = 5;

/// Number of corners that are compared in the time of one search in the image, for the budget.
const CORNERS_IN_A_LOOK: usize = 100;

/// Grid and vertex of each saddle in a set of grids.
type Owners = BTreeMap<usize, (usize, Vertex)>;

/// Joins grids that are parts of one board, and adds single corners to them. `places` are those of all saddle points,
/// `members` the indices of those in the grids. Returns which grids have grown.
pub(crate) fn join<const N: usize>(
    pyramid: &Pyramid,
    saddles: &[Saddle<N>],
    places: &Buckets,
    grids: Vec<Growing<N>>,
    members: Vec<BTreeMap<usize, Vertex>>,
    effort: &mut Effort,
) -> Vec<(Growing<N>, bool)> {
    let mut owners: Owners = BTreeMap::new();
    for (grid, members) in members.into_iter().enumerate() {
        owners.extend(members.into_iter().map(|(saddle, vertex)| (saddle, (grid, vertex))));
    }
    let mut order: Vec<usize> = (0..grids.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(grids[i].len()));
    let mut has_grown = vec![false; grids.len()];
    let mut joining = Joining { pyramid, saddles, places, grids, owners, effort };
    for base in order {
        while joining.grids[base].len() >= LEAST {
            let shape = shape(&joining.grids[base]);
            let candidates = joining.candidates(base, shape);
            if !joining.effort.spend(joining.grids[base].len() + candidates.len()) {
                break;
            }
            // Nothing changes until a corner is added.
            if !SIGMAS.into_iter().any(|sigma| joining.adopt(base, &candidates, shape, sigma)) {
                break;
            }
            has_grown[base] = true;
        }
    }
    joining.grids.into_iter().zip(has_grown).filter(|(grid, _)| !grid.is_empty()).collect()
}

/// Grids that are being joined.
struct Joining<'a, const N: usize> {
    pyramid: &'a Pyramid<'a>,
    /// All saddle points, and their spatial index.
    saddles: &'a [Saddle<N>],
    places: &'a Buckets,
    grids: Vec<Growing<N>>,
    /// Saddle points in the grids.
    owners: Owners,
    effort: &'a mut Effort,
}

impl<const N: usize> Joining<'_, N> {
    /// Adds to a grid the candidates that its map confirms. The standard deviation of the prediction may be at most
    /// `sigma` edges. Returns whether any were added.
    fn adopt(
        &mut self,
        base: usize,
        candidates: &[(usize, Vertex)],
        shape: Shape,
        sigma: f64,
    ) -> bool {
        let Self { pyramid, saddles, grids, owners, effort, .. } = self;
        let mut adopted = false;
        for &(index, vertex) in candidates {
            // The search for the nearest corner of the grid visits all of its corners.
            if !effort.spend(1 + grids[base].len() / CORNERS_IN_A_LOOK) {
                break;
            }
            if grids[base].contains_key(&vertex) {
                continue;
            }
            let Some(grown) = belongs(&grids[base], vertex, &saddles[index], shape, sigma) else {
                continue;
            };
            if !is_joined(pyramid, &grids[base], vertex, &grown) {
                continue;
            }
            match owners.get(&index).copied() {
                Some((part, _)) if part == base => {}
                Some((part, from)) => {
                    let turned = (grown.turn + N - grids[part][&from].turn) % N;
                    let map = LatticeMap::taking(kind::<N>(), from, vertex, turned as i32);
                    let is_worth =
                        effort.spend(grids[part].len() + owners.len() / CORNERS_IN_A_LOOK);
                    if is_worth && is_part(&grids[base], &grids[part], map, shape, sigma) {
                        for (from, corner) in std::mem::take(&mut grids[part]) {
                            let turn = (corner.turn + turned) % N;
                            grids[base].insert(map.apply(from), GrownSaddle { turn, ..corner });
                        }
                        for owner in owners.values_mut().filter(|owner| owner.0 == part) {
                            *owner = (base, map.apply(owner.1));
                        }
                        adopted = true;
                    }
                }
                None => {
                    grids[base].insert(vertex, grown);
                    owners.insert(index, (base, vertex));
                    adopted = true;
                }
            }
        }
        adopted
    }

    /// Returns saddle points near a vertex without a corner, each with that vertex, the nearest to the grid first.
    fn candidates(&self, base: usize, shape: Shape) -> Vec<(usize, Vertex)> {
        let grid = &self.grids[base];
        let Some((middle, reach_px)) = surroundings(grid) else {
            return Vec::new();
        };
        let corners: Vec<DVec2> = grid.values().map(|grown| grown.saddle.position).collect();
        let (vertices, corners): (Vec<Vertex>, _) =
            (grid.keys().copied().collect(), Buckets::of(&corners));
        let mut maps: BTreeMap<Vertex, Option<LocalMap>> = BTreeMap::new();
        let mut found: Vec<(f64, usize, Vertex)> = Vec::new();
        for (index, _) in self.places.within(middle, reach_px) {
            let saddle = &self.saddles[index];
            if self.owners.get(&index).is_some_and(|&(grid, _)| grid == base) {
                continue;
            }
            let Some(nearest) = corners.nearest(saddle.position).map(|index| vertices[index])
            else {
                continue;
            };
            let map = maps
                .entry(nearest)
                .or_insert_with(|| LocalMap::about::<N>(nearest, at(grid), shape));
            let Some(DVec2 { x: col, y: row }) = map.and_then(|map| map.steps_to(saddle.position))
            else {
                continue;
            };
            let way = kind::<N>().position(row, col);
            let step = Vertex::new(row.round() as i32, col.round() as i32);
            let vertex = nearest + step;
            if way.x.hypot(way.y) <= MAX_REACH && !grid.contains_key(&vertex) {
                found.push((way.x.hypot(way.y), index, vertex));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, index, vertex)| (index, vertex)).collect()
    }
}

fn at<const N: usize>(grid: &Growing<N>) -> impl Fn(Vertex) -> Option<DVec2> + Copy {
    |v| grid.get(&v).map(|grown| grown.saddle.position)
}

fn shape<const N: usize>(grid: &Growing<N>) -> Shape {
    let level = grid.values().map(|grown| grown.saddle.level).max().unwrap_or(0);
    Shape::of::<N>(grid.keys().copied(), at(grid), level)
}

/// Returns a circle (centre and radius, px) around all positions that a grid predicts.
fn surroundings<const N: usize>(grid: &Growing<N>) -> Option<(DVec2, f64)> {
    let places: Vec<DVec2> = grid.values().map(|grown| grown.saddle.position).collect();
    let edges_px = grid.iter().flat_map(|(&v, grown)| {
        let neighbours = neighbours::<N>(v).into_iter().filter_map(at(grid));
        neighbours.map(|place| place.distance(grown.saddle.position))
    });
    let longest_px = edges_px.reduce(f64::max)?;
    let lower = places.iter().copied().reduce(DVec2::min)?;
    let upper = places.iter().copied().reduce(DVec2::max)?;
    let reach_px = lower.distance(upper) / 2.0 + NEARER * MAX_REACH * longest_px;
    Some((lower.midpoint(upper), reach_px))
}

/// Returns the saddle point as a corner of a grid, if it lies at a vertex and has the predicted edges.
fn belongs<const N: usize>(
    grid: &Growing<N>,
    vertex: Vertex,
    saddle: &Saddle<N>,
    shape: Shape,
    sigma: f64,
) -> Option<GrownSaddle<N>> {
    let map = LocalMap::about::<N>(vertex, at(grid), shape).filter(|map| map.sigma <= sigma)?;
    if map.distance::<N>(saddle.position)? > MAX_SIGMAS * map.sigma {
        return None;
    }
    let colours = contrast_near(grid, vertex)?;
    let ours = saddle.sectors.amplitude;
    if ours.max(colours) > MAX_CONTRAST_RATIO * ours.min(colours) {
        return None;
    }
    // Even rays have the dark side on their left everywhere.
    let parity = match kind::<N>() {
        GridKind::Deltille => 0,
        GridKind::Checker => (vertex.row + vertex.col).rem_euclid(2) as usize,
    };
    let direction = |k: usize| map.along(step::<N>(k)).to_angle();
    let off = |shift: usize| {
        let rotations = (0..N).map(|k| turn(saddle.sectors.rays[k], direction(k + shift)).abs());
        rotations.fold(0.0, f64::max)
    };
    let turn = (parity..N).step_by(2).min_by(|&a, &b| off(a).total_cmp(&off(b)))?;
    (off(turn) <= MAX_CHORD_RAD).then_some(GrownSaddle { saddle: *saddle, turn })
}

/// Returns whether a corner is connected to its neighbours in a grid: some of the edges between them are visible, if
/// there are neighbours. Between separate dots, no edge is visible.
fn is_joined<const N: usize>(
    pyramid: &Pyramid,
    grid: &Growing<N>,
    vertex: Vertex,
    corner: &GrownSaddle<N>,
) -> bool {
    let (mut beside, mut clean) = (0, 0);
    for k in 0..N {
        let Some(other) = grid.get(&(vertex + step::<N>(k))) else {
            continue;
        };
        let (ray, back) = (corner.ray(k), other.ray(k + N / 2));
        beside += 1;
        clean += usize::from(is_clean(
            pyramid,
            End::of(&corner.saddle, ray),
            End::of(&other.saddle, back),
        ));
    }
    MAX_COVERED * clean >= beside
}

/// Returns the contrast of the corner of a grid that is nearest to a vertex on the lattice.
fn contrast_near<const N: usize>(grid: &Growing<N>, vertex: Vertex) -> Option<f64> {
    let far = |v: &Vertex| {
        let step = *v - vertex;
        let way = kind::<N>().position(step.row.into(), step.col.into());
        way.x.hypot(way.y)
    };
    let nearest = grid.iter().min_by(|a, b| far(a.0).total_cmp(&far(b.0)))?;
    Some(nearest.1.saddle.sectors.amplitude)
}

/// Returns whether a part, moved by a lattice map, continues a grid: no vertex is in both, and each
/// of its corners for which there is a prediction is at its predicted position.
fn is_part<const N: usize>(
    grid: &Growing<N>,
    part: &Growing<N>,
    map: LatticeMap,
    shape: Shape,
    sigma: f64,
) -> bool {
    part.iter().all(|(&from, corner)| {
        let vertex = map.apply(from);
        if grid.contains_key(&vertex) {
            return false;
        }
        let predicted =
            LocalMap::about::<N>(vertex, at(grid), shape).filter(|map| map.sigma <= sigma);
        predicted.is_none_or(|map| {
            let distance = map.distance::<N>(corner.saddle.position);
            distance.is_some_and(|distance| distance <= MAX_SIGMAS * map.sigma)
        })
    })
}
