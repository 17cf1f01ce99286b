//! Verification of a sheet of single tags: without corners to detect, each tag is compared at its
//! stated position.

use super::tiles::TileFinding;
use super::{Finding, SheetVerdict, Verifier};
use crate::document::Page;
use deltille_core::targets::SheetLayout;

/// Compares every cell of every tag of the page.
pub(super) fn check(
    verifier: &Verifier,
    page: &Page,
    layout: &SheetLayout,
    verdict: &mut SheetVerdict,
) {
    for placed in verifier.placed(page, layout) {
        verdict.tags += placed.panel.tags.len();
        let report = placed.check_tiles(verifier.family);
        verdict.tags_exact += report.tags_exact;
        if report.wrong_tiles > 0 {
            verdict.findings.push(TileFinding::TagMissing { id: placed.panel.id }.into());
        } else {
            verdict.findings.extend(report.findings.into_iter().map(Finding::from));
        }
    }
}
