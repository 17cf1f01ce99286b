//! The detected net: its faces, the folds between them, and the numbers on their sides.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};
use kurbo::Shape as _;

use crate::net::motion::{Rigid, SpaceFromPage};
use crate::sheet::boards::Seen;
use deltille_core::targets::TargetSpec;
use deltille_layout::artwork;
use deltille_layout::{Label, Printing, SheetLayout};

/// Largest distance at which two sides on the paper form one fold, mm: more than the error of any acceptable print,
/// less than the width of any tab.
const COMMON_MM: f64 = 0.2;

/// Whether the sheets of a target are a net, that is, whether folds connect faces of a solid.
pub(crate) fn is_net(printing: &Printing) -> bool {
    let folds = |sheet: &SheetLayout| sheet.lines.iter().any(|line| line.kind.joins_faces());
    matches!(printing.target.spec, TargetSpec::Solid(_)) && printing.sheets.iter().any(folds)
}

/// A detected face of the net. Side i runs from vertex i to vertex i + 1.
pub(super) struct PrintedFace {
    /// Panel id.
    pub panel: u32,
    /// Index of its sheet.
    pub sheet: usize,
    /// Its outline on the page, counter-clockwise, mm: the stated outline at the detected pose.
    outline_mm: Vec<DVec2>,
    /// Its pose on the page, fitted to the detected corners.
    pub page_from_panel: Rigid,
    /// Indices of the vertices of the solid at the corners of its outline.
    pub vertices: Vec<usize>,
    /// The detected corners: position on the page, and stated position in the target frame, mm.
    pub corners: Vec<(DVec2, DVec3)>,
    /// Edge numbers printed along each of its sides.
    pub numbers: Vec<Vec<usize>>,
    /// Tabs on its sides: the side, and the number of the face to which the tab says it must be glued.
    pub under: Vec<(usize, usize)>,
    /// Face numbers printed on it.
    pub names: Vec<usize>,
}

/// A side of a face of the net.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Side {
    /// Index of the face.
    pub face: usize,
    /// Number of the side.
    pub side: usize,
}

/// The detected net, and the solid into which it should fold.
pub(super) struct Net {
    /// All faces, in the order of the target's panels.
    pub faces: Vec<PrintedFace>,
    /// Stated positions of the vertices of the solid in the target frame, mm.
    pub vertices_mm: BTreeMap<usize, DVec3>,
    /// Stated pose of each panel in the target frame.
    pub poses: Vec<SpaceFromPage>,
    /// The side that runs from one vertex of the solid to another.
    pub along: BTreeMap<[usize; 2], Side>,
    /// For each folded side, the side of the other face.
    pub folds: BTreeMap<Side, Side>,
    /// Sides along which a tab is folded.
    pub tabs: BTreeSet<Side>,
}

impl Net {
    /// Creates the net of a target from the corners detected on each sheet; `None` if a face is missing.
    pub(super) fn new(printing: &Printing, seen: &[Seen]) -> Option<Self> {
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
                net.along.insert(ends, Side { face: index, side });
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

    /// Returns the ends of a side on the page, mm.
    pub(super) fn ends(&self, Side { face, side }: Side) -> [DVec2; 2] {
        let outline = &self.faces[face].outline_mm;
        [outline[side], outline[(side + 1) % outline.len()]]
    }

    /// Returns the sides of a face.
    pub(super) fn sides_of(&self, face: usize) -> impl Iterator<Item = Side> + use<> {
        (0..self.faces[face].vertices.len()).map(move |side| Side { face, side })
    }

    /// Returns the sides of all faces on a sheet.
    fn sides_on(&self, sheet: usize) -> impl Iterator<Item = Side> {
        let faces = (0..self.faces.len()).filter(move |&face| self.faces[face].sheet == sheet);
        faces.flat_map(|face| self.sides_of(face))
    }

    /// Records which sides of two faces lie on one fold line of the layout, and which side of a single face does, so
    /// that a tab is attached to it.
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

    /// Assigns each printed number to the face that contains it, or to a side: within a face the nearest side of that
    /// face, outside all faces, as on a tab, the nearest side without a fold.
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
            let within = self.sides_on(sheet).map(|side| side.face).find(|&face| inside(face));
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
                Some(face) => side.face == face,
                None => !self.folds.contains_key(side),
            });
            let distance = |side: &Side| distance(at, self.ends(*side));
            let nearest = sides.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            if let Some(Side { face, side }) = nearest {
                self.faces[face].numbers[side].push(number);
                self.faces[face].under.extend(under.map(|under| (side, under)));
            }
        }
    }
}

/// Returns the distance of a point from a segment of positive length, mm.
fn distance(at: DVec2, [p, q]: [DVec2; 2]) -> f64 {
    let along = ((at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
    at.distance(p + (q - p) * along)
}
