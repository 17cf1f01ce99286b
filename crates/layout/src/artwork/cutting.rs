//! Drawings for a cutter: outlines and lines in layers by operation (cut, fold, engrave).

use std::f64::consts::TAU;

use glam::DVec2;

use super::atlas::Packing;
use super::text::MissingGlyph;
use crate::{
    Label, LineKind, Placement, Printing, SheetLayout, edge_numbers, edge_text, upright_number,
};
use deltille_core::targets::{Target, TargetError, TargetSpec, format_mm};

/// Gap between panels, mm: wider than any kerf.
pub(super) const GAP_MM: f64 = 4.0;

/// Height of the number of a face as a fraction of the inradius, and its maximum, mm.
const FACE_CAP: (f64, f64) = (0.25, 8.0);

/// Advance width of a digit, in capital heights.
const ADVANCE_CAPS: f64 = 0.84;

/// Distance of an edge number from its edge, mm.
const EDGE_GAP_MM: f64 = 1.5;

/// Maximum deviation of the line segments that replace the curves of letters, mm.
const FLATTENING_MM: f64 = 0.02;

/// Outline ends closer than this are joined, mm: nets omit pieces between a face and its tab that are shorter than a
/// line width.
const JOIN_MM: f64 = 0.2;

/// Operation along a path; each is one layer of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum CutLayer {
    /// Cut through.
    Cut,
    /// Fold away from the print, after scoring.
    Fold,
    /// Fold towards the print, after scoring from the back.
    Valley,
    /// Engrave.
    Engrave,
}

/// A polyline.
#[derive(Clone, Debug, PartialEq)]
pub struct CutPath {
    /// Operation along the path.
    pub layer: CutLayer,
    /// Whether the last point is joined to the first.
    pub closed: bool,
    /// Points in the frame of the drawing, mm, x right, y up.
    pub points_mm: Vec<DVec2>,
}

/// A drawing for a cutter.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CutDrawing {
    /// Its paths.
    pub paths: Vec<CutPath>,
}

/// Reason why a target has no drawing for a cutter.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CuttingError {
    /// The target is not a solid.
    #[error("{0} is not a solid made by `deltille`, so it has no panels to cut")]
    NotSolid(String),
    /// The sheets of the solid are not those of its net, or it has no sheets.
    #[error("{0} is not laid out as a net, so there is no net to cut")]
    NotNet(String),
    /// The target has no plates.
    #[error("{0} is a sheet of tags: only boards and solids can be engraved by a laser")]
    NotBoard(String),
    /// The kerf is too wide, or not a valid width.
    #[error(
        "a kerf of {} is not between 0 mm and {:.3} mm, a quarter of the finest detail on the board; larger tiles allow a \
         wider one",
        format_mm(*kerf_mm),
        most_mm
    )]
    Kerf {
        /// Requested kerf, mm.
        kerf_mm: f64,
        /// Largest kerf that preserves every detail, mm.
        most_mm: f64,
    },
    /// The board cannot be drawn.
    #[error(transparent)]
    Draw(#[from] super::ArtworkError),
    /// The solid cannot be built.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The font lacks a character of a number.
    #[error(transparent)]
    Text(#[from] MissingGlyph),
}

/// Returns the panels of a solid side by side, seen from outside: outlines to cut in true size, and the numbers of each
/// face and its edges to engrave. Edges with the same number meet on the solid.
///
/// Panels are whole faces, or, if the specification has a skeleton, plates that fit its seats.
///
/// # Errors
/// Returns an error if the target is not a solid, or if its skeleton has no seats for the faces.
pub fn panels_to_cut(target: &Target) -> Result<CutDrawing, CuttingError> {
    let TargetSpec::Solid(spec) = &target.spec else {
        return Err(CuttingError::NotSolid(target.name.to_string()));
    };
    let panels = spec.panel_faces()?;
    let solid = spec.polyhedron();
    let edges = solid.edges();
    let mut drawing = CutDrawing::default();
    let packing = Packing::tightest(&panels, GAP_MM);
    for (index, (panel, placement)) in panels.iter().zip(packing.placements()).enumerate() {
        let outline = &panel.outline_mm;
        let points_mm = outline.iter().map(|&p| placement.page_from_panel(p)).collect();
        drawing.paths.push(CutPath { layer: CutLayer::Cut, closed: true, points_mm });
        let numbers = edge_numbers(&solid, &edges, index);
        let mut texts = vec![face_number(&placement, outline, index)];
        for (i, number) in numbers.into_iter().enumerate() {
            let ends = [outline[i], outline[(i + 1) % outline.len()]];
            texts.push(edge_text(
                &placement,
                ends,
                Label::Words(upright_number(number)),
                EDGE_GAP_MM,
            ));
        }
        for text in texts {
            drawing.engrave(super::text_outline(&text)?);
        }
    }
    Ok(drawing)
}

/// Returns the net of a solid to cut, score and fold, in true size and independent of the printed pages: the outline of
/// each piece with its tabs, the folding lines, and the numbers of faces and edges to engrave. Pieces lie side by side.
///
/// # Errors
/// Returns an error if the target was not laid out as a net of closed outlines.
pub fn net_to_cut(printing: &Printing) -> Result<CutDrawing, CuttingError> {
    let no_net = || CuttingError::NotNet(printing.target.name.to_string());
    let mut drawing = CutDrawing::default();
    let mut right_mm = 0.0;
    // The guide page does not contain a piece of the net.
    for sheet in printing.sheets.iter().filter(|sheet| !sheet.placements.is_empty()) {
        let mut piece = CutDrawing::default();
        for points_mm in outlines(sheet).ok_or_else(no_net)? {
            piece.paths.push(CutPath { layer: CutLayer::Cut, closed: true, points_mm });
        }
        for line in &sheet.lines {
            let layer = match line.kind {
                LineKind::Fold => CutLayer::Fold,
                LineKind::Valley => CutLayer::Valley,
                LineKind::Cut | LineKind::Flat | LineKind::Align => continue,
            };
            let points_mm = vec![line.from_mm, line.to_mm];
            piece.paths.push(CutPath { layer, closed: false, points_mm });
        }
        // Instructions and the label stay on the paper.
        for text in sheet.texts.iter().filter(|text| text.text.is_number()) {
            piece.engrave(super::text_outline(text)?);
        }
        let [left, lower, right, _] = piece.bounds_mm().ok_or_else(no_net)?;
        let points = piece.paths.iter_mut().flat_map(|path| &mut path.points_mm);
        points.for_each(|p| *p = *p - DVec2::new(left, lower) + DVec2::X * right_mm);
        right_mm += right - left + GAP_MM;
        drawing.paths.append(&mut piece.paths);
    }
    if drawing.paths.is_empty() { Err(no_net()) } else { Ok(drawing) }
}

/// Returns the closed outlines formed by the cutting lines of a sheet, mm; `None` if a line has no continuation.
///
/// Every line has the paper on its left. Where an outline touches itself, several lines begin. The outline continues
/// with the line that encloses the smallest angle of paper, which no other line can divide.
fn outlines(sheet: &SheetLayout) -> Option<Vec<Vec<DVec2>>> {
    let cuts = sheet.lines.iter().filter(|line| line.kind == LineKind::Cut);
    let mut left: Vec<[DVec2; 2]> = cuts.map(|line| [line.from_mm, line.to_mm]).collect();
    let mut outlines = Vec::new();
    while let Some(first) = left.pop() {
        let mut outline = vec![first[0]];
        let mut last = first;
        loop {
            let paper_rad = |[from, to]: [DVec2; 2]| {
                let back = (last[0] - last[1]).to_angle();
                let on = (to - from).to_angle();
                // Coincident lines enclose 360° of paper, not 0°.
                TAU - (on - back).rem_euclid(TAU)
            };
            let near = |a: DVec2, b: DVec2| a.distance(b) < JOIN_MM;
            let next = (0..left.len())
                .filter(|&n| near(left[n][0], last[1]))
                .min_by(|&a, &b| paper_rad(left[a]).total_cmp(&paper_rad(left[b])));
            // The outline may also be closed here.
            let closing = near(first[0], last[1]).then(|| paper_rad(first));
            let next = next.filter(|&n| closing.is_none_or(|angle| paper_rad(left[n]) < angle));
            match next {
                Some(next) => {
                    last = left.swap_remove(next);
                    outline.push(last[0]);
                }
                None if closing.is_some() => break,
                None => return None,
            }
        }
        outlines.push(outline);
    }
    Some(outlines)
}

/// Lays out the number of a face, centred on its incircle.
fn face_number(placement: &Placement, outline: &[DVec2], index: usize) -> crate::SheetText {
    let corners: Vec<_> = outline.iter().map(|corner| corner.extend(0.0)).collect();
    let circle = deltille_core::targets::Incircle::of(&corners);
    let text = upright_number(index);
    let cap = (FACE_CAP.0 * circle.radius).min(FACE_CAP.1);
    let width = text.len() as f64 * ADVANCE_CAPS * cap;
    let at = circle.centre.truncate() - DVec2::new(width, cap) / 2.0;
    crate::SheetText {
        text: Label::Words(text),
        at_mm: placement.page_from_panel(at),
        angle_rad: placement.angle_rad,
        cap_height_mm: cap,
        max_width_mm: circle.radius,
    }
}

impl CutDrawing {
    /// Returns the bounding box, mm: left, lower, right and upper end; `None` for an empty drawing.
    pub fn bounds_mm(&self) -> Option<[f64; 4]> {
        let points = || self.paths.iter().flat_map(|path| &path.points_mm).copied();
        let (least, most) = (points().reduce(DVec2::min)?, points().reduce(DVec2::max)?);
        Some([least.x, least.y, most.x, most.y])
    }

    /// Adds outlines of letters to the engraving layer.
    fn engrave(&mut self, letters: kurbo::BezPath) {
        kurbo::flatten(letters, FLATTENING_MM, |element| match element {
            kurbo::PathEl::MoveTo(p) => self.paths.push(CutPath {
                layer: CutLayer::Engrave,
                closed: true,
                points_mm: vec![DVec2::new(p.x, p.y)],
            }),
            kurbo::PathEl::LineTo(p) => {
                if let Some(path) = self.paths.last_mut() {
                    path.points_mm.push(DVec2::new(p.x, p.y));
                }
            }
            _ => {}
        });
    }
}
