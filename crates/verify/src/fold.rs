//! Verification of the net of a solid: the faces, each with the pose that its detected corners have
//! on the paper, are folded about their common edges, and must come to lie where the target states.
//!
//! ```text
//!    page            R_child = turn(edge, dihedral angle) · R_parent       solid
//!   ╱╲──╱╲                                                                   ╱│╲
//!  ╱1 ╲╱2 ╲   ──▶   face 1 is laid where it is stated to be; face 2 turns   ╱1│2╲
//!  ────────         about their edge by the angle between the two faces     ‾‾‾‾‾
//! ```
//!
//! Only the fold lines and the numbers of edges are taken from the layout, and the ink of both is
//! compared separately; the places of faces follow from their corners. A face that comes to lie in
//! the place of another, or rotated in its own, is named as such.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use glam::{DMat3, DVec2, DVec3};
use kurbo::Shape as _;
use serde::Serialize;

use super::{Finding, FoldVerdict, SheetVerdict};
use deltille_core::targets::TargetSpec;
use deltille_core::words::counted;
use deltille_layout::artwork;
use deltille_layout::{Label, Printing, SheetLayout};

/// Largest distance of a folded corner, or of an end of an edge, from its stated position, mm: that
/// of meshes, see [`MESH_TOLERANCE_MM`](super::MESH_TOLERANCE_MM).
pub const FOLD_TOLERANCE_MM: f64 = 0.05;

/// Two sides within this distance of each other on the paper are one fold, mm: more than the error
/// of any acceptable print, less than the width of any tab.
const COMMON_MM: f64 = 0.2;

/// Most roots tried where the first leads to a contradiction: it may be the misprinted face itself.
const MOST_ROOTS: usize = 32;

/// A deviation in the fold of a net. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum FoldFinding {
    /// A face is connected to no other by a fold.
    #[error("board {panel} hangs on no other by a fold")]
    FaceLoose {
        /// Panel id.
        panel: u32,
    },
    /// A face is printed in the place of another.
    #[error("board {panel} is printed where board {instead} belongs")]
    FaceElsewhere {
        /// Panel id.
        panel: u32,
        /// Panel that belongs there.
        instead: u32,
    },
    /// A face is rotated in its place.
    #[error("board {panel} is turned by {angle_deg:.0}° in its place")]
    FaceTurned {
        /// Panel id.
        panel: u32,
        /// Angle, degrees, counter-clockwise.
        angle_deg: f64,
    },
    /// Corners of a face, after folding, are not at their stated positions.
    #[error("board {panel}, folded, is off by {by_mm:.3} mm")]
    FoldOff {
        /// Panel id.
        panel: u32,
        /// Largest deviation.
        by_mm: f64,
    },
    /// Two sides that should meet do not.
    #[error(
        "the edges of boards {} and {} are {gap_mm:.3} mm apart when folded",
        panels[0], panels[1]
    )]
    EdgeOpen {
        /// Panels of the faces.
        panels: [u32; 2],
        /// Their distance.
        gap_mm: f64,
    },
    /// Two sides that meet do not carry the same single number.
    #[error(
        "the edge between boards {} and {} has {} on the first, {} on the second",
        panels[0], panels[1], enumerate(&numbers[0]), enumerate(&numbers[1])
    )]
    EdgeNumbers {
        /// Panels of the faces.
        panels: [u32; 2],
        /// The numbers found along each.
        numbers: [Vec<usize>; 2],
    },
    /// A face does not carry its number exactly once.
    #[error("board {panel} carries {} instead of face {stated}", enumerate(names))]
    FaceNumber {
        /// Panel id.
        panel: u32,
        /// The numbers found in it.
        names: Vec<usize>,
        /// Its number.
        stated: usize,
    },
    /// A tab names another face than the one under which its edge leads.
    #[error("a tab of board {panel} names face {named} instead of {stated}")]
    TabNames {
        /// Panel id of the face that the tab is attached to.
        panel: u32,
        /// The face that it names.
        named: usize,
        /// The face under which it is to be glued.
        stated: usize,
    },
    /// A cut edge has no tab, or two.
    #[error(
        "the edge between boards {} and {} has {tabs} tabs instead of one",
        panels[0], panels[1]
    )]
    EdgeTabs {
        /// Panels of the faces.
        panels: [u32; 2],
        /// Number of tabs.
        tabs: usize,
    },
    /// More than two sides carry the same number.
    #[error("edge number {number} is on {}", counted(*sides, "side"))]
    EdgeNumberAgain {
        /// The number.
        number: usize,
        /// Number of sides.
        sides: usize,
    },
}

/// Numbers as part of a sentence.
fn enumerate(numbers: &[usize]) -> String {
    let numbers: Vec<String> = numbers.iter().map(usize::to_string).collect();
    if numbers.is_empty() { "no number".to_owned() } else { numbers.join(" and ") }
}

/// Positions of the corners detected on a sheet, mm in the frame of the sheet: by panel id, then by
/// corner id.
pub(super) type Seen = BTreeMap<u32, BTreeMap<u32, DVec2>>;

/// Whether the sheets of a target are a net: whether faces of a solid are joined by folds.
pub(super) fn is_net(printing: &Printing) -> bool {
    let folds = |sheet: &SheetLayout| sheet.lines.iter().any(|line| line.kind.joins_faces());
    matches!(printing.target.spec, TargetSpec::Solid(_)) && printing.sheets.iter().any(folds)
}

/// Folds the net that was detected, and adds what deviates to the verdicts of the sheets, which are
/// in the order of `seen`. If a face was not detected, nothing is checked: the sheet lacks it anyway.
pub(super) fn check(printing: &Printing, seen: &[Seen], verdicts: &mut [SheetVerdict]) {
    let Some(net) = Net::new(printing, seen) else { return };
    let mut carried = vec![None; net.faces.len()];
    let mut misplaced = false;
    let mut deviations = vec![0.0f64; verdicts.len()];
    for sheet in 0..seen.len() {
        for (index, members) in net.pieces(sheet).into_iter().enumerate() {
            if index > 0 && net.is_broken_off(&members) {
                misplaced = true;
                let loose = |face: usize| FoldFinding::FaceLoose { panel: net.faces[face].panel };
                verdicts[sheet].findings.extend(members.into_iter().map(loose).map(Finding::from));
                continue;
            }
            let folded = net.best_fold(&members);
            misplaced |= folded.misplaced;
            deviations[sheet] = deviations[sheet].max(folded.deviation_mm);
            verdicts[sheet].findings.extend(folded.findings.into_iter().map(Finding::from));
            for (face, at) in folded.places {
                carried[face] = Some(at.space_from_page);
            }
        }
    }
    // Edges of faces that lie in each other's places would only repeat that.
    let mut edges = vec![0; verdicts.len()];
    if !misplaced {
        for edge in net.edges() {
            let sheet = net.faces[edge.sides[1].0].sheet;
            match net.check_edge(&edge, &carried) {
                Ok(gap_mm) => {
                    edges[sheet] += 1;
                    deviations[sheet] = deviations[sheet].max(gap_mm);
                }
                Err(finding) => verdicts[sheet].findings.push(finding.into()),
            }
        }
        let last = verdicts.len() - 1;
        verdicts[last].findings.extend(net.numbers_used_twice().into_iter().map(Finding::from));
        for (index, face) in net.faces.iter().enumerate() {
            let wrong = net.check_words(index).into_iter().map(Finding::from);
            verdicts[face.sheet].findings.extend(wrong);
        }
    }
    for (sheet, verdict) in verdicts.iter_mut().enumerate() {
        let (max_deviation_mm, edges) = (deviations[sheet], edges[sheet]);
        verdict.fold = Some(FoldVerdict { max_deviation_mm, edges });
    }
}

/// A face of the net as it was detected. Side i runs from vertex i to vertex i + 1.
struct PrintedFace {
    /// Panel id.
    panel: u32,
    /// Index of the sheet that it is on.
    sheet: usize,
    /// Its outline on the page, counter-clockwise, mm: the stated one at the detected pose.
    outline_mm: Vec<DVec2>,
    /// Its pose on the page, fitted to the detected corners.
    page_from_panel: Rigid,
    /// Indices of the vertices of the solid at the corners of its outline.
    vertices: Vec<usize>,
    /// The detected corners: the position on the page and the stated one in the target frame, mm.
    corners: Vec<(DVec2, DVec3)>,
    /// Edge numbers printed along each of its sides.
    numbers: Vec<Vec<usize>>,
    /// Tabs on its sides: the side, and the number of the face under which the tab says that it is
    /// to be glued.
    under: Vec<(usize, usize)>,
    /// Face numbers printed in it.
    names: Vec<usize>,
}

/// A rigid motion of the plane, mm: `page = turn · panel + shift`, where `turn` is a unit complex
/// number.
#[derive(Clone, Copy)]
struct Rigid {
    turn: DVec2,
    shift: DVec2,
}

impl Rigid {
    /// The least-squares rigid motion that takes the first point of each pair to the second; `None`
    /// where the points do not determine the rotation. With p and q as complex numbers about their
    /// means, turn ∝ Σ p̄ q.
    fn fit(pairs: &[(DVec2, DVec2)]) -> Option<Self> {
        let n = pairs.len() as f64;
        let p0 = pairs.iter().map(|(p, _)| *p).sum::<DVec2>() / n;
        let q0 = pairs.iter().map(|(_, q)| *q).sum::<DVec2>() / n;
        let conjugate = |p: DVec2| DVec2::new(p.x, -p.y);
        let sum: DVec2 = pairs.iter().map(|(p, q)| conjugate(*p - p0).rotate(*q - q0)).sum();
        let turn = sum.try_normalize()?;
        Some(Self { turn, shift: q0 - turn.rotate(p0) })
    }

    fn apply(&self, p: DVec2) -> DVec2 {
        self.turn.rotate(p) + self.shift
    }
}

/// A pose of a plane in the target frame, mm: `space = linear · (x, y, 0) + shift` with a rotation
/// `linear`. The plane is that of the page, or of a panel.
#[derive(Clone, Copy)]
struct SpaceFromPage {
    linear: DMat3,
    shift: DVec3,
}

impl SpaceFromPage {
    fn apply(&self, p: DVec2) -> DVec3 {
        self.linear * p.extend(0.0) + self.shift
    }

    /// The same pose followed by a rotation by an angle about the line from the first to the second of
    /// two points of the page.
    fn folded(&self, [p, q]: [DVec2; 2], angle_rad: f64) -> Self {
        let (a, b) = (self.apply(p), self.apply(q));
        let turn = DMat3::from_axis_angle((b - a).normalize_or(DVec3::X), angle_rad);
        Self { linear: turn * self.linear, shift: turn * (self.shift - a) + a }
    }
}

/// The face of the solid in whose place a printed face comes to lie when the net is folded.
struct Place {
    /// Index of the face that belongs there.
    slot: usize,
    /// Vertices of the solid where the corners of the printed outline come to lie.
    vertices: Vec<usize>,
    /// Pose of the part of the page with this face.
    space_from_page: SpaceFromPage,
}

/// The faces of a piece after folding.
struct Folded {
    /// Index of each face that was reached, and its place.
    places: Vec<(usize, Place)>,
    /// Deviations from the target.
    findings: Vec<FoldFinding>,
    /// Whether a face is in the place of another, rotated, or was not reached.
    misplaced: bool,
    /// Largest distance of a folded corner from its stated position, mm, of faces in their places.
    deviation_mm: f64,
}

/// An edge of the solid with the two sides that run along it: face and side.
struct Edge {
    sides: [(usize, usize); 2],
}

/// The net as it was detected, and the solid that is to come of it. A side is the index of a face and
/// the number of its side.
struct Net {
    /// All faces, in the order of the target's panels.
    faces: Vec<PrintedFace>,
    /// Stated positions of the vertices of the solid in the target frame, mm.
    vertices_mm: BTreeMap<usize, DVec3>,
    /// Stated pose of each panel in the target frame.
    poses: Vec<SpaceFromPage>,
    /// The side that runs from one vertex of the solid to another.
    along: BTreeMap<[usize; 2], (usize, usize)>,
    /// The side of another face from which each side is separated by a fold only.
    folds: BTreeMap<(usize, usize), (usize, usize)>,
    /// Sides along which a tab is folded.
    tabs: BTreeSet<(usize, usize)>,
}

impl Net {
    /// The net of a target from the corners detected on each sheet; `None` where a face is missing.
    fn new(printing: &Printing, seen: &[Seen]) -> Option<Self> {
        let target = &printing.target;
        let TargetSpec::Solid(spec) = &target.spec else { return None };
        let (outlines, solid) = (spec.faces().ok()?, spec.polyhedron());
        let mut net = Self {
            faces: Vec::with_capacity(target.panels.len()),
            vertices_mm: BTreeMap::new(),
            poses: Vec::with_capacity(target.panels.len()),
            along: BTreeMap::new(),
            folds: BTreeMap::new(),
            tabs: BTreeSet::new(),
        };
        for (index, (panel, face)) in target.panels.iter().zip(&outlines).enumerate() {
            let (sheet, found) =
                seen.iter().enumerate().find_map(|(n, seen)| Some((n, seen.get(&panel.id)?)))?;
            let corner = |c: &deltille_core::targets::Corner| {
                Some((c.panel_mm, *found.get(&c.id)?, c.target_mm))
            };
            let corners: Vec<_> = panel.corners.iter().filter_map(corner).collect();
            let pairs: Vec<_> = corners.iter().map(|&(flat, at, _)| (flat, at)).collect();
            let page_from_panel = Rigid::fit(&pairs)?;
            let vertices = solid.faces.get(index)?.clone();
            for side in 0..vertices.len() {
                let ends = [vertices[side], vertices[(side + 1) % vertices.len()]];
                net.along.insert(ends, (index, side));
            }
            for (&vertex, &corner) in vertices.iter().zip(&face.outline_mm) {
                net.vertices_mm.insert(vertex, panel.pose.target_from_panel(corner));
            }
            net.poses.push(SpaceFromPage {
                linear: panel.pose.matrix(),
                shift: panel.pose.translation_mm,
            });
            net.faces.push(PrintedFace {
                panel: panel.id,
                sheet,
                outline_mm: face.outline_mm.iter().map(|&p| page_from_panel.apply(p)).collect(),
                page_from_panel,
                numbers: vec![Vec::new(); vertices.len()],
                vertices,
                corners: corners.into_iter().map(|(_, at, space)| (at, space)).collect(),
                under: Vec::new(),
                names: Vec::new(),
            });
        }
        for (sheet, layout) in printing.sheets.iter().enumerate() {
            net.find_folds(sheet, layout);
            net.read_numbers(sheet, layout);
        }
        Some(net)
    }

    /// Ends of a side on the page, mm.
    fn ends(&self, (face, side): (usize, usize)) -> [DVec2; 2] {
        let outline = &self.faces[face].outline_mm;
        [outline[side], outline[(side + 1) % outline.len()]]
    }

    /// The sides of a face.
    fn sides_of(&self, face: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        (0..self.faces[face].vertices.len()).map(move |side| (face, side))
    }

    /// The sides of all faces on a sheet.
    fn sides_on(&self, sheet: usize) -> impl Iterator<Item = (usize, usize)> {
        let faces = (0..self.faces.len()).filter(move |&face| self.faces[face].sheet == sheet);
        faces.flat_map(|face| self.sides_of(face))
    }

    /// Notes which sides of two faces lie on one fold line of the layout, and which side of a single
    /// face does, so that a tab hangs on it.
    fn find_folds(&mut self, sheet: usize, layout: &SheetLayout) {
        let sides: Vec<_> = self.sides_on(sheet).map(|side| (side, self.ends(side))).collect();
        for line in layout.lines.iter().filter(|line| line.kind.joins_faces()) {
            let ends = [line.from_mm, line.to_mm].map(DVec2::from);
            let near = |[p, q]: [DVec2; 2]| {
                p.distance(ends[0]) < COMMON_MM && q.distance(ends[1]) < COMMON_MM
            };
            let along = |side: [DVec2; 2]| ends.iter().all(|&end| distance(end, side) < COMMON_MM);
            let forward = sides.iter().find(|(_, ends)| near(*ends));
            let backward = sides.iter().find(|(_, [p, q])| near([*q, *p]));
            if let (Some(&(a, _)), Some(&(b, _))) = (forward, backward) {
                self.folds.insert(a, b);
                self.folds.insert(b, a);
            } else if let Some(&(side, _)) = sides.iter().find(|(_, ends)| along(*ends)) {
                self.tabs.insert(side);
            }
        }
    }

    /// Assigns each printed number to the face in which it stands, or to a side: within a face the
    /// nearest side of that face, outside all faces, as on a tab, the nearest side without a fold.
    fn read_numbers(&mut self, sheet: usize, layout: &SheetLayout) {
        for text in &layout.texts {
            if !text.text.is_number() {
                continue;
            }
            let Ok(outline) = artwork::text_outline(text) else { continue };
            let centre = outline.bounding_box().center();
            let at = DVec2::new(centre.x, centre.y);
            let inside = |face: usize| {
                self.sides_of(face).all(|side| {
                    let [p, q] = self.ends(side);
                    (q - p).perp_dot(at - p) > 0.0
                })
            };
            let within = self.sides_on(sheet).map(|(face, _)| face).find(|&face| inside(face));
            let (number, under) = match text.text {
                Label::Face(number) => {
                    within.into_iter().for_each(|face| self.faces[face].names.push(number));
                    continue;
                }
                Label::Edge(edge) => (edge, None),
                Label::Tab { edge, under } => (edge, Some(under)),
                Label::Beyond { .. } | Label::Words(_) => continue,
            };
            let sides = self.sides_on(sheet).filter(|side| match within {
                Some(face) => side.0 == face,
                None => !self.folds.contains_key(side),
            });
            let distance = |side: &(usize, usize)| distance(at, self.ends(*side));
            let nearest = sides.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some((face, side)) = nearest {
                self.faces[face].numbers[side].push(number);
                self.faces[face].under.extend(under.map(|under| (side, under)));
            }
        }
    }

    /// The pieces of a sheet: faces that hang together by folds, the largest piece first.
    fn pieces(&self, sheet: usize) -> Vec<Vec<usize>> {
        let mut left: BTreeSet<usize> =
            (0..self.faces.len()).filter(|&face| self.faces[face].sheet == sheet).collect();
        let mut pieces = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut piece = vec![first];
            let mut next = 0;
            while let Some(&face) = piece.get(next) {
                let beside = self.sides_of(face).filter_map(|side| self.folds.get(&side));
                piece.extend(beside.filter(|(face, _)| left.remove(face)).map(|(face, _)| *face));
                next += 1;
            }
            piece.sort_unstable();
            pieces.push(piece);
        }
        pieces.sort_by_key(|piece| std::cmp::Reverse(piece.len()));
        pieces
    }

    /// Whether faces lack the fold by which they belong to another piece: whether a side of theirs is neither folded nor
    /// numbered.
    fn is_broken_off(&self, members: &[usize]) -> bool {
        let mut sides = members.iter().flat_map(|&face| self.sides_of(face));
        sides.any(|(face, side)| {
            !self.folds.contains_key(&(face, side)) && self.faces[face].numbers[side].is_empty()
        })
    }

    /// Folds the faces of a piece, `members`, about several roots and returns the result with the
    /// fewest findings: if a misprinted face is the root, all others are off.
    fn best_fold(&self, members: &[usize]) -> Folded {
        let mut best: Option<Folded> = None;
        for &root in members.iter().take(MOST_ROOTS) {
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

    /// Lays `root` in its stated place, and folds the others one after the other, breadth first.
    fn fold(&self, members: &[usize], root: usize) -> Folded {
        let face = &self.faces[root];
        let pose = &self.poses[root];
        // space_from_panel · panel_from_page, with the inverse turn as a rotation about z.
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
                let Some(&(child, own)) = self.folds.get(&side) else { continue };
                if !places.contains_key(&child)
                    && let Some(place) = self.across(&places[&parent], side, (child, own))
                {
                    places.insert(child, place);
                    queue.push_back(child);
                }
            }
        }
        self.judge(members, places)
    }

    /// The place of a face `child` whose side `own` is folded against a side of a face that lies in the
    /// place `parent`; `None` where the solid has no face across that edge. The fold is turned by the
    /// angle between the stated normals of the two places about their edge.
    fn across(
        &self,
        parent: &Place,
        (face, side): (usize, usize),
        (child, own): (usize, usize),
    ) -> Option<Place> {
        let [a, b] = [0, 1].map(|end| parent.vertices[(side + end) % parent.vertices.len()]);
        let &(slot, slot_side) = self.along.get(&[b, a])?;
        // The child's side runs from b to a, as that of the slot does, if that has as many corners.
        let (there, count) = (&self.faces[slot].vertices, self.faces[child].vertices.len());
        if there.len() != count {
            return None;
        }
        let at = |corner: usize| there[(slot_side + corner + count - own) % count];
        let vertices = (0..count).map(at).collect();
        let axis = (self.vertices_mm[&b] - self.vertices_mm[&a]).normalize_or(DVec3::X);
        let [from, to] = [parent.slot, slot].map(|slot| self.poses[slot].linear.z_axis);
        let angle_rad = axis.dot(from.cross(to)).atan2(from.dot(to));
        let ([p, q], [q_own, p_own]) = (self.ends((face, side)), self.ends((child, own)));
        let edge = [(p + p_own) / 2.0, (q + q_own) / 2.0];
        let space_from_page = parent.space_from_page.folded(edge, angle_rad);
        Some(Place { slot, vertices, space_from_page })
    }

    /// Compares the places of the faces with their own, and folded corners with stated ones.
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
                let turns = (0..count).find(is_turned_by).unwrap_or_default();
                let angle_deg = 360.0 / count as f64 * turns as f64;
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

    /// All edges of the solid, each once.
    fn edges(&self) -> Vec<Edge> {
        let forward = self.along.iter().filter(|([a, b], _)| a < b);
        let both = forward.filter_map(|([a, b], &one)| Some([one, *self.along.get(&[*b, *a])?]));
        both.map(|sides| Edge { sides }).collect()
    }

    /// Distance of the two sides of an edge after folding, mm, if they belong together: folded
    /// against each other on the page, or cut, with the same single number, and with one tab.
    ///
    /// # Errors
    ///
    /// The finding, where they do not belong together or lie apart.
    fn check_edge(
        &self,
        edge: &Edge,
        carried: &[Option<SpaceFromPage>],
    ) -> Result<f64, FoldFinding> {
        let [one, other] = edge.sides;
        let panels = [self.faces[one.0].panel, self.faces[other.0].panel];
        let ends = |side: (usize, usize)| {
            let place = carried[side.0]?;
            Some(self.ends(side).map(|end| place.apply(end)))
        };
        let (Some([a, b]), Some([d, c])) = (ends(one), ends(other)) else {
            return Err(FoldFinding::EdgeOpen { panels, gap_mm: f64::INFINITY });
        };
        let gap_mm = a.distance(c).max(b.distance(d));
        if gap_mm > FOLD_TOLERANCE_MM {
            return Err(FoldFinding::EdgeOpen { panels, gap_mm });
        }
        let numbers = edge.sides.map(|(face, side)| self.faces[face].numbers[side].as_slice());
        let folded = self.folds.get(&one) == Some(&other);
        let tabs = edge.sides.iter().filter(|side| self.tabs.contains(side)).count();
        match numbers {
            [[], []] if folded => Ok(gap_mm),
            [[a], [b]] if !folded && a == b && tabs == 1 => Ok(gap_mm),
            [[a], [b]] if !folded && a == b => Err(FoldFinding::EdgeTabs { panels, tabs }),
            _ => Err(FoldFinding::EdgeNumbers { panels, numbers: numbers.map(<[usize]>::to_vec) }),
        }
    }

    /// Findings about the number printed in a face and the faces that its tabs name.
    fn check_words(&self, index: usize) -> Vec<FoldFinding> {
        let face = &self.faces[index];
        let mut findings = Vec::new();
        if face.names != [index] {
            let names = face.names.clone();
            findings.push(FoldFinding::FaceNumber { panel: face.panel, names, stated: index });
        }
        for &(side, named) in &face.under {
            let [a, b] = [0, 1].map(|end| face.vertices[(side + end) % face.vertices.len()]);
            let beyond = self.along.get(&[b, a]).map(|&(other, _)| other);
            if let Some(stated) = beyond.filter(|&other| other != named) {
                findings.push(FoldFinding::TabNames { panel: face.panel, named, stated });
            }
        }
        findings
    }

    /// Findings about edge numbers that stand on more than two sides.
    fn numbers_used_twice(&self) -> Vec<FoldFinding> {
        let mut count = BTreeMap::<usize, usize>::new();
        let numbers = self.faces.iter().flat_map(|face| face.numbers.iter().flatten());
        numbers.for_each(|&number| *count.entry(number).or_default() += 1);
        let twice = count.into_iter().filter(|&(_, count)| count > 2);
        twice.map(|(number, sides)| FoldFinding::EdgeNumberAgain { number, sides }).collect()
    }
}

/// Distance of a point from a segment of positive length, mm.
fn distance(at: DVec2, [p, q]: [DVec2; 2]) -> f64 {
    let along = ((at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
    at.distance(p + (q - p) * along)
}
