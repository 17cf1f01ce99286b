//! The printed page of a target as an image, with the positions of its corners.
//!
//! The PDF is written and then rendered by hayro. Corner positions are vertices of its own paths; the description of
//! the target only identifies which vertices are corners, and their ids.

use glam::DVec2;

use super::mips::{Beyond, Footprint, Mips};
use super::moved_edges::with_moved_edges;
use super::paths::Vertices;
use crate::photographs::PhotographError;
use deltille::artwork::ArtworkError;
use deltille::export::pdf;
use deltille::lattice::GridKind;
use deltille::layout::Printing;
use deltille::verify::Document;

/// Requested resolution, px/mm: 1200 dpi. Large pages have a lower one.
const PX_PER_MM: f64 = 1200.0 / 25.4;

/// Maximum distance of a path vertex from the nominal position of its corner, mm. The PDF contains points in single
/// precision.
const SAME_MM: f64 = 0.01;

/// Length of a tile edge in bit widths for untagged targets: that of the default tags.
const UNTAGGED_BITS: f64 = 10.0;

/// A corner on the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PageCorner {
    /// Corner id in the target.
    pub id: u32,
    /// Panel id.
    pub panel: u32,
    /// Lattice row.
    pub row: i32,
    /// Lattice column.
    pub col: i32,
    /// Position, mm from the lower-left corner of the page, y up.
    pub page_mm: DVec2,
}

/// A printed page.
pub struct PrintedPage {
    /// Width and height, mm.
    pub size_mm: DVec2,
    /// All corners on it.
    pub corners: Vec<PageCorner>,
    /// Length of a tile edge, mm.
    pub edge_mm: f64,
    /// Width of a tag's bit along the edge, mm.
    pub bit_mm: f64,
    /// Whether the labels of an untagged board are ambiguous under rotation by 180°.
    pub half_turn: bool,
    brightness: Mips,
    px_per_mm: f64,
}

impl PrintedPage {
    /// Prints the first page of a target.
    ///
    /// # Errors
    /// Returns an error if the target has no sheet, or the family of its tags is unknown.
    pub fn new(printing: &Printing) -> Result<Self, PhotographError> {
        let (Some(panel), Some(sheet)) = (printing.target.panels.first(), printing.sheets.first())
        else {
            return Err(PhotographError::NoSheet);
        };
        if !sheet.pages.is_empty() {
            return Err(PhotographError::SeveralPages);
        }
        let artwork = printing.draw()?;
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("page.pdf");
        pdf::write(&artwork, &path)?;
        let document = Document::open(&path)?;
        let page = document.render(0, PX_PER_MM)?;
        let vertices = Vertices::of_first_page(&std::fs::read(&path)?)?;

        let target = &printing.target;
        let meeting = match panel.kind {
            GridKind::Deltille => 3,
            GridKind::Checker => 2,
        };
        let mut corners = Vec::new();
        for placement in &sheet.placements {
            let Some(panel) = target.panels.iter().find(|panel| panel.id == placement.panel) else {
                continue;
            };
            for corner in &panel.corners {
                let stated = placement.page_from_panel(corner.panel_mm);
                let (page_mm, _) = vertices
                    .meeting(stated, SAME_MM)
                    .filter(|(_, contours)| *contours >= meeting)
                    .ok_or(PhotographError::NoCorner { id: corner.id, at_mm: stated })?;
                let (id, row, col) = (corner.id, corner.row, corner.col);
                corners.push(PageCorner { id, panel: panel.id, row, col, page_mm });
            }
        }
        let family = target.family().map_err(ArtworkError::from)?;
        let bits = family
            .filter(|_| panel.border_bits.is_some())
            .map_or(UNTAGGED_BITS, |family| family.cells().width(panel.tag_inset_bits()));
        let [cols, rows] = panel.matrix;
        Ok(Self {
            size_mm: DVec2::new(page.width_mm, page.height_mm),
            corners,
            edge_mm: panel.edge_mm,
            bit_mm: panel.edge_mm / bits,
            half_turn: panel.kind == GridKind::Checker
                && target.family.is_none()
                && (rows + cols) % 2 == 0,
            px_per_mm: page.px_per_mm,
            brightness: Mips::new(page.image, Beyond::Border),
        })
    }

    /// Returns this page with dark areas that have grown on every side by a fraction of an edge.
    pub fn with_moved_edges(&self, edges: f64) -> Self {
        let px_per_mm = self.px_per_mm / 2.0;
        let moved = with_moved_edges(self.brightness.half(), edges * self.edge_mm * px_per_mm);
        let (corners, brightness) = (self.corners.clone(), Mips::new(moved, Beyond::Border));
        Self { corners, brightness, px_per_mm, ..*self }
    }

    /// Returns the centre of the bounding box of all corners, mm, and its size.
    pub fn board_mm(&self) -> (DVec2, DVec2) {
        let places = || self.corners.iter().map(|corner| corner.page_mm);
        let least = places().fold(DVec2::INFINITY, DVec2::min);
        let most = places().fold(DVec2::NEG_INFINITY, DVec2::max);
        (least.midpoint(most), most - least)
    }

    /// Returns the mean whiteness of a small parallelogram of the page, 0 for ink to 1 for bare paper; `None` outside
    /// the page. Its sides are in mm.
    pub(crate) fn whiteness(&self, place: DVec2, footprint: &Footprint) -> Option<f32> {
        let on_page = place.cmpge(DVec2::ZERO).all() && place.cmple(self.size_mm).all();
        on_page.then(|| {
            let from_top = DVec2::new(place.x, self.size_mm.y - place.y);
            self.brightness.area(from_top * self.px_per_mm - 0.5, footprint) / 255.0
        })
    }

    /// Determines the sampling of a parallelogram with these sides, mm.
    pub(crate) fn footprint(&self, across: DVec2, down: DVec2) -> Footprint {
        let px = |side: DVec2| side * DVec2::new(1.0, -1.0) * self.px_per_mm;
        self.brightness.footprint(px(across), px(down))
    }
}
