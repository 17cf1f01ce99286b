//! A panel on its page, at its stated and its found position.

use std::collections::BTreeSet;

use glam::DVec2;

use crate::document::page::Page;
use crate::panel::affine_map::AffineMap;
use crate::panel::text_area::TextArea;
use deltille_core::lattice::{Tile, Vertex};
use deltille_core::statistics::median;
use deltille_core::targets::Panel;
use deltille_layout::{Placement, SheetLayout, SheetText};

/// Tiles of one colour agree if the ink of nine in ten is this close to their median.
const TONE_SPREAD: f64 = 0.1;

/// A panel on its page, as found.
pub(crate) struct PlacedPanel<'a> {
    pub page: &'a Page,
    pub panel: &'a Panel,
    pub placement: &'a Placement,
    /// From stated to found page positions.
    pub found_from_stated: AffineMap,
    /// Direction of the panel's x axis on the page.
    along: DVec2,
    /// The texts at their stated positions: their content is compared separately.
    texts: Vec<TextArea>,
}

impl<'a> PlacedPanel<'a> {
    pub(crate) fn new(
        page: &'a Page,
        panel: &'a Panel,
        placement: &'a Placement,
        found_from_stated: AffineMap,
    ) -> Self {
        let along = DVec2::from_angle(placement.angle_rad);
        Self { page, panel, placement, found_from_stated, along, texts: Vec::new() }
    }

    /// Adds the texts of its sheet, some of which may lie in its tiles.
    pub(crate) fn among(mut self, layout: &SheetLayout) -> Self {
        let [left, lower, right, upper] = self.panel.bounds_mm();
        let rectangle = |text: &SheetText| {
            let first = self.panel_from_page(text.at_mm);
            let inside = (left..right).contains(&first.x) && (lower..upper).contains(&first.y);
            inside.then(|| TextArea::of(self.page, text))?
        };
        self.texts = layout.texts.iter().filter_map(rectangle).collect();
        self
    }

    /// Whether a text lies within `near_px` of a pixel.
    pub(crate) fn is_text(&self, px: DVec2, near_px: f64) -> bool {
        self.texts.iter().any(|text| text.is_near(px, near_px))
    }

    /// Returns the texts in a rectangle of the image, and some beside it.
    pub(crate) fn texts_within(&self, low: DVec2, high: DVec2) -> Vec<&TextArea> {
        self.texts.iter().filter(|text| text.is_within(low, high)).collect()
    }

    /// Returns the stated page position of a point of the panel.
    pub(crate) fn page_from_panel(&self, point: DVec2) -> DVec2 {
        self.along.rotate(point) + self.placement.origin_mm
    }

    /// Returns the stated panel position of a point of the page.
    pub(crate) fn panel_from_page(&self, point: DVec2) -> DVec2 {
        let back = DVec2::new(self.along.x, -self.along.y);
        back.rotate(point - self.placement.origin_mm)
    }

    /// Returns the ink of tiles that should be white and black, in the centre of plain tiles. Returns `None` if the
    /// tiles of one colour disagree, so that the page shows something else.
    pub(crate) fn tones(&self) -> Option<[f64; 2]> {
        let tagged: BTreeSet<Tile> =
            self.panel.tags.iter().map(|tag| self.panel.tag_tile(tag)).collect();
        let mut inks = [Vec::new(), Vec::new()];
        for tile in self.panel.tiles() {
            if tagged.contains(&tile) {
                continue;
            }
            let [a, b, c] = self.frame_px(tile);
            let DVec2 { x: u, y: v } = self.panel.kind.middle();
            let centre = a + u * (b - a) + v * (c - a);
            if self.is_text(centre, 0.0) {
                continue;
            }
            inks[usize::from(tile.is_dark() != self.panel.inverted)].push(self.page.ink(centre));
        }
        let tone = |inks: &Vec<f64>| {
            let median = median(inks.clone())?;
            let alike = inks.iter().filter(|ink| (*ink - median).abs() <= TONE_SPREAD).count();
            (10 * alike >= 9 * inks.len()).then_some(median)
        };
        let [white, black] = &inks;
        Some([tone(white)?, tone(black)?])
    }

    /// Returns the image positions of a tile's A, B and C.
    pub(crate) fn frame_px(&self, tile: Tile) -> [DVec2; 3] {
        tile.frame().map(|vertex| self.px_of(vertex))
    }

    /// Returns the image position of a vertex.
    pub(crate) fn px_of(&self, vertex: Vertex) -> DVec2 {
        let stated = self.page_from_panel(self.panel.lattice_mm(vertex));
        self.page.px_from_page(self.found_from_stated.apply(stated))
    }
}
