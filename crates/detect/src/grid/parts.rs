//! Joins the parts of a partly covered board through the maps of one part.
//!
//! A finger over a board splits it into grids that no link joins, and single corners without a
//! completely visible tile. The local map of a grid ([`LocalMap`]) predicts where its lattice
//! continues behind the finger, and its homography (`PlaneMap`) behind a hand. A corner there belongs
//! to the board if it lies at a vertex and all its edges have the predicted directions and dark
//! sides. A grid belongs to the same board if all its corners for which there is a prediction do.

use std::collections::BTreeMap;

use glam::DVec2;

use super::effort::Effort;
use super::links::edge::{End, MAX_CHORD_RAD, is_clean};
use super::links::link::MAX_CONTRAST_RATIO;
use super::map::local_map::{LocalMap, Shape};
use super::map::maps::Maps;
use super::saddle_grid::{Growing, GrownSaddle};
use crate::corners::buckets::Buckets;
use crate::corners::saddles::Saddle;
use crate::corners::sectors::turn;
use crate::tiling::{kind, neighbours, step};
use deltille_core::lattice::{GridKind, LatticeMap, Vertex};
use deltille_core::raster::Pyramid;

/// Maximum distance of a vertex from the corners of a grid, in edges, that the local map predicts.
const MAX_REACH: f64 = 4.0;

/// Maximum distance that the homography predicts: the other end of a large board.
const MAX_PLANE_REACH: f64 = 16.0;

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
            let maps = maps(&joining.grids[base]);
            let candidates = joining.candidates(base, &maps);
            if !joining.effort.spend(joining.grids[base].len() + candidates.len()) {
                break;
            }
            // Nothing changes until a corner is added.
            if !SIGMAS.into_iter().any(|sigma| joining.adopt(base, &candidates, &maps, sigma)) {
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
        maps: &Maps,
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
            let Some(map) = maps.about::<N>(vertex, at(&grids[base]), sigma) else {
                continue;
            };
            let Some(grown) = belongs(&grids[base], vertex, &saddles[index], &map) else {
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
                    if is_worth && is_part(&grids[base], &grids[part], map, maps, sigma) {
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
                    // A distant corner may belong to anything, unless an edge connects it to another one.
                    let is_confirmed = !is_distant(&grids[base], vertex, maps.shape)
                        || candidates.iter().any(|&(other, beside)| {
                            let Some(k) = (0..N).find(|&k| vertex + step::<N>(k) == beside) else {
                                return false;
                            };
                            let map = maps.about::<N>(beside, at(&grids[base]), sigma);
                            map.and_then(|map| belongs(&grids[base], beside, &saddles[other], &map))
                                .is_some_and(|other| is_edge(pyramid, &grown, k, &other))
                        });
                    if !is_confirmed {
                        continue;
                    }
                    grids[base].insert(vertex, grown);
                    owners.insert(index, (base, vertex));
                    adopted = true;
                }
            }
        }
        adopted
    }

    /// Returns saddle points near a vertex without a corner, each with that vertex, the nearest to the grid first.
    fn candidates(&self, base: usize, maps: &Maps) -> Vec<(usize, Vertex)> {
        let grid = &self.grids[base];
        let reach = if maps.plane.is_some() { MAX_PLANE_REACH } else { MAX_REACH };
        let Some((middle, reach_px)) = surroundings(grid, reach) else {
            return Vec::new();
        };
        let corners: Vec<DVec2> = grid.values().map(|grown| grown.saddle.position).collect();
        let (vertices, corners): (Vec<Vertex>, _) =
            (grid.keys().copied().collect(), Buckets::of(&corners));
        let mut about: BTreeMap<Vertex, Option<LocalMap>> = BTreeMap::new();
        let mut found: Vec<(f64, usize, Vertex)> = Vec::new();
        for (index, _) in self.places.within(middle, reach_px) {
            let place = self.saddles[index].position;
            if self.owners.get(&index).is_some_and(|&(grid, _)| grid == base) {
                continue;
            }
            let Some(nearest) = corners.nearest(place).map(|index| vertices[index]) else {
                continue;
            };
            let map = about
                .entry(nearest)
                .or_insert_with(|| LocalMap::about::<N>(nearest, at(grid), maps.shape));
            let near = map.and_then(|map| map.steps_to(place)).and_then(|way| {
                let step = Vertex::new(way.y.round() as i32, way.x.round() as i32);
                let far = kind::<N>().position(way.y, way.x).length();
                (far <= MAX_REACH).then_some((far, nearest + step))
            });
            let distant = || {
                let vertex = maps.plane.as_ref()?.nearest(place)?;
                Some((steps_between::<N>(nearest, vertex), vertex))
            };
            let Some((far, vertex)) = near.or_else(distant) else { continue };
            if far <= reach && !grid.contains_key(&vertex) {
                found.push((far, index, vertex));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, index, vertex)| (index, vertex)).collect()
    }
}

fn maps<const N: usize>(grid: &Growing<N>) -> Maps {
    let level = grid.values().map(|grown| grown.saddle.level).max().unwrap_or(0);
    Maps::of::<N>(grid.keys().copied(), at(grid), level)
}

/// Returns whether only the homography predicts a vertex, and the grid has none of its neighbours.
fn is_distant<const N: usize>(grid: &Growing<N>, vertex: Vertex, shape: Shape) -> bool {
    let is_alone = !neighbours::<N>(vertex).iter().any(|v| grid.contains_key(v));
    let largest = SIGMAS[SIGMAS.len() - 1];
    let local = || LocalMap::about::<N>(vertex, at(grid), shape);
    is_alone && local().is_none_or(|map| map.sigma > largest)
}

/// Returns the distance between two vertices on the print, in edges of equal spacing.
fn steps_between<const N: usize>(from: Vertex, to: Vertex) -> f64 {
    let step = to - from;
    kind::<N>().position(step.row.into(), step.col.into()).length()
}

fn at<const N: usize>(grid: &Growing<N>) -> impl Fn(Vertex) -> Option<DVec2> + Copy {
    |v| grid.get(&v).map(|grown| grown.saddle.position)
}

/// Returns a circle (centre and radius, px) around all positions within `reach` edges of a grid.
fn surroundings<const N: usize>(grid: &Growing<N>, reach: f64) -> Option<(DVec2, f64)> {
    let places: Vec<DVec2> = grid.values().map(|grown| grown.saddle.position).collect();
    let edges_px = grid.iter().flat_map(|(&v, grown)| {
        let neighbours = neighbours::<N>(v).into_iter().filter_map(at(grid));
        neighbours.map(|place| place.distance(grown.saddle.position))
    });
    let longest_px = edges_px.reduce(f64::max)?;
    let lower = places.iter().copied().reduce(DVec2::min)?;
    let upper = places.iter().copied().reduce(DVec2::max)?;
    let reach_px = lower.distance(upper) / 2.0 + NEARER * reach * longest_px;
    Some((lower.midpoint(upper), reach_px))
}

/// Returns the saddle point as a corner of a grid, if it lies at a vertex and has the predicted edges.
fn belongs<const N: usize>(
    grid: &Growing<N>,
    vertex: Vertex,
    saddle: &Saddle<N>,
    map: &LocalMap,
) -> Option<GrownSaddle<N>> {
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
        beside += 1;
        clean += usize::from(is_edge(pyramid, corner, k, other));
    }
    MAX_COVERED * clean >= beside
}

/// Returns whether an edge is visible from a corner to its neighbour along step `k` of the lattice.
fn is_edge<const N: usize>(
    pyramid: &Pyramid,
    corner: &GrownSaddle<N>,
    k: usize,
    other: &GrownSaddle<N>,
) -> bool {
    let (ray, back) = (corner.ray(k), other.ray(k + N / 2));
    is_clean(pyramid, End::of(&corner.saddle, ray), End::of(&other.saddle, back))
}

/// Returns the contrast of the corner of a grid that is nearest to a vertex on the lattice.
fn contrast_near<const N: usize>(grid: &Growing<N>, vertex: Vertex) -> Option<f64> {
    let far = |v: &Vertex| steps_between::<N>(vertex, *v);
    let nearest = grid.iter().min_by(|a, b| far(a.0).total_cmp(&far(b.0)))?;
    Some(nearest.1.saddle.sectors.amplitude)
}

/// Returns whether a part, moved by a lattice map, continues a grid: no vertex is in both, and each
/// of its corners for which there is a prediction is at its predicted position.
fn is_part<const N: usize>(
    grid: &Growing<N>,
    part: &Growing<N>,
    map: LatticeMap,
    maps: &Maps,
    sigma: f64,
) -> bool {
    part.iter().all(|(&from, corner)| {
        let vertex = map.apply(from);
        if grid.contains_key(&vertex) {
            return false;
        }
        maps.about::<N>(vertex, at(grid), sigma).is_none_or(|map| {
            let distance = map.distance::<N>(corner.saddle.position);
            distance.is_some_and(|distance| distance <= MAX_SIGMAS * map.sigma)
        })
    })
}
