//! Verification of panels that the detector does not search for, at their stated positions: single tags, and grids of
//! discs.
//!
//! Discs are measured by the centre of gravity and the amount of their ink, tags cell by cell.

use std::f64::consts::PI;

use glam::DVec2;

use crate::finding::any::Finding;
use crate::finding::board::BoardFinding;
use crate::finding::tile::TileFinding;
use crate::panel::placed::PlacedPanel;
use crate::verdict::SheetVerdict;
use crate::verifier::{TOLERANCE_MM, Verifier};
use deltille_core::targets::Corner;

/// Whether the page has panels and all of them are of this kind.
pub(super) fn is_for(placed: &[PlacedPanel]) -> bool {
    let is_stated = |placed: &PlacedPanel| {
        let panel = placed.panel;
        panel.is_tag_alone() || panel.discs_mm.is_some()
    };
    placed.iter().all(is_stated)
}

/// Compares the panels of the page.
pub(super) fn check(verifier: &Verifier, panels: &[PlacedPanel], verdict: &mut SheetVerdict) {
    for placed in panels {
        let panel = placed.panel;
        verdict.tags += panel.tags.len();
        verdict.corners += panel.corners.len();
        if let Some(diameter_mm) = panel.discs_mm {
            verdict.has_discs = true;
            check_discs(placed, diameter_mm, verdict);
            continue;
        }
        let report = placed.check_tiles(verifier.family());
        verdict.tags_exact += report.tags_exact;
        if report.wrong_tiles > 0 {
            verdict.findings.push(TileFinding::TagMissing { id: panel.id }.into());
        } else {
            verdict.findings.extend(report.findings.into_iter().map(Finding::from));
        }
    }
}

/// Compares positions and diameters of discs.
fn check_discs(placed: &PlacedPanel, stated_mm: f64, verdict: &mut SheetVerdict) {
    for corner in &placed.panel.corners {
        let Corner { id, row, col, panel_mm, .. } = *corner;
        let Some((place, found_mm)) = disc(placed, corner) else {
            verdict.findings.push(BoardFinding::CornerMissing { id, row, col }.into());
            continue;
        };
        verdict.corners_found += 1;
        let by_mm = place - placed.page_from_panel(panel_mm);
        verdict.max_deviation_mm = verdict.max_deviation_mm.max(by_mm.length());
        if by_mm.length() > TOLERANCE_MM {
            verdict.findings.push(BoardFinding::CornerOff { id, row, col, by_mm }.into());
        }
        if (found_mm - stated_mm).abs() > 2.0 * TOLERANCE_MM {
            let finding = BoardFinding::DiscDiameter { id, row, col, found_mm, stated_mm };
            verdict.findings.push(finding.into());
        }
    }
}

/// Returns the centre of gravity of the ink in a square of one spacing around a disc, mm on the page, and the
/// diameter of a disc with the same amount of ink, mm; `None` without ink.
fn disc(placed: &PlacedPanel, corner: &Corner) -> Option<(DVec2, f64)> {
    let page = placed.page;
    let middle = page.px_from_page(placed.page_from_panel(corner.panel_mm));
    let half = placed.panel.edge_mm / 2.0 * page.px_per_mm;
    let [low, high] = [middle - half, middle + half].map(DVec2::round);
    let (mut ink, mut moment) = (0.0, DVec2::ZERO);
    for y in low.y as i64..high.y as i64 {
        for x in low.x as i64..high.x as i64 {
            let at = DVec2::new(x as f64, y as f64);
            let here = page.ink(at);
            ink += here;
            moment += here * (at - middle);
        }
    }
    let diameter_mm = (4.0 * ink / PI).sqrt() / page.px_per_mm;
    (ink > 0.0).then(|| (page.page_from_px(middle + moment / ink), diameter_mm))
}
