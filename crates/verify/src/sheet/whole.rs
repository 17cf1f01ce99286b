//! A whole sheet: its panels, its check bars, and its marks.

use crate::document::page::Page;
use crate::finding::any::Finding;
use crate::finding::board::BoardFinding;
use crate::finding::mark::MarkFinding;
use crate::panel::affine_map::AffineMap;
use crate::panel::placed::PlacedPanel;
use crate::sheet::boards::Seen;
use crate::sheet::{bars, boards, marks, undetected};
use crate::verdict::SheetVerdict;
use crate::verifier::{TOLERANCE_MM, Verifier};
use deltille_layout::SheetLayout;

/// Compares the panels and marks of a whole sheet.
pub(crate) fn compare(
    verifier: &Verifier,
    page: &Page,
    layout: &SheetLayout,
    verdict: &mut SheetVerdict,
) -> Seen {
    let placed = placed(verifier, page, layout);
    let all_stated = placed.len() == layout.placements.len() && undetected::is_for(&placed);
    let (found_from_stated, seen) = if all_stated {
        undetected::check(verifier, &placed, verdict);
        (AffineMap::IDENTITY, Seen::new())
    } else {
        boards::check(verifier, page, layout, verdict)
    };
    let toneless = |finding: &Finding| {
        use BoardFinding::{Contrast, Inverted};
        matches!(finding, Finding::Board(Inverted { .. } | Contrast { .. }))
    };
    if verdict.findings.iter().any(toneless) {
        return seen;
    }
    let in_place = verdict.findings.iter().all(Finding::is_local);
    check_bars(page, layout, &found_from_stated, verdict);
    if in_place {
        let logo = verifier.printing.logo.as_ref();
        marks::check(page, layout, logo, &placed, None, verdict);
    }
    seen
}

/// Returns the panels of a page at their stated positions.
fn placed<'p>(
    verifier: &'p Verifier,
    page: &'p Page,
    layout: &'p SheetLayout,
) -> Vec<PlacedPanel<'p>> {
    let found_from_stated = AffineMap::IDENTITY;
    let placed = layout.placements.iter().filter_map(|placement| {
        let panel = verifier.target().panels.iter().find(|panel| panel.id == placement.panel)?;
        Some(PlacedPanel::new(page, panel, placement, found_from_stated).among(layout))
    });
    placed.collect()
}

/// Lowest resolution, px/mm, at which the edges of check bars are measured to a fraction of a pixel: their end strokes fill
/// at least one pixel completely.
const SHARP_PX_PER_MM: f64 = 7.0;

/// Measures the check bars. The position of the boards only determines where to search for them.
pub(crate) fn check_bars(
    page: &Page,
    layout: &SheetLayout,
    found_from_stated: &AffineMap,
    verdict: &mut SheetVerdict,
) {
    // Sheets of several metres are drawn so coarsely that an edge may be anywhere in its pixel.
    let tolerance_mm = match page.px_per_mm < SHARP_PX_PER_MM {
        true => TOLERANCE_MM.max(page.px_per_mm.recip()),
        false => TOLERANCE_MM,
    };
    for (index, bar) in layout.check_bars.iter().enumerate() {
        let stated_mm = bar.length_mm();
        let found_mm =
            bars::measure(page, [bar.from_mm, bar.to_mm].map(|end| found_from_stated.apply(end)));
        verdict.check_bars_mm.push((stated_mm, found_mm));
        if found_mm.is_none_or(|found| (found - stated_mm).abs() > tolerance_mm) {
            let finding = MarkFinding::CheckBar { bar: index + 1, found_mm, stated_mm };
            verdict.findings.push(finding.into());
        }
    }
}
