//! A page of a document, rendered as its sheet requires.

use glam::DVec2;

use crate::document::opened::Document;
use crate::document::page::Page;
use crate::finding::any::{Finding, PageFinding};
use crate::reading::error::DocumentError;
use crate::verifier::{PRINT_PX_PER_MM, Verifier};
use deltille_layout::SheetLayout;

/// Minimum edge of a tag cell in the image, px, so that it contains more than a few pixels.
const CELL_PX: f64 = 8.0;

/// A page with a side longer than stated by this factor is not rendered: at the resolution that the
/// size limit allows, its boards would be too small to detect.
const MAX_ENLARGED: f64 = 10.0;

/// A page of a document.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub document: &'a Document,
    pub page: usize,
}

impl Source<'_> {
    /// Renders the page, mirrored back if it is printed as a mirror image, and returns a finding if its size is
    /// wrong.
    pub(crate) fn render(
        &self,
        layout: &SheetLayout,
        px_per_mm: f64,
        is_mirrored: bool,
    ) -> Result<(Page, Vec<Finding>), DocumentError> {
        let tolerance_mm = self.document.size_tolerance_mm();
        let stated_mm = DVec2::new(layout.width_mm, layout.height_mm);
        let found_mm = self.document.size_mm(self.page);
        if found_mm.cmpgt(MAX_ENLARGED * stated_mm).any() {
            return Err(self.document.too_large(found_mm, stated_mm));
        }
        let mut page = self.document.render(self.page, px_per_mm)?;
        let turned = |page: Page| if is_mirrored { page.mirrored() } else { page };
        if (found_mm - stated_mm).abs().max_element() > tolerance_mm {
            let page = turned(page);
            return Ok((page, vec![PageFinding::PageSize { found_mm, stated_mm }.into()]));
        }
        // Images begin at the upper edge and end with a whole pixel. Heights are therefore measured from the true
        // lower edge, not from the end of the last pixel; the same applies to the other side of mirrored pages.
        (page.width_mm, page.height_mm) = (layout.width_mm, layout.height_mm);
        Ok((turned(page), Vec::new()))
    }
}

/// Returns the print resolution, or a finer one if tag cells are small.
pub(crate) fn wish_px_per_mm(verifier: &Verifier, layout: &SheetLayout) -> f64 {
    let panels = verifier.target().panels.iter();
    let here = panels.filter(|panel| layout.placements.iter().any(|p| p.panel == panel.id));
    let cells_mm = here.filter_map(|panel| {
        panel.border_bits?;
        let family = verifier.family()?.of_tiling(panel.kind)?;
        Some(panel.edge_mm / family.cells().width(panel.tag_inset_bits()))
    });
    cells_mm.map(|cell_mm| CELL_PX / cell_mm).fold(PRINT_PX_PER_MM, f64::max)
}
