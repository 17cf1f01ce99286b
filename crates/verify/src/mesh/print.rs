//! Comparison of the texture of a face, like a printed page and then texel by texel.

use glam::DVec2;

use crate::finding::mesh::MeshFinding;
use crate::mesh::face_view::MAX_TEXEL_PX;
use crate::mesh::flat_face::{face_outline_mm, face_page, front};
use crate::mesh::texels::Texels;
use crate::model::mesh::Model;
use crate::panel::affine_map::AffineMap;
use crate::panel::pattern::{Pattern, TagLooks, expected};
use crate::panel::placed::PlacedPanel;
use crate::panel::spots::named;
use crate::panel::tones::wrong_tones;
use crate::verdict::FaceVerdict;
use crate::verifier::Verifier;
use deltille_core::targets::Panel;

/// White margin around a face in its image, px.
const AROUND_PX: f64 = 8.0;

/// Compares the texture of the face tile by tile and cell by cell, and searches for other marks.
pub(super) fn check_print(
    verifier: &Verifier,
    model: &Model,
    panel: &Panel,
    px_per_mm: f64,
    verdict: &mut FaceVerdict,
) {
    let outline = face_outline_mm(verifier, panel);
    let front = front(model, panel, &outline);
    // Texels just outside the face are on the page, too.
    let around_mm = DVec2::splat(AROUND_PX / px_per_mm);
    let low = outline.iter().copied().reduce(DVec2::min).unwrap_or_default() - around_mm;
    let high = outline.iter().copied().reduce(DVec2::max).unwrap_or_default() + around_mm;
    let area_mm = [low.x, low.y, high.x, high.y];
    let (mut page, placement) = face_page(model, panel, &front, area_mm, px_per_mm);
    page.texel_px = page.texel_px.min(MAX_TEXEL_PX);
    let placed = PlacedPanel::new(&page, panel, &placement, AffineMap::IDENTITY);
    if let Some(finding) = wrong_tones(&placed) {
        verdict.findings.push(finding);
        return;
    }
    let report = placed.check_tiles(verifier.family());
    verdict.tags_exact = report.tags_exact;
    let on_panel = |place: DVec2| place + low;
    let are_right = report.findings.is_empty();
    let of_tiles = report.findings.into_iter().map(|finding| finding.moved(on_panel).into());
    verdict.findings.extend(of_tiles);
    let family = verifier.family().and_then(|family| family.of_tiling(panel.kind));
    let looks = family.map(|family| TagLooks::new(family, panel));
    let expected = expected(panel, family, looks.as_ref());
    let texels = Texels {
        model,
        panel,
        pattern: &Pattern::new(panel, &expected),
        cell_mm: looks.as_ref().map_or(f64::INFINITY, |looks| panel.edge_mm / looks.width),
        field: panel.field_outline_mm(),
        fills_face: panel.rim_mm.is_none(),
    };
    match texels.wrong(&front, &page, low, are_right) {
        Ok(wrong) => {
            let spots = named(&page, wrong).into_iter();
            verdict.findings.extend(spots.map(|spot| spot.moved(on_panel).into()));
        }
        Err(problem) => {
            verdict.findings.push(MeshFinding::Body { problem: problem.to_owned() }.into());
        }
    }
}
