//! Folding: one face is placed at its stated position, and the others are rotated about the common edges by the
//! angles between the faces. Several faces are tried as the first; the one that leaves the fewest faces displaced is
//! used.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use glam::{DMat3, DVec2, DVec3};

use crate::finding::fold::FoldFinding;
use crate::net::motion::{FOLD_TOLERANCE_MM, SpaceFromPage};
use crate::net::printed_net::{Net, Side};

/// Number of roots tried if the first leads to a contradiction: that root may be the misprinted face itself.
const MAX_ROOTS: usize = 32;

/// The face of the solid at whose position a printed face ends when the net is folded.
pub(super) struct Place {
    /// Index of the face that belongs there.
    slot: usize,
    /// Vertices of the solid where the corners of the printed outline end.
    vertices: Vec<usize>,
    /// Pose of the part of the page with this face.
    pub space_from_page: SpaceFromPage,
}

/// The faces of a piece after folding.
pub(super) struct Folded {
    /// Index of each face that was reached, and its position.
    pub places: Vec<(usize, Place)>,
    /// Deviations from the target.
    pub findings: Vec<FoldFinding>,
    /// Whether a face is at the position of another, rotated, or not reached.
    pub misplaced: bool,
    /// Largest distance of a folded corner from its stated position, mm, over faces at their own positions.
    pub deviation_mm: f64,
}

impl Net {
    /// Returns the pieces of a sheet: sets of faces connected by folds, the largest first.
    pub(super) fn pieces(&self, sheet: usize) -> Vec<Vec<usize>> {
        let mut left: BTreeSet<usize> =
            (0..self.faces.len()).filter(|&face| self.faces[face].sheet == sheet).collect();
        let mut pieces = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut piece = vec![first];
            let mut next = 0;
            while let Some(&face) = piece.get(next) {
                let beside = self.sides_of(face).filter_map(|side| self.folds.get(&side));
                piece.extend(beside.map(|side| side.face).filter(|face| left.remove(face)));
                next += 1;
            }
            piece.sort_unstable();
            pieces.push(piece);
        }
        pieces.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
        pieces
    }

    /// Whether faces lack the fold that connects them to another piece, that is, whether one of their sides is
    /// neither folded nor numbered.
    pub(super) fn is_broken_off(&self, members: &[usize]) -> bool {
        let mut sides = members.iter().flat_map(|&face| self.sides_of(face));
        sides.any(|at| {
            !self.folds.contains_key(&at) && self.faces[at.face].numbers[at.side].is_empty()
        })
    }

    /// Folds the faces of a piece, `members`, about several roots and returns the result with the fewest findings: if
    /// the root is a misprinted face, all other faces are displaced.
    pub(super) fn best_fold(&self, members: &[usize]) -> Folded {
        let mut best: Option<Folded> = None;
        for &root in members.iter().take(MAX_ROOTS) {
            let folded = self.fold(members, root);
            let fewer = |best: &Folded| folded.findings.len() < best.findings.len();
            if best.as_ref().is_none_or(fewer) {
                best = Some(folded);
            }
            if best.as_ref().is_some_and(|best| best.findings.is_empty()) {
                break;
            }
        }
        let nothing = Folded {
            places: Vec::new(),
            findings: Vec::new(),
            misplaced: false,
            deviation_mm: 0.0,
        };
        best.unwrap_or(nothing)
    }

    /// Places `root` at its stated position, and folds the others one after the other, breadth first.
    fn fold(&self, members: &[usize], root: usize) -> Folded {
        let face = &self.faces[root];
        let pose = &self.poses[root];
        // space_from_panel · panel_from_page, with the inverse rotation about z.
        let back = DVec2::new(face.page_from_panel.turn.x, -face.page_from_panel.turn.y);
        let columns = [DVec2::X, DVec2::Y].map(|axis| back.rotate(axis).extend(0.0));
        let linear = pose.linear * DMat3::from_cols(columns[0], columns[1], DVec3::Z);
        let origin = back.rotate(-face.page_from_panel.shift).extend(0.0);
        let space_from_page = SpaceFromPage { linear, shift: pose.linear * origin + pose.shift };
        let mut places: BTreeMap<usize, Place> = BTreeMap::new();
        let vertices = face.vertices.clone();
        places.insert(root, Place { slot: root, vertices, space_from_page });
        let mut queue = VecDeque::from([root]);
        while let Some(parent) = queue.pop_front() {
            for side in self.sides_of(parent) {
                let Some(&own) = self.folds.get(&side) else { continue };
                if !places.contains_key(&own.face)
                    && let Some(place) = self.across(&places[&parent], side, own)
                {
                    places.insert(own.face, place);
                    queue.push_back(own.face);
                }
            }
        }
        self.judge(members, places)
    }

    /// Returns the position of the face whose side `own` is folded against the `side` of a face at position `parent`;
    /// `None` if the solid has no face across that edge. The fold rotates by the angle between the stated normals of
    /// the two positions, about their common edge.
    fn across(&self, parent: &Place, side: Side, own: Side) -> Option<Place> {
        let [a, b] = [0, 1].map(|end| parent.vertices[(side.side + end) % parent.vertices.len()]);
        let &Side { face: slot, side: slot_side } = self.along.get(&[b, a])?;
        // The child's side runs from b to a, as the side of that position does if it has the same number of corners.
        let (there, count) = (&self.faces[slot].vertices, self.faces[own.face].vertices.len());
        if there.len() != count {
            return None;
        }
        let at = |corner: usize| there[(slot_side + corner + count - own.side) % count];
        let vertices = (0..count).map(at).collect();
        let axis = (self.vertices_mm[&b] - self.vertices_mm[&a]).normalize_or(DVec3::X);
        let [from, to] = [parent.slot, slot].map(|slot| self.poses[slot].linear.z_axis);
        let angle_rad = axis.dot(from.cross(to)).atan2(from.dot(to));
        let ([p, q], [q_own, p_own]) = (self.ends(side), self.ends(own));
        let edge = [(p + p_own) / 2.0, (q + q_own) / 2.0];
        let space_from_page = parent.space_from_page.folded(edge, angle_rad);
        Some(Place { slot, vertices, space_from_page })
    }

    /// Compares the position that each face reaches with its stated position, and folded corners
    /// with stated ones.
    fn judge(&self, members: &[usize], places: BTreeMap<usize, Place>) -> Folded {
        let (mut findings, mut deviation_mm, mut misplaced) = (Vec::new(), 0.0f64, false);
        for &index in members {
            let (face, panel) = (&self.faces[index], self.faces[index].panel);
            let Some(place) = places.get(&index) else {
                misplaced = true;
                findings.push(FoldFinding::FaceLoose { panel });
                continue;
            };
            if place.slot != index {
                misplaced = true;
                let instead = self.faces[place.slot].panel;
                findings.push(FoldFinding::FaceElsewhere { panel, instead });
                continue;
            }
            if place.vertices != face.vertices {
                misplaced = true;
                let count = face.vertices.len();
                let is_turned_by = |n: &usize| {
                    (0..count).all(|i| place.vertices[(i + count - n) % count] == face.vertices[i])
                };
                let rotations = (0..count).find(is_turned_by).unwrap_or_default();
                let angle_deg = 360.0 / count as f64 * rotations as f64;
                findings.push(FoldFinding::FaceTurned { panel, angle_deg });
                continue;
            }
            let off =
                |&(at, space): &(DVec2, DVec3)| place.space_from_page.apply(at).distance(space);
            let most = face.corners.iter().map(off).fold(0.0, f64::max);
            deviation_mm = deviation_mm.max(most);
            if most > FOLD_TOLERANCE_MM {
                findings.push(FoldFinding::FoldOff { panel, by_mm: most });
            }
        }
        Folded { places: places.into_iter().collect(), findings, misplaced, deviation_mm }
    }
}
