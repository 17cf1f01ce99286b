//! The area between the marks and outside the tiles: paper, or the black field of an inverted panel.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use crate::document::page::{MAX_INK_ERROR, Page};
use crate::finding::mark::MarkFinding;
use crate::panel::pattern::{EDGE_PX, PROBES};
use crate::panel::placed::PlacedPanel;
use crate::panel::spots::named;
use crate::panel::tile_table::TileTable;
use deltille_core::polygon::rectangle;

/// Returns a finding for each connected spot of wrong pixels outside the tiles and the `known` marks.
pub(super) fn spots(page: &Page, known: &[bool], panels: &[PlacedPanel]) -> Vec<MarkFinding> {
    let (width, height) = (page.image.width(), page.image.height());
    let grounds: Vec<Ground> = panels.iter().map(Ground::new).collect();
    let is_inverted = grounds.iter().any(Ground::inverted);
    let mut wrong = vec![false; width * height];
    wrong.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, (wrong, &pixel)) in row.iter_mut().zip(page.image.row(y)).enumerate() {
            let ink = 1.0 - f64::from(pixel) / 255.0;
            // White is right wherever there is no inverted panel; this handles most of the sheet.
            let plain = ink <= MAX_INK_ERROR && !is_inverted;
            if plain || known[y * width + x] {
                continue;
            }
            let pixel = DVec2::new(x as f64, y as f64);
            // Most black pixels lie in tiles, which are compared separately.
            if grounds.iter().any(|ground| ground.has_tile_at(page, pixel)) {
                continue;
            }
            // Only at this distance from edges.
            let is_off = |most: f64, near_px: f64| {
                // Black is right wherever it may be expected; this handles most of an inverted panel.
                if 1.0 - ink <= most
                    && grounds.iter().any(|ground| ground.has_field_at(page, pixel))
                {
                    return false;
                }
                let expected = |ground: &Ground| ground.expected(page, pixel, near_px);
                let expected = grounds.iter().find_map(expected).unwrap_or(Some(0.0));
                expected.is_some_and(|expected| (ink - expected).abs() > most)
            };
            *wrong = is_off(page.max_ink_error_at_edges(), EDGE_PX)
                || page.smear_px > 0.0 && is_off(MAX_INK_ERROR, EDGE_PX + page.smear_px);
        }
    });
    named(page, wrong)
}

/// The area of a panel on its page.
pub(super) struct Ground<'a> {
    placed: &'a PlacedPanel<'a>,
    tiles: TileTable<()>,
    /// Directions in which tiles are searched for beside a pixel: close enough together that no tip of a tile, even a
    /// single one, fits between two of them.
    probes: Vec<DVec2>,
    /// Outline of the tiles, or of the black field of an inverted panel, counter-clockwise: the start of each side
    /// and its inward direction, mm.
    field: Vec<[DVec2; 2]>,
    /// Area of the image where that outline may be: left, upper, right and lower bound, px.
    around_px: [f64; 4],
}

impl<'a> Ground<'a> {
    pub(super) fn new(placed: &'a PlacedPanel<'a>) -> Self {
        let panel = placed.panel;
        let outline = match panel.inverted {
            true => panel.field_outline_mm(),
            false => rectangle(panel.bounds_mm()).to_vec(),
        };
        let ends = || outline.iter().map(|&p| placed.page.px_from_page(placed.page_from_panel(p)));
        let reach_px = 2.0 * EDGE_PX + placed.page.smear_px;
        let first = ends().fold(DVec2::INFINITY, DVec2::min) - reach_px;
        let last = ends().fold(DVec2::NEG_INFINITY, DVec2::max) + reach_px;
        let next = outline.iter().cycle().skip(1);
        let inwards = |from: DVec2, to: DVec2| [from, (to - from).perp().normalize_or_zero()];
        let field = outline.iter().zip(next).map(|(&from, &to)| inwards(from, to)).collect();
        let around_px = [first.x, first.y, last.x, last.y];
        let tiles = panel.tiles();
        let angles = (0..PROBES).map(|n| f64::from(n) * TAU / f64::from(PROBES));
        let probes = angles.map(DVec2::from_angle).collect();
        Self {
            placed,
            tiles: TileTable::new(tiles.iter().map(|&tile| (tile, ()))),
            probes,
            field,
            around_px,
        }
    }

    fn inverted(&self) -> bool {
        self.placed.panel.inverted
    }

    /// Whether a pixel is in the area of the image where the panel may be.
    fn is_around(&self, pixel: DVec2) -> bool {
        let [left, upper, right, lower] = self.around_px;
        pixel.x >= left && pixel.x <= right && pixel.y >= upper && pixel.y <= lower
    }

    /// Whether a pixel is in a tile of the panel.
    fn has_tile_at(&self, page: &Page, pixel: DVec2) -> bool {
        self.is_around(pixel) && {
            let place = self.placed.panel_from_page(page.page_from_px(pixel));
            self.tiles.get(self.placed.panel.tile_at(place / self.placed.panel.edge_mm)).is_some()
        }
    }

    /// Whether a pixel is in the black field of an inverted panel.
    fn has_field_at(&self, page: &Page, pixel: DVec2) -> bool {
        self.inverted()
            && self.is_around(pixel)
            && self.inside_mm(self.placed.panel_from_page(page.page_from_px(pixel))) >= 0.0
    }

    /// Returns how far a position on the panel lies within the outline of the field, mm.
    fn inside_mm(&self, place: DVec2) -> f64 {
        let depths = self.field.iter().map(|[from, inwards]| (place - from).dot(*inwards));
        depths.fold(f64::INFINITY, f64::min)
    }

    /// Returns the expected ink of a pixel in the panel's area. Returns `Some(None)` in and beside the tiles, which
    /// are compared separately, and within `near_px` of the edge of the field. Another panel may lie between the
    /// tiles of a panel that is not inverted.
    pub(super) fn expected(&self, page: &Page, pixel: DVec2, near_px: f64) -> Option<Option<f64>> {
        if !self.is_around(pixel) {
            return None;
        }
        let place = self.placed.panel_from_page(page.page_from_px(pixel));
        let inside = self.inside_mm(place) * page.px_per_mm;
        if inside < -near_px {
            return None;
        }
        let edge_mm = self.placed.panel.edge_mm;
        let near = near_px / page.px_per_mm;
        let reaches = |off: DVec2| {
            self.tiles.get(self.placed.panel.tile_at((place + off) / edge_mm)).is_some()
        };
        let in_tile =
            reaches(DVec2::ZERO) || self.probes.iter().any(|&probe| reaches(near * probe));
        let undecided = in_tile || (self.inverted() && inside < near_px);
        if undecided { Some(None) } else { self.inverted().then_some(Some(1.0)) }
    }
}
