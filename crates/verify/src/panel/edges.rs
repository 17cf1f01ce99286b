//! Subpixel positions of the edges of tiles and cells.
//!
//! A pixel on an edge may have any grey value, so a single pixel carries little information. But an
//! edge displaced by d px causes d px² of excess or missing ink along each px of its length,
//! whichever pixels it crosses. Over a square of pixels these add up, while rounding and smear of
//! single pixels do not.

use std::collections::BTreeMap;

use glam::DVec2;
use rayon::prelude::*;

use crate::panel::pattern::{Expected, Pattern};
use crate::panel::placed::PlacedPanel;
use deltille_core::lattice::Tile;

/// Side of the squares over which ink is summed, px: shorter than the side of a rendered cell.
const SQUARE: usize = 8;

/// Distance within which pixels beside one on an edge are summed with it, px.
const NEAR: usize = 2;

/// Samples per axis of a pixel on an edge.
const SAMPLES: usize = 4;

/// An edge that is displaced.
pub(crate) struct MovedEdge {
    pub tile: Tile,
    pub at_mm: DVec2,
    /// Mean displacement over the examined length, mm.
    pub by_mm: f64,
}

/// From pixels to positions in the panel, in edges.
struct LatticeFromPx {
    origin: DVec2,
    right: DVec2,
    down: DVec2,
}

impl LatticeFromPx {
    fn new(placed: &PlacedPanel) -> Option<Self> {
        let stated_from_found = placed.found_from_stated.inverse()?;
        let at = |px| {
            let stated = stated_from_found.apply(placed.page.page_from_px(px));
            placed.panel_from_page(stated) / placed.panel.edge_mm
        };
        let origin = at(DVec2::ZERO);
        Some(Self { origin, right: at(DVec2::X) - origin, down: at(DVec2::Y) - origin })
    }

    fn apply(&self, px: DVec2) -> DVec2 {
        self.origin + px.x * self.right + px.y * self.down
    }
}

impl PlacedPanel<'_> {
    /// Returns the edges that are displaced by more than `tolerance_px`: for each tile the most displaced one.
    pub(crate) fn moved_edges(
        &self,
        expected: &BTreeMap<Tile, Expected>,
        tolerance_px: f64,
    ) -> Vec<MovedEdge> {
        let Some(lattice_from_px) = LatticeFromPx::new(self) else { return Vec::new() };
        let pattern = Pattern::new(self.panel, expected);
        let tile_at = |px| self.panel.tile_at(lattice_from_px.apply(px));
        let is_black = |px: DVec2| pattern.is_black_at(lattice_from_px.apply(px));
        let (width, height) = (self.page.image.width(), self.page.image.height());
        let corners = expected.keys().flat_map(|tile| tile.vertices());
        let corners = corners.map(|vertex| self.px_of(vertex));
        let (first, last) = corners
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), at| {
                (low.min(at), high.max(at))
            });
        let squares = |low: f64, high: f64, size: usize| {
            let low = (low - NEAR as f64).max(0.0) as usize / SQUARE;
            low..((high + NEAR as f64).max(0.0) as usize / SQUARE + 1).min(size / SQUARE)
        };
        let (rows, columns) = (squares(first.y, last.y, height), squares(first.x, last.x, width));
        let of_row = |row: usize| -> Vec<([usize; 2], f64)> {
            let of_square = |column: usize| {
                let at = [column * SQUARE, row * SQUARE];
                let middle = DVec2::from(at.map(|low| low as f64)) + (SQUARE - 1) as f64 / 2.0;
                let is_clear = !self.is_text(middle, (SQUARE + NEAR) as f64);
                Some((at, is_clear.then(|| self.displaced(at, &is_black))??))
            };
            columns
                .clone()
                .filter_map(of_square)
                .filter(|(_, by)| by.abs() > tolerance_px)
                .collect()
        };
        let found: Vec<_> = rows.into_par_iter().flat_map_iter(of_row).collect();
        let mut most = BTreeMap::<Tile, (DVec2, f64)>::new();
        for (corner, by) in found {
            let middle = DVec2::from(corner.map(|low| low as f64)) + (SQUARE - 1) as f64 / 2.0;
            let entry = most.entry(tile_at(middle)).or_insert((middle, by));
            if by.abs() > entry.1.abs() {
                *entry = (middle, by);
            }
        }
        let moved = most.into_iter().map(|(tile, (at, by))| MovedEdge {
            tile,
            at_mm: self.page.page_from_px(at),
            by_mm: by / self.page.px_per_mm,
        });
        moved.collect()
    }

    /// Returns the displacement of edges in the square of pixels that begins at `low`, px, positive for excess ink;
    /// `None` without an edge.
    fn displaced(&self, low: [usize; 2], is_black: &impl Fn(DVec2) -> bool) -> Option<f64> {
        const SIDE: usize = SQUARE + 2 * NEAR;
        // Whether the corner of a pixel is black; pixels are counted from the first one in the margin of the square.
        let corner = |x: usize, y: usize| {
            is_black(DVec2::new((low[0] + x) as f64, (low[1] + y) as f64) - NEAR as f64 - 0.5)
        };
        let coarse = (0..=SIDE).step_by(SIDE / 3);
        let mut coarse = coarse.clone().flat_map(|y| coarse.clone().map(move |x| corner(x, y)));
        let first = coarse.next()?;
        if coarse.all(|black| black == first) {
            return None;
        }
        let corners: [[bool; SIDE + 1]; SIDE + 1] =
            std::array::from_fn(|y| std::array::from_fn(|x| corner(x, y)));
        let is_crossed = |x: usize, y: usize| {
            let [upper, lower] = [&corners[y][x..=x + 1], &corners[y + 1][x..=x + 1]];
            upper.iter().chain(lower).any(|&black| black != corners[y][x])
        };
        let crossed: [[bool; SIDE]; SIDE] =
            std::array::from_fn(|y| std::array::from_fn(|x| is_crossed(x, y)));
        let (mut error, mut length) = (0.0, 0);
        for (y, x) in (0..SQUARE).flat_map(|y| (0..SQUARE).map(move |x| (y, x))) {
            let is_near =
                crossed[y..=y + 2 * NEAR].iter().any(|row| row[x..=x + 2 * NEAR].contains(&true));
            if !is_near {
                continue;
            }
            let px = [low[0] + x, low[1] + y];
            let expected = match crossed[y + NEAR][x + NEAR] {
                true => covered(px, is_black),
                false => f64::from(u8::from(corners[y + NEAR][x + NEAR])),
            };
            error += 1.0 - f64::from(self.page.image.at(px[0], px[1])) / 255.0 - expected;
            length += usize::from(crossed[y + NEAR][x + NEAR]);
        }
        (error != 0.0).then(|| error / length.max(SQUARE) as f64)
    }
}

/// Returns the fraction of a pixel that is black.
fn covered([x, y]: [usize; 2], is_black: &impl Fn(DVec2) -> bool) -> f64 {
    let sample = |i: usize| (i as f64 + 0.5) / SAMPLES as f64 - 0.5;
    let samples = (0..SAMPLES).flat_map(|j| (0..SAMPLES).map(move |i| (i, j)));
    let middle = DVec2::new(x as f64, y as f64);
    let black = samples.filter(|&(i, j)| is_black(middle + DVec2::new(sample(i), sample(j))));
    black.count() as f64 / (SAMPLES * SAMPLES) as f64
}
