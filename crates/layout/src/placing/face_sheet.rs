//! Sheets of single faces to be glued on a rigid skeleton: the panel with marks for cutting it out and positioning it.
//! If the specification has a skeleton, the panel is as large as its seat.
//!
//! ```text
//!            +
//!          \   /           Cutting marks extend the edges of the panel beyond its vertices, so that
//!     7     ╲ ╱            no mark lies on the panel itself. Outside each edge, its number and the face
//!           ╱ ╲            beyond it are printed. Edges with the same number meet. The number of the face
//!        4 ╱   ╲ 9         is printed beside it and, in small type, in its lower-left corner.
//!         ╱7    ╲
//!    ── ─╱───────╲─ ──     Registration crosses lie on the bisectors beyond the vertices, all at the same
//!  +         3         +   distance, for aligning a plotter, a jig or a second print.
//! ```
//!
//! The margin of a face is white, and so is its bleed: nothing is printed within [`BLEED_MM`] beyond the cut. A cut
//! that deviates by less leaves neither a line nor a letter on the panel. A panel cut with its bleed can also be
//! trimmed after gluing.

use glam::DVec2;

use super::arrangement::{Arrangement, Footprint, fit};
use super::margin_marks::ADVANCE_CAPS;
use super::net::Sides;
use super::sheet_label::{imprint, tag_range};
use crate::paper::PaperSpec;
use crate::{Label, LineKind, Placement, SheetLayout, SheetLine, SheetText};
use deltille_core::angles::turn_of;
use deltille_core::setting::Setting::{PaperSize, SolidEdgeMm};
use deltille_core::targets::format_mm;
use deltille_core::targets::sides;
use deltille_core::targets::{
    Face, FamilyRef, Fingerprint, Panel, Polyhedron, SolidSpec, TargetError, fingerprint,
};

/// White space beyond the edges of a face, mm: the error of cutting and gluing by hand, plus a reserve.
pub(crate) const BLEED_MM: f64 = 3.0;
/// Distances from a vertex at which a cutting mark begins and ends, mm.
const MARK_MM: [f64; 2] = [BLEED_MM, 9.0];
/// Distance of a registration cross from its vertex, and length of its arms, mm: clear of the cutting marks of a face
/// with angles of 60°.
const CROSS_MM: [f64; 2] = [13.0, 2.5];
/// Width of a cutting mark, mm: a hairline that every printer can print.
const MARK_WIDTH_MM: f64 = 0.15;
/// Capital height of the number beside a face, mm.
const FACE_CAP_MM: f64 = 5.0;
/// Capital height of edge numbers, mm.
const EDGE_CAP_MM: f64 = 2.2;
/// Capital height and line spacing of the instructions, mm.
const WORDS_MM: [f64; 2] = [2.0, 3.4];
/// Instructions below the number of the face.
const WORDS: [&str; 3] = ["Cut from mark to mark.", "Edges with equal", "numbers meet."];
/// Height of the number of a face and the instructions below it, mm.
const WORDS_HEIGHT_MM: f64 = FACE_CAP_MM + WORDS_MM[0] / 2.0 + WORDS.len() as f64 * WORDS_MM[1];
/// Gap between the marks of a face and the marks along the page margins, mm.
const MARK_BLANK_MM: f64 = 1.5;
/// Capital height of the number on a face as a fraction of the margin width, and its maximum, mm.
const INNER_CAP: (f64, f64) = (0.35, 2.0);
/// Position of the number on a triangle, along the bisector of its lower-left corner, in margin widths.
/// On other faces, the number is halfway to the inner corner of the margin.
const INNER_PLACE: f64 = 0.9;

/// Lays out the faces of a solid, one sheet each.
pub(crate) fn sheets(
    name: &str,
    spec: &SolidSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let solid = spec.polyhedron();
    let (edges, sides) = (solid.edges(), Sides::new(&solid));
    let margin_mm = spec.white_margin_mm() - spec.panel_inset_mm()?;
    let target = fingerprint(panels, family);
    let numbered = spec.panel_faces()?.into_iter().zip(panels).enumerate();
    numbered
        .map(|(index, (face, panel))| {
            let ink = bounds(&face);
            let arrangement = arrange(spec, ink, paper)?;
            let words = label(name, spec, index, panel, family, target);
            let mut sheet = arrangement.sheet(panel.id, ink, words);
            let numbers = edge_numbers(&solid, &edges, index);
            let edge_words = sides.of(index).zip(numbers).map(|(side, edge)| {
                let beyond = sides.partner(side).map(|other| other.face);
                beyond.map_or(Label::Edge(edge), |face| Label::Beyond { edge, face })
            });
            mark(&mut sheet, spec, &face, index, edge_words);
            sheet.texts.extend(inner_number(&sheet.placements[0], margin_mm, &face, index));
            Ok(sheet)
        })
        .collect()
}

/// Returns the edge numbers of a face, in the order of its outline.
pub fn edge_numbers(solid: &Polyhedron, edges: &[[usize; 2]], face: usize) -> Vec<usize> {
    let number = |(from, to): (usize, usize)| {
        edges.iter().position(|&edge| edge == [from.min(to), from.max(to)]).unwrap_or_default()
    };
    sides(&solid.faces[face]).map(number).collect()
}

/// Returns the bounding box of a face with its marks, in the panel frame, mm.
fn bounds(face: &Face) -> [f64; 4] {
    let reach = CROSS_MM[0] + CROSS_MM[1];
    let least = face.outline_mm.iter().copied().reduce(DVec2::min).unwrap_or_default() - reach;
    let most = face.outline_mm.iter().copied().reduce(DVec2::max).unwrap_or_default() + reach;
    // Beside the apex of a triangle there is room for the instructions.
    let words = if face.outline_mm.len() > 3 { WORDS_HEIGHT_MM } else { 0.0 };
    [least.x, least.y, most.x, most.y + words]
}

fn arrange(
    spec: &SolidSpec,
    [left, lower, right, upper]: [f64; 4],
    paper: &PaperSpec,
) -> Result<Arrangement, TargetError> {
    // The marks keep their size when the face shrinks.
    let marks = 2.0 * MARK_MM[1];
    let footprint = |shrink: f64| Footprint {
        width: (right - left) - (right - left - marks) * shrink,
        height: (upper - lower) - (upper - lower - marks) * shrink,
        edge_blank: paper.margin_mm,
        mark_blank: MARK_BLANK_MM,
        is_centred: false,
    };
    if let Some(arrangement) = fit(&footprint(0.0), paper)? {
        return Ok(arrangement);
    }
    let least = SolidSpec::MIN_EDGE_MM as u32;
    let mut fitting = None;
    for mm in (least..spec.edge_mm.ceil() as u32).rev() {
        if fit(&footprint(1.0 - f64::from(mm) / spec.edge_mm), paper)?.is_some() {
            fitting = Some(mm);
            break;
        }
    }
    let paper = paper.size.as_ref().map_or("even A0".to_owned(), ToString::to_string);
    let instead = fitting.map_or("larger paper".to_owned(), |mm| {
        format!("larger paper, or {SolidEdgeMm} of at most {mm} mm")
    });
    let edge = format_mm(spec.edge_mm);
    let problem =
        format!("a face with {edge} edges and its marks do not fit {paper}: use {instead}");
    Err(TargetError::invalid(PaperSize, problem))
}

/// Adds cutting marks, numbers and instructions.
fn mark(
    sheet: &mut SheetLayout,
    spec: &SolidSpec,
    face: &Face,
    index: usize,
    edges: impl Iterator<Item = Label>,
) {
    let placement = sheet.placements[0];
    let count = face.outline_mm.len();
    for (i, text) in edges.enumerate() {
        let (a, b) = (face.outline_mm[i], face.outline_mm[(i + 1) % count]);
        for (end, outwards) in [(a, -1.0), (b, 1.0)] {
            let [from_mm, to_mm] =
                MARK_MM.map(|mm| placement.page_from_panel(end + unit(b - a) * (outwards * mm)));
            let kind = LineKind::Cut;
            sheet.lines.push(SheetLine { kind, from_mm, to_mm, width_mm: MARK_WIDTH_MM });
        }
        sheet.texts.push(edge_text(&placement, [a, b], text, -(BLEED_MM + EDGE_CAP_MM)));
    }
    for vertex in 0..count {
        let [a, b, c] = [0, 1, count - 1].map(|i| face.outline_mm[(vertex + i) % count]);
        let middle = a - CROSS_MM[0] * unit(unit(b - a) + unit(c - a));
        for arm in [DVec2::X, DVec2::Y].map(|axis| CROSS_MM[1] * axis) {
            let ends = [middle - arm, middle + arm];
            let [from_mm, to_mm] = ends.map(|end| placement.page_from_panel(end));
            let kind = LineKind::Align;
            sheet.lines.push(SheetLine { kind, from_mm, to_mm, width_mm: MARK_WIDTH_MM });
        }
    }
    let [left, _, _, upper] = bounds(face);
    let max_width_mm = spec.edge_mm / 4.0;
    let mut add = |text: Label, y: f64, cap_height_mm: f64| {
        let at_mm = placement.page_from_panel(DVec2::new(left, y));
        let angle_rad = placement.angle_rad;
        sheet.texts.push(SheetText { text, at_mm, angle_rad, cap_height_mm, max_width_mm });
    };
    let mut y = upper - FACE_CAP_MM;
    add(Label::Face(index), y, FACE_CAP_MM);
    y -= WORDS_MM[0] / 2.0;
    for words in WORDS {
        y -= WORDS_MM[1];
        add(Label::Words(words.to_owned()), y, WORDS_MM[0]);
    }
}

/// Lays out the number of a face in its lower-left corner; `None` if the margin is too narrow.
fn inner_number(
    placement: &Placement,
    margin_mm: f64,
    face: &Face,
    index: usize,
) -> Option<SheetText> {
    let cap = (INNER_CAP.0 * margin_mm).min(INNER_CAP.1);
    if cap < 0.8 {
        return None;
    }
    let text = upright_number(index);
    let [a, b, .., c] = face.outline_mm[..] else { return None };
    let inwards = unit(b - a) + unit(c - a);
    let width = text.len() as f64 * ADVANCE_CAPS * cap;
    // The sum of two unit vectors that enclose α has length 2 cos α/2.
    let length = inwards.x.hypot(inwards.y);
    let place = match face.outline_mm.len() {
        3 => INNER_PLACE,
        _ => 0.5 / (1.0 - length * length / 4.0).sqrt(),
    };
    let reach = place * margin_mm / length;
    let at = a + inwards * reach - DVec2::new(width, cap) / 2.0;
    Some(SheetText {
        text: Label::Words(text),
        at_mm: placement.page_from_panel(at),
        angle_rad: placement.angle_rad,
        cap_height_mm: cap,
        max_width_mm: 2.0 * width,
    })
}

/// Returns a number for standalone use, with a trailing point if it reads as another number upside down.
pub fn upright_number(number: usize) -> String {
    let text = number.to_string();
    let rotations = text.chars().all(|c| "01689".contains(c)) && text.contains(['6', '9']);
    if rotations { text + "." } else { text }
}

/// Lays out a line of text along the middle of an edge, with its baseline `inwards` from the edge.
pub fn edge_text(
    placement: &Placement,
    [a, b]: [DVec2; 2],
    text: Label,
    inwards: f64,
) -> SheetText {
    let side = b - a;
    let (length, along) = (side.x.hypot(side.y), unit(side));
    let width = (text.characters() as f64 * ADVANCE_CAPS * EDGE_CAP_MM).min(length);
    let at = a + along * ((length - width) / 2.0) + along.perp() * inwards;
    SheetText {
        text,
        at_mm: placement.page_from_panel(at),
        angle_rad: placement.angle_rad + turn_of(side),
        cap_height_mm: EDGE_CAP_MM,
        max_width_mm: length,
    }
}

/// Returns the direction of a vector. The last digits of the marks in files depend on how the length is rounded here.
fn unit(v: DVec2) -> DVec2 {
    v / v.x.hypot(v.y)
}

/// Returns the label of a face, with everything needed to reproduce it.
fn label(
    name: &str,
    spec: &SolidSpec,
    index: usize,
    panel: &Panel,
    family: Option<&FamilyRef>,
    target: Fingerprint,
) -> String {
    let mut parts = vec![
        name.to_owned(),
        spec.size(),
        format!("face {index}"),
        format!("{} tiles, margin {}", spec.tiles, format_mm(spec.margin_mm)),
    ];
    if let (Some(family), [first, .., last] | [first @ last]) = (family, panel.tags.as_slice()) {
        let family = family.of_tiling(panel.kind);
        parts.push(tag_range(&family.name, first.id, last.id));
    }
    parts.push(format!("board {}", panel.id));
    parts.push(imprint(target));
    parts.join(" · ")
}
