//! Grows grids from linked corners: initial quads and breadth-first growth.
//!
//! A corner has N rays, six or four, along the edges that meet there. It is *linked* along a ray to the corner at the
//! other end of the edge. In a grid, it has a lattice vertex and a *turn*: its ray k points along step `k + turn` (mod
//! N) of the lattice ([`step`]). Rays with even numbers begin dark sectors. On a deltille grid,
//! turns are therefore even, and the upright tiles are the dark ones, even on inverted boards. On a
//! checkerboard, the turn is even where row + column is even, and the square to the upper right of
//! that corner is dark.
//!
//! Every grid has a separate lattice frame, which is known up to a motion of the lattice.
//! [`label`](crate::labels::placement) locates it on the target.

use std::collections::{HashSet, VecDeque};

use super::links::link::{Link, Links};
use crate::tiling::{kind, step};
use deltille_core::lattice::{GridKind, Vertex};

/// Position of a corner in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// Its lattice vertex.
    pub(super) vertex: Vertex,
    /// Ray k points along step `k + turn` (mod N) of the lattice.
    pub(super) turn: usize,
}

/// A corner at a position of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placed {
    /// Index of the corner.
    pub(super) corner: usize,
    /// Its position.
    pub(super) place: Place,
}

/// The four corners from which a grid grows.
pub(super) type Seed = [Placed; 4];

/// Returns all seeds. Seeds whose corners have the most links come first, because links are missing
/// near errors.
///
/// ```text
///     D ───── C          A at (0,0), B at (0,1), C at (1,0), D at (1,−1): the two tiles A B C and
///      ╲ ░░░ ╱█╲         A C D share an edge
///       ╲ ░ ╱███╲
///        A ───── B       on a checkerboard C at (1,1) and D at (1,0): the one dark square A B C D
/// ```
///
/// All five edges of the two triangles, or four of the square, must be linked, which they are from both ends.
pub(super) fn seeds<const N: usize>(links: &[Links<N>]) -> Vec<Seed> {
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

/// Returns the corner that is linked to `from` along step `k` of the lattice.
fn follow<const N: usize>(links: &[Links<N>], from: Placed, k: usize) -> Option<Placed> {
    let link = links[from.corner][(k + N - from.place.turn) % N]?;
    Some(Placed { corner: link.corner, place: across::<N>(from.place, k, link) })
}

/// Returns the corners of the square that steps `k` and `l` span at `a`, in order around it; `None` unless all four
/// edges are linked.
fn square<const N: usize>(links: &[Links<N>], a: Placed, k: usize, l: usize) -> Option<Seed> {
    let (b, d) = (follow(links, a, k)?, follow(links, a, l)?);
    let c = follow(links, b, l)?;
    (follow(links, d, k) == Some(c)).then_some([a, b, c, d])
}

/// Returns the position at the far end of the link that leaves `from` along step `k` of the lattice.
fn across<const N: usize>(from: Place, k: usize, link: Link) -> Place {
    // `link.ray` is the ray of the other corner that points back, so it points along the opposite step.
    Place { vertex: from.vertex + step::<N>(k), turn: (k + N / 2 + N - link.ray) % N }
}

/// Grids that grow along links, one after the other.
pub(super) struct Growth<'a, const N: usize> {
    links: &'a [Links<N>],
    /// For each corner, whether an earlier grid has it.
    pub(super) taken: Vec<bool>,
    /// For each corner, its position in the growing grid.
    places: Vec<Option<Place>>,
    /// Corners of the growing grid, in the order in which they joined.
    members: Vec<usize>,
    /// Vertices of these corners.
    occupied: HashSet<Vertex>,
    /// Corners whose links are still to be followed.
    queue: VecDeque<usize>,
}

impl<'a, const N: usize> Growth<'a, N> {
    pub(super) fn new(links: &'a [Links<N>]) -> Self {
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

    /// Grows a grid from a seed, breadth first, and returns its corners with their positions.
    ///
    /// A corner joins when it closes a tile, because a single link may be wrong. It closes a
    /// triangle, or a square at a concave corner of the grid's outline, when two corners of the
    /// grid agree on its position. On a straight side of a checkerboard, two new corners close a
    /// square together.
    pub(super) fn grow(&mut self, seed: &Seed) -> Vec<Placed> {
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

    /// Returns whether the corner belongs to no grid yet, and its vertex is not occupied in this one.
    fn is_free(&self, Placed { corner, place }: Placed) -> bool {
        !self.taken[corner]
            && self.places[corner].is_none()
            && !self.occupied.contains(&place.vertex)
    }

    /// Returns the number of corners of the grid that are linked to `next` as its position requires. Returns `None` if
    /// a link implies another position.
    fn votes(&self, next: Placed) -> Option<usize> {
        let linked = (0..N).filter_map(|k| follow(self.links, next, k));
        let mut known = linked.filter_map(|next| Some(self.places[next.corner]? == next.place));
        known.try_fold(0, |votes, agrees| agrees.then_some(votes + 1))
    }

    /// Adds a corner, and follows the links of its neighbours in the grid once more.
    fn join(&mut self, next: Placed) {
        self.add(next);
        // Neighbouring corners that lacked one vote may now have it.
        let linked = (0..N).filter_map(|k| follow(self.links, next, k)).map(|next| next.corner);
        self.queue.extend(linked.filter(|&corner| self.places[corner].is_some()));
    }

    /// Adds the corner that follows `at` along step `k`, together with a neighbour, if these two
    /// close a square with an edge of the grid.
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

#[cfg(test)]
mod tests {
    use proptest::bool::weighted;
    use proptest::collection::vec;
    use proptest::prelude::*;

    use std::collections::BTreeSet;

    use super::*;
    use crate::tiling::{CHECKER, DELTILLE};

    /// Returns a vertex rotated about the origin by `by` steps.
    fn turned<const N: usize>(vertex: Vertex, by: usize) -> Vertex {
        let [along, up] = [by, by + 1].map(step::<N>);
        let sum = |a: i32, b: i32| vertex.col * a + vertex.row * b;
        Vertex::new(sum(along.row, up.row), sum(along.col, up.col))
    }

    /// Creates links between the corners of a lattice with missing ones; the rays of each are counted from an arbitrary
    /// one.
    fn linked<const N: usize>(
        vertices: &[Vertex],
        rotations: &[usize],
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
                let ray = |corner: usize, k: usize| (k + N - rotations[corner]) % N;
                let [out, back] = [ray(a, k), ray(b, k + N / 2)];
                links[a][out] = Some(Link { corner: b, ray: back });
                links[b][back] = Some(Link { corner: a, ray: out });
            }
        }
        links
    }

    /// Grids are parts of the lattice, rotated and shifted. No corner has two positions, and no
    /// position has two corners. Without holes there is one grid of all corners.
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
        let rotations: Vec<usize> = vertices
            .iter()
            .enumerate()
            .map(|(i, &v)| (2 * (i * seed % N) + parity(v)) % N)
            .collect();
        let links = linked::<N>(&vertices, &rotations, lost);
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
                let truth = vertices[root] + turned::<N>(place.vertex, rotations[root]);
                assert_eq!(truth, vertices[corner]);
                assert_eq!((place.turn + rotations[root]) % N, rotations[corner]);
            }
        }
        if !holes.contains(&true) && !lost.contains(&true) {
            assert_eq!(seen.len(), vertices.len());
        }
    }

    proptest! {
        #[test]
        fn grown_grids_are_the_lattice(
            holes in vec(weighted(0.15), 49), lost in vec(weighted(0.05), 100), seed in 0..1000usize,
        ) {
            let none = [false; 49];
            for (holes, lost) in [(&holes[..], &lost[..]), (&none, &none)] {
                grids_are_the_lattice::<DELTILLE>(holes, lost, seed);
                grids_are_the_lattice::<CHECKER>(holes, lost, seed);
            }
        }
    }
}
