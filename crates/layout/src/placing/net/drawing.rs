//! Drawing of a net: panels, cutting and folding lines, edge numbers, and instructions.

use std::f64::consts::PI;

use glam::DVec2;

use super::plane::Motion;
use super::tabs::Tab;
use super::unfold::{Piece, Side, Sides};
use crate::placing::face_sheet::edge_numbers;
use crate::placing::margin_marks::ADVANCE_CAPS;
use crate::placing::sheet_label::{imprint, tag_range};
use crate::{Label, LineKind, Placement, SheetLayout, SheetLine, SheetText};
use deltille_core::angles::turn_of;
use deltille_core::lattice::GridKind;
use deltille_core::targets::format_mm;
use deltille_core::targets::{Face, FamilyRef, Panel, Polyhedron, SolidSpec, fingerprint};

/// Faces whose planes differ by less than this angle are not folded, radians (0.1°): nobody can fold so slightly by
/// hand, and the neighbouring faces fix the paper in position.
const FLAT_RAD: f64 = 0.1 / 180.0 * PI;

/// Width of cutting and folding lines, mm: a hairline that every printer can print.
const LINE_WIDTH_MM: f64 = 0.15;

/// Capital height of the numbers in the margin of a face as a fraction of the margin width, and its maximum, mm.
const NUMBER_CAP: (f64, f64) = (0.35, 2.0);

/// Capital height of the text on a tab as a fraction of the tab depth, and its maximum, mm.
const TAB_CAP: (f64, f64) = (0.35, 2.2);

/// Gap on either side of the text on a tab, mm.
const TAB_INDENT_MM: f64 = 1.0;

/// Capital height below which the text on a tab is shortened, mm.
const LEGIBLE_CAP_MM: f64 = 1.2;

/// Capital height and line spacing of the instructions, mm.
const WORDS_CAP_MM: f64 = 2.2;
const WORDS_STEP_MM: f64 = 3.6;

/// Capital height of the page number, mm.
const PAGE_CAP_MM: f64 = 5.0;

/// Gap between the net, the instructions and the marks along the margins, mm.
pub(super) const BLANK_MM: f64 = 2.5;

/// Height of the instructions with the gap above them, mm.
pub(super) const WORDS_MM: f64 = 2.0 * WORDS_STEP_MM + BLANK_MM;

/// Data needed to draw any piece of a solid's net.
pub(super) struct Drawing<'a> {
    name: &'a str,
    spec: &'a SolidSpec,
    pub(super) faces: &'a [Face],
    pub(super) panels: &'a [Panel],
    family: Option<&'a FamilyRef>,
    pub(super) sides: &'a Sides,
    /// Edge numbers of each face.
    numbers: Vec<Vec<usize>>,
    /// Fold of each side of each face.
    folds: Vec<Vec<LineKind>>,
}

impl<'a> Drawing<'a> {
    pub(super) fn new(
        name: &'a str,
        spec: &'a SolidSpec,
        solid: &Polyhedron,
        faces: &'a [Face],
        panels: &'a [Panel],
        family: Option<&'a FamilyRef>,
        sides: &'a Sides,
    ) -> Self {
        let edges = solid.edges();
        let numbers: Vec<Vec<usize>> =
            (0..faces.len()).map(|face| edge_numbers(solid, &edges, face)).collect();
        let angles_rad = solid.dihedral_angles_rad();
        let fold = |edge: usize| match angles_rad[edge] - PI {
            angle if angle.abs() < FLAT_RAD => LineKind::Flat,
            // The next face rises out of the plane of this one.
            angle if angle > 0.0 => LineKind::Valley,
            _ => LineKind::Fold,
        };
        let folds =
            numbers.iter().map(|edges| edges.iter().map(|&edge| fold(edge)).collect()).collect();
        Self { name, spec, faces, panels, family, sides, numbers, folds }
    }

    /// Adds the instructions from `at` to the right end, preceded by the page number if the net has several pages.
    pub(super) fn explain(
        &self,
        sheet: &mut SheetLayout,
        at: DVec2,
        right: f64,
        page: Option<[usize; 2]>,
    ) {
        let mut start = at;
        if let Some([number, count]) = page {
            let text = Label::Words(format!("{} of {count}", number + 1));
            let max_width_mm = width(&text, PAGE_CAP_MM);
            start.x += max_width_mm + BLANK_MM;
            sheet.texts.push(SheetText {
                text,
                at_mm: at + DVec2::Y * (WORDS_MM - BLANK_MM - PAGE_CAP_MM) / 2.0,
                angle_rad: 0.0,
                cap_height_mm: PAGE_CAP_MM,
                max_width_mm,
            });
        }
        let words = instructions(&sheet.lines, start, right - start.x);
        sheet.texts.extend(words);
    }

    /// Adds the panels, lines and numbers of a piece to a sheet.
    pub(super) fn draw(
        &self,
        sheet: &mut SheetLayout,
        piece: &Piece,
        tabs: &[Tab],
        sheet_from_net: &Motion,
    ) {
        let hinges: Vec<(Side, Side)> = piece.iter().filter_map(|face| face.hinge).collect();
        for flat in piece {
            let (face, index) = (&self.faces[flat.face], flat.face);
            let corners: Vec<DVec2> =
                flat.corners.iter().map(|&corner| sheet_from_net.apply(corner)).collect();
            let lower = [face.outline_mm[0], face.outline_mm[1]];
            let motion = Motion::carrying(lower, [corners[0], corners[1]]);
            let placement = Placement {
                panel: self.panels[index].id,
                angle_rad: turn_of(motion.turn),
                origin_mm: motion.shift,
            };
            sheet.placements.push(placement);
            let mut named = false;
            for at in self.sides.of(index) {
                let side = at.side;
                let ends = [corners[side], corners[(side + 1) % corners.len()]];
                let hinge = hinges.iter().find(|(on, own)| *on == at || *own == at);
                let tab = tabs.iter().find(|tab| tab.side == at);
                let number = self.numbers[index][side];
                match (hinge, tab) {
                    // A fold is drawn once, with the face that is attached to the other.
                    (Some((_, own)), _) => {
                        if *own == at {
                            sheet.lines.push(line(self.folds[index][side], ends));
                        }
                    }
                    (None, Some(tab)) => {
                        sheet.lines.extend(self.tab_lines(tab, ends, sheet_from_net));
                        sheet.texts.extend(self.tab_words(tab, number, sheet_from_net));
                    }
                    (None, None) => {
                        sheet.lines.push(line(LineKind::Cut, ends));
                        sheet.texts.push(self.margin_words(ends, Label::Edge(number), 0.5));
                    }
                }
                // The name of the face is printed along a side that has no edge number.
                if !named && (hinge.is_some() || tab.is_some()) {
                    named = true;
                    sheet.texts.push(self.margin_words(ends, Label::Face(index), 0.5));
                }
            }
            if !named {
                let ends = [corners[0], corners[1]];
                sheet.texts.push(self.margin_words(ends, Label::Face(index), 0.25));
            }
        }
    }

    fn tab_lines(&self, tab: &Tab, [from, to]: [DVec2; 2], motion: &Motion) -> Vec<SheetLine> {
        let [b, a, far_a, far_b] = tab.corners.map(|corner| motion.apply(corner));
        let fold = self.folds[tab.side.face][tab.side.side];
        let mut lines = vec![line(fold, [a, b])];
        lines.extend([[a, far_a], [far_a, far_b], [far_b, b]].map(|e| line(LineKind::Cut, e)));
        let free = [[from, a], [b, to]].into_iter().filter(|[p, q]| p.distance(*q) > LINE_WIDTH_MM);
        lines.extend(free.map(|ends| line(LineKind::Cut, ends)));
        lines
    }

    /// Lays out the text on a tab: its edge and, if it fits, the face under which it is glued.
    fn tab_words(&self, tab: &Tab, number: usize, motion: &Motion) -> Option<SheetText> {
        let [_, _, far_a, far_b] = tab.corners.map(|corner| motion.apply(corner));
        let under = self.sides.partner(tab.side)?.face;
        let room = far_a.distance(far_b) - 2.0 * TAB_INDENT_MM;
        let cap = (TAB_CAP.0 * tab.depth_mm).min(TAB_CAP.1);
        let long = Label::Tab { edge: number, under };
        let text =
            if width(&long, LEGIBLE_CAP_MM.min(cap)) <= room { long } else { Label::Edge(number) };
        let cap = cap.min(cap * room / width(&text, cap));
        Some(words([far_a, far_b], text, cap, 0.5, (tab.depth_mm - cap) / 2.0, room))
    }

    /// Lays out a line of text in the margin of a face along one of its sides, centred at the
    /// fraction `part` of its length.
    fn margin_words(&self, ends: [DVec2; 2], text: Label, part: f64) -> SheetText {
        let margin = self.spec.white_margin_mm();
        let cap = (NUMBER_CAP.0 * margin).min(NUMBER_CAP.1);
        let room = (ends[0].distance(ends[1]) - 4.0 * margin).max(cap);
        let cap = cap.min(cap * room / width(&text, cap));
        // In a wide margin, the text stays close to its edge.
        let inwards = ((margin - cap) / 2.0).min(2.0 * cap);
        words(ends, text, cap, part, inwards, room)
    }

    /// Returns the label, with everything needed to reproduce the net.
    pub(super) fn label(&self, of: &str) -> String {
        let (spec, name) = (self.spec, self.name);
        let mut parts = vec![name.to_owned(), spec.size()];
        parts.push(of.to_owned());
        parts.push(format!("{} tiles, margin {}", spec.tiles, format_mm(spec.margin_mm)));
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let own = || self.panels.iter().filter(|panel| panel.kind == kind);
            let tags = || own().flat_map(|panel| &panel.tags);
            if let (Some(family), Some(first), Some(last)) =
                (self.family, tags().next(), tags().last())
            {
                let family = family.of_tiling(kind);
                parts.push(tag_range(&family.name, first.id, last.id));
            }
        }
        let last = self.panels.last().map_or(0, |panel| panel.id);
        parts.push(format!("boards {}–{last}", spec.board_id));
        parts.push(imprint(fingerprint(self.panels, self.family)));
        parts.join(" · ")
    }
}

/// Lays out instructions for making the solid from a print of these lines, in two lines of text;
/// the lower one starts at `at`.
pub(super) fn instructions(lines: &[SheetLine], at: DVec2, room: f64) -> [SheetText; 2] {
    let has = |kind| lines.iter().any(|line| line.kind == kind);
    let mut folds = if has(LineKind::Valley) {
        "Cut along solid lines. Score and fold dashed lines away from the print, dash-dotted ones \
         towards it."
    } else {
        "Cut along solid lines. Score dashed lines and fold them away from the print."
    }
    .to_owned();
    if has(LineKind::Flat) {
        folds += " Do not fold dotted lines.";
    }
    let glue = "Glue each tab under the face that it names, where the face has the same number: \
                edge 1 to edge 1, and so on."
        .to_owned();
    let mut y = at.y + 2.0 * WORDS_STEP_MM;
    [folds, glue].map(|text| {
        y -= WORDS_STEP_MM;
        SheetText {
            text: Label::Words(text),
            at_mm: DVec2::new(at.x, y),
            angle_rad: 0.0,
            cap_height_mm: WORDS_CAP_MM,
            max_width_mm: room,
        }
    })
}

fn line(kind: LineKind, [from_mm, to_mm]: [DVec2; 2]) -> SheetLine {
    SheetLine { kind, from_mm, to_mm, width_mm: LINE_WIDTH_MM }
}

/// Estimates the width of a line of text, mm.
pub(super) fn width(text: &Label, cap: f64) -> f64 {
    text.characters() as f64 * ADVANCE_CAPS * cap
}

/// Lays out text along the line between two points, centred at the fraction `part` of its length,
/// with the baseline
/// `inwards` (to the left) of it.
fn words(
    [from, to]: [DVec2; 2],
    text: Label,
    cap: f64,
    part: f64,
    inwards: f64,
    room: f64,
) -> SheetText {
    let along = (to - from).normalize_or_zero();
    let start = from + (to - from) * part - along * width(&text, cap) / 2.0;
    SheetText {
        text,
        at_mm: start + along.perp() * inwards,
        angle_rad: turn_of(along),
        cap_height_mm: cap,
        max_width_mm: room,
    }
}
