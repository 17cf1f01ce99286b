//! Unfolding: faces laid side by side in the plane, joined along edges of the solid.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::DVec2;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::plane::{Motion, TOUCHING_MM, gap_mm};
use deltille_core::polygon::bounds;
use deltille_core::targets::sides;
use deltille_core::targets::{Polyhedron, SolidShape};

/// Seed of the search for nets of meshes, fixed for repeatable results; its value is arbitrary.
const SEED: u64 = 20;

/// Number of grown nets that are considered further.
const MAX_GROWN: usize = 8;

/// Smallest angle between two cut sides that meet in a vertex, radians: room for a tab with the flattest legs, and for
/// scissors.
const MIN_GAP_RAD: f64 = 25.0 / 180.0 * PI;

/// Returns the number of growth orders tried for a mesh. It decreases with the number of faces, because the time per
/// order grows with its square.
fn tries(faces: usize) -> u64 {
    (400_000 / (faces * faces).max(1)).clamp(4, 64) as u64
}

/// A side of a face: from the vertex with that index to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Side {
    /// Index of the face.
    pub face: usize,
    /// Index of the side: 0 is the lower edge, the others follow counter-clockwise.
    pub side: usize,
}

/// A face laid in the plane.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlatFace {
    /// Index of the face.
    pub face: usize,
    /// Its vertices, counter-clockwise, mm.
    pub corners: Vec<DVec2>,
    /// The side of an earlier face to which it is attached, and its own matching side; `None` for the first face.
    pub hinge: Option<(Side, Side)>,
}

impl FlatFace {
    /// Returns the ends of a side, mm.
    pub(super) fn ends(&self, side: usize) -> [DVec2; 2] {
        [self.corners[side], self.corners[(side + 1) % self.corners.len()]]
    }
}

/// Faces joined in one piece without overlap. The first is the root; every other is attached to an earlier one.
pub(super) type Piece = Vec<FlatFace>;

/// The sides of a solid's faces, matched in pairs.
pub(crate) struct Sides {
    partner: Vec<Vec<Option<Side>>>,
}

impl Sides {
    /// Matches the sides that run along the same edge in opposite directions.
    pub(crate) fn new(solid: &Polyhedron) -> Self {
        let mut along = BTreeMap::new();
        for (face, vertices) in solid.faces.iter().enumerate() {
            for (side, ends) in sides(vertices).enumerate() {
                along.insert(ends, Side { face, side });
            }
        }
        let partners = |vertices: &Vec<usize>| {
            sides(vertices).map(|(from, to)| along.get(&(to, from)).copied()).collect()
        };
        Self { partner: solid.faces.iter().map(partners).collect() }
    }

    /// Iterates over the sides of a face.
    pub(crate) fn of(&self, face: usize) -> impl Iterator<Item = Side> + use<> {
        (0..self.partner[face].len()).map(move |side| Side { face, side })
    }

    /// Returns the other side of the same edge; `None` on the boundary of an open mesh.
    pub(crate) fn partner(&self, side: Side) -> Option<Side> {
        self.partner[side.face][side.side]
    }
}

/// Returns ways to unfold a solid, best first. Each is a list of pieces that together contain every face once. `flat`
/// contains the outlines of the faces, each in its own frame, mm.
///
/// A named solid has its usual nets; any other solid has [`grown`] ones.
pub(super) fn unfoldings(
    solid: &Polyhedron,
    shape: &SolidShape,
    flat: &[Vec<DVec2>],
) -> Vec<Vec<Piece>> {
    let usual = usual(solid, shape, flat);
    if usual.is_empty() { grown(solid, flat) } else { usual }
}

/// Returns the usual nets of a named solid.
fn usual(solid: &Polyhedron, shape: &SolidShape, flat: &[Vec<DVec2>]) -> Vec<Vec<Piece>> {
    let sides = Sides::new(solid);
    let nets = usual_hinges(shape).into_iter().filter_map(|(root, hinges)| {
        let piece = hang(flat, &sides, root, &hinges)?;
        (piece.len() == flat.len()).then(|| vec![piece])
    });
    nets.collect()
}

/// Grows nets from many starting faces in many orders. A face is attached to the first free side where it overlaps
/// nothing. A face that fits nowhere starts another piece, so every result is valid. Results with fewer pieces come
/// first, then those with a smaller bounding box.
fn grown(solid: &Polyhedron, flat: &[Vec<DVec2>]) -> Vec<Vec<Piece>> {
    let sides = Sides::new(solid);
    let mut grown: Vec<Vec<Piece>> =
        (0..tries(flat.len())).map(|n| grow_all(flat, &sides, n, |_, _| true)).collect();
    grown.sort_by(|a, b| a.len().cmp(&b.len()).then(area(a).total_cmp(&area(b))));
    grown.truncate(MAX_GROWN);
    grown
}

/// Grows nets with pieces of at most `most` faces, as a last resort.
pub(super) fn in_small_pieces(
    solid: &Polyhedron,
    flat: &[Vec<DVec2>],
    most: usize,
) -> impl Iterator<Item = Vec<Piece>> {
    let sides = Sides::new(solid);
    let few = move |piece: &[FlatFace], _: &FlatFace| piece.len() < most;
    (0..tries(flat.len())).map(move |seed| grow_all(flat, &sides, seed, few))
}

/// Grows nets with pieces whose corners `fit`, with room for a tab along every cut side.
pub(super) fn in_pieces_that_fit(
    flat: &[Vec<DVec2>],
    sides: &Sides,
    seed: u64,
    fit: impl Fn(&[DVec2]) -> bool,
) -> Vec<Piece> {
    grow_all(flat, sides, seed, |piece, face| {
        let corners = piece.iter().chain([face]).flat_map(|face| face.corners.iter().copied());
        leaves_gaps(piece, face) && fit(&corners.collect::<Vec<_>>())
    })
}

/// Returns whether a face attached to a piece leaves gaps wide enough to the other faces that meet it in a vertex.
/// Along its hinge, the gap must be zero.
fn leaves_gaps(piece: &[FlatFace], face: &FlatFace) -> bool {
    // Directions from a corner to the next corner and to the previous one; the face lies to the left of the first
    // direction.
    let sector = |corners: &[DVec2], n: usize| {
        let count = corners.len();
        [1, count - 1].map(|way| (corners[(n + way) % count] - corners[n]).to_angle())
    };
    let own_side = face.hinge.map(|(_, own)| own.side);
    let count = face.corners.len();
    (0..count).all(|n| {
        let [first, last] = sector(&face.corners, n);
        // The sides along these directions.
        let [on_first, on_last] = [n, (n + count - 1) % count].map(|side| own_side == Some(side));
        piece.iter().all(|other| {
            let meets = |corner: &DVec2| corner.distance(face.corners[n]) < TOUCHING_MM;
            let Some(at) = other.corners.iter().position(meets) else {
                return true;
            };
            let [from, to] = sector(&other.corners, at);
            [(from - last, on_last), (first - to, on_first)].into_iter().all(|(gap, hinged)| {
                let gap = gap.rem_euclid(TAU);
                let closed = gap.min(TAU - gap) < 1e-6;
                if closed { hinged } else { gap >= MIN_GAP_RAD }
            })
        })
    })
}

fn area(pieces: &[Piece]) -> f64 {
    let area = |piece: &Piece| {
        let [x0, y0, x1, y1] = bounds(piece.iter().flat_map(|face| &face.corners));
        (x1 - x0) * (y1 - y0)
    };
    pieces.iter().map(area).sum()
}

/// Returns the root and the (parent, child) pairs of the usual nets of a named solid.
fn usual_hinges(shape: &SolidShape) -> Vec<(usize, Vec<(usize, usize)>)> {
    match shape {
        // A large triangle around the base, or a strip.
        SolidShape::Tetrahedron => {
            vec![(3, vec![(3, 0), (3, 1), (3, 2)]), (0, vec![(0, 1), (1, 2), (2, 3)])]
        }
        // Four rows in two columns: a zigzag of the upper faces, the lower ones at its sides.
        SolidShape::Octahedron => {
            vec![(0, vec![(0, 1), (1, 2), (2, 3), (0, 4), (1, 5), (2, 6), (3, 7)])]
        }
        // A belt of ten, with five teeth above and five below; see `Polyhedron`.
        SolidShape::Icosahedron => {
            let belt = (0..5).flat_map(|k| {
                let next = (k < 4).then_some((10 + k, 5 + k + 1));
                [(5 + k, 10 + k)].into_iter().chain(next)
            });
            let belt = belt.map(|(a, b)| if (a, b) == (5, 10) { (b, a) } else { (a, b) });
            let teeth = (0..5).flat_map(|k| [(5 + k, k), (10 + k, 15 + k)]);
            vec![(10, belt.chain(teeth).collect())]
        }
        // A cross: a belt of four, and the ends above and below its second face.
        SolidShape::Cube | SolidShape::Cuboid(_) => {
            vec![(1, vec![(1, 0), (1, 2), (2, 3), (1, 4), (1, 5)])]
        }
        // Derived from the shape.
        _ => Vec::new(),
    }
}

/// Lays out the faces according to the pairs of parent and child; `None` if two overlap.
fn hang(
    flat: &[Vec<DVec2>],
    sides: &Sides,
    root: usize,
    hinges: &[(usize, usize)],
) -> Option<Piece> {
    let mut piece = vec![FlatFace { face: root, corners: flat[root].clone(), hinge: None }];
    let mut left = hinges.to_vec();
    while !left.is_empty() {
        let before = left.len();
        for (parent, child) in std::mem::take(&mut left) {
            let Some(on) = piece.iter().find(|face| face.face == parent) else {
                left.push((parent, child));
                continue;
            };
            let joins =
                |side: &Side| sides.partner(*side).is_some_and(|partner| partner.face == child);
            let side = sides.of(parent).find(joins)?;
            let face = beside(flat, on, side, sides.partner(side)?);
            if !is_free(&piece, &face.corners) {
                return None;
            }
            piece.push(face);
        }
        if left.len() == before {
            return None;
        }
    }
    Some(piece)
}

/// Lays a face beside another, across one of its sides.
fn beside(flat: &[Vec<DVec2>], on: &FlatFace, side: Side, own: Side) -> FlatFace {
    let outline = &flat[own.face];
    let next = (own.side + 1) % outline.len();
    let [p, q] = on.ends(side.side);
    let motion = Motion::carrying([outline[own.side], outline[next]], [q, p]);
    let mut corners: Vec<DVec2> = outline.iter().map(|&corner| motion.apply(corner)).collect();
    // The shared ends are exactly equal, not only up to rounding.
    corners[own.side] = q;
    corners[next] = p;
    FlatFace { face: own.face, corners, hinge: Some((side, own)) }
}

/// Returns whether a face does not overlap any face of a piece.
fn is_free(piece: &[FlatFace], corners: &[DVec2]) -> bool {
    let [x0, y0, x1, y1] = bounds(corners);
    piece.iter().all(|face| {
        let [left, lower, right, upper] = bounds(&face.corners);
        left > x1
            || right < x0
            || lower > y1
            || upper < y0
            || gap_mm(&face.corners, corners) >= -TOUCHING_MM
    })
}

/// Grows pieces until every face belongs to one. `may` decides whether a piece accepts a face.
fn grow_all(
    flat: &[Vec<DVec2>],
    sides: &Sides,
    seed: u64,
    may: impl Fn(&[FlatFace], &FlatFace) -> bool,
) -> Vec<Piece> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED + seed);
    let mut placed = vec![false; flat.len()];
    let mut pieces = Vec::new();
    while let Some(first) = (0..flat.len()).find(|&face| !placed[face]) {
        let free: Vec<usize> = (first..flat.len()).filter(|&face| !placed[face]).collect();
        let root = if seed == 0 { first } else { free[random.random_range(0..free.len())] };
        // Half of the orders keep the piece compact, the others grow at random.
        let round = seed.is_multiple_of(2);
        pieces.push(grow(flat, sides, root, round, &may, &mut placed, &mut random));
    }
    pieces
}

/// Grows one piece from its `root`, compact if `round`. `placed` marks the faces already used.
fn grow(
    flat: &[Vec<DVec2>],
    sides: &Sides,
    root: usize,
    round: bool,
    may: &impl Fn(&[FlatFace], &FlatFace) -> bool,
    placed: &mut [bool],
    random: &mut ChaCha8Rng,
) -> Piece {
    let centre = flat[root].iter().sum::<DVec2>() / flat[root].len() as f64;
    placed[root] = true;
    let mut piece = vec![FlatFace { face: root, corners: flat[root].clone(), hinge: None }];
    let mut open: Vec<(usize, usize)> = (0..flat[root].len()).map(|side| (0, side)).collect();
    while !open.is_empty() {
        let distance = |&(at, side): &(usize, usize)| {
            let [p, q] = piece[at].ends(side);
            ((p + q) / 2.0).distance_squared(centre)
        };
        let next = if round {
            let nearest =
                open.iter().enumerate().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
            nearest.map_or(0, |(index, _)| index)
        } else {
            random.random_range(0..open.len())
        };
        let (at, side) = open.remove(next);
        let side = Side { face: piece[at].face, side };
        let Some(own) = sides.partner(side).filter(|own| !placed[own.face]) else { continue };
        let face = beside(flat, &piece[at], side, own);
        if may(&piece, &face) && is_free(&piece, &face.corners) {
            placed[own.face] = true;
            let others = (0..face.corners.len()).filter(|&s| s != own.side);
            open.extend(others.map(|s| (piece.len(), s)));
            piece.push(face);
        }
    }
    piece
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::placing::net::tabs;

    /// A named solid with moved vertices. Unfolding must preserve the lengths of its edges.
    fn dented(shape: &SolidShape, moves: &[DVec3]) -> Polyhedron {
        let mut solid = match shape {
            SolidShape::Tetrahedron => Polyhedron::tetrahedron(100.0),
            SolidShape::Octahedron => Polyhedron::octahedron(100.0),
            SolidShape::Cube => Polyhedron::cuboid(DVec3::splat(100.0)),
            SolidShape::Cuboid(sides) => Polyhedron::cuboid(*sides * 60.0),
            _ => Polyhedron::icosahedron(100.0),
        };
        for (vertex, by) in solid.vertices_mm.iter_mut().zip(moves) {
            *vertex += *by;
        }
        solid
    }

    fn outlines(solid: &Polyhedron) -> Vec<Vec<DVec2>> {
        let outline = |face| solid.face(face, 6, 1.0).unwrap().outline_mm;
        (0..solid.faces.len()).map(outline).collect()
    }

    /// Checks that an unfolding can be folded: every face appears once with its own lengths, the right way up, and
    /// hinges are joined. Also checks that it can be printed: nothing overlaps, and every cut edge has a tab.
    fn check(solid: &Polyhedron, pieces: &[Piece]) -> Result<(), TestCaseError> {
        let mut faces: Vec<usize> = pieces.iter().flatten().map(|face| face.face).collect();
        faces.sort_unstable();
        prop_assert_eq!(faces, (0..solid.faces.len()).collect::<Vec<_>>());
        let sides = Sides::new(solid);
        let tabs = tabs::place(pieces, &sides).expect("there is room for every tab");
        let tabbed = tabs.iter().flatten().count();
        prop_assert_eq!(tabbed, tabs::cut_edges(pieces, &sides).len());
        for (piece, tabs) in pieces.iter().zip(&tabs) {
            prop_assert_eq!(piece.iter().filter(|face| face.hinge.is_none()).count(), 1);
            for face in piece {
                let space = solid.corners_mm(face.face);
                for side in 0..space.len() {
                    let [p, q] = face.ends(side);
                    let length = space[side].distance(space[(side + 1) % space.len()]);
                    prop_assert!((p.distance(q) - length).abs() < 1e-9);
                }
                prop_assert!(deltille_core::polygon::area(&face.corners) > 0.0);
                if let Some((on, own)) = face.hinge {
                    let on_face = piece.iter().find(|other| other.face == on.face).unwrap();
                    let [p, q] = on_face.ends(on.side);
                    prop_assert_eq!(face.ends(own.side), [q, p]);
                    prop_assert_eq!(sides.partner(on), Some(own));
                }
            }
            let polygons = piece.iter().map(|face| &face.corners[..]);
            let polygons: Vec<&[DVec2]> =
                polygons.chain(tabs.iter().map(|tab| &tab.corners[..])).collect();
            for (n, a) in polygons.iter().enumerate() {
                for b in &polygons[n + 1..] {
                    prop_assert!(gap_mm(a, b) >= -2.0 * TOUCHING_MM);
                }
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn every_unfolding_can_be_printed_and_folded(
            shape in 0usize..3,
            moves in prop::collection::vec(prop::array::uniform3(-12.0f64..12.0), 12),
        ) {
            use SolidShape::{Icosahedron, Octahedron, Tetrahedron};
            let shape = [Tetrahedron, Octahedron, Icosahedron][shape].clone();
            let moves: Vec<DVec3> = moves.into_iter().map(DVec3::from).collect();
            let solid = dented(&shape, &moves);
            let flat = outlines(&solid);
            for net in usual(&solid, &shape, &flat).iter().chain(&grown(&solid, &flat)[..2]) {
                check(&solid, net)?;
            }
            for pieces in in_small_pieces(&solid, &flat, 3).take(2) {
                check(&solid, &pieces)?;
            }
        }
    }

    /// A ball of 80 triangles: each face of an icosahedron divided into four and projected onto the sphere.
    fn ball() -> Polyhedron {
        let core = Polyhedron::icosahedron(100.0);
        let radius = core.vertices_mm[0].length();
        let mut vertices_mm = core.vertices_mm.clone();
        let edges = core.edges();
        vertices_mm.extend(
            edges
                .iter()
                .map(|&[a, b]| (core.vertices_mm[a] + core.vertices_mm[b]).normalize() * radius),
        );
        let middle = |a: usize, b: usize| {
            let edge = [a.min(b), a.max(b)];
            core.vertices_mm.len() + edges.iter().position(|e| *e == edge).unwrap()
        };
        let faces = core.faces.iter().flat_map(|face| {
            let [a, b, c] = face[..] else { panic!("a triangle") };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(Vec::from)
        });
        Polyhedron { vertices_mm, faces: faces.collect() }
    }

    #[test]
    fn a_ball_of_many_faces_is_one_net() {
        let ball = ball();
        let flat = outlines(&ball);
        let nets = grown(&ball, &flat);
        check(&ball, &nets[0]).unwrap();
        assert_eq!(nets[0].len(), 1);
    }

    #[test]
    fn regular_solids_have_their_usual_nets_in_one_piece() {
        use SolidShape::{Cube, Cuboid, Icosahedron, Octahedron, Tetrahedron};
        let box_of = Cuboid(DVec3::new(2.0, 1.6, 1.2));
        for shape in [Tetrahedron, Octahedron, Icosahedron, Cube, box_of] {
            let solid = dented(&shape, &[]);
            let flat = outlines(&solid);
            for net in usual(&solid, &shape, &flat).iter().chain(&grown(&solid, &flat)) {
                assert_eq!(net.len(), 1);
                check(&solid, net).unwrap();
            }
            assert!(!usual(&solid, &shape, &flat).is_empty());
        }
    }
}
