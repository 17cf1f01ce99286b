//! What lies outside the tiles: every text has its ink, and nothing else is on the sheet.
//!
//! The letters are those of the built-in font, so that their outlines come from the same place as
//! those printed; what is proved is that the sheet has the words of the description.

use std::collections::BTreeSet;

use kurbo::{BezPath, PathEl, Shape};
use rayon::prelude::*;

use super::document::Page;
use super::tiles::{EDGE_PX, MAX_INK_ERROR, PlacedPanel};
use super::{Finding, SheetVerdict};
use crate::artwork;
use crate::lattice::{ROW_HEIGHT, Tile, Vertex};
use crate::raster::{Coverage, Gray};
use crate::target::{CHECK_BAR_STROKE_MM, SheetLayout, SheetText};

/// Ink of a text and of its outline, each the mean of 3 × 3 pixels, may differ by this. An edge
/// that lies 0.02 mm off at 300 dpi changes a mean by 0.08, a missing stroke by more than 0.5.
const MAX_TEXT_ERROR: f64 = 0.3;

/// White around a text that belongs to it, px.
const TEXT_BLANK_PX: f64 = 3.0;

/// Beyond the ends and strokes of a check bar nothing is called a spot, mm: what is wrong with a
/// bar, its measurement tells.
const BAR_BLANK_MM: f64 = 0.3;

/// How finely curves are turned into lines, mm.
const FLATNESS_MM: f64 = 0.002;

/// Compares the texts, and looks for ink where none should be.
pub(super) fn check(
    page: &Page,
    layout: &SheetLayout,
    panels: &[PlacedPanel],
    verdict: &mut SheetVerdict,
) {
    let (width, height) = (page.image.width(), page.image.height());
    let mut known = vec![false; width * height];
    let mut cover = |[x0, y0, x1, y1]: [usize; 4]| {
        (y0..y1).for_each(|y| known[y * width + x0..y * width + x1].fill(true));
    };
    for (index, text) in layout.texts.iter().enumerate() {
        let outline = artwork::text_outline(text).ok();
        let area = outline.as_ref().filter(|path| !path.is_empty()).map(|path| {
            let bounds = path.bounding_box();
            pixels(page, [bounds.x0, bounds.y0, bounds.x1, bounds.y1], TEXT_BLANK_PX)
        });
        let same = match (&outline, area) {
            (Some(path), Some(area)) => has_ink(page, path, area),
            (Some(_), None) => true,
            (None, _) => false,
        };
        if !same {
            let SheetText { text, .. } = text;
            verdict.findings.push(Finding::TextDiffers { text: index + 1, stated: text.clone() });
        }
        area.into_iter().for_each(&mut cover);
    }
    for bar in &layout.check_bars {
        let blank = (CHECK_BAR_STROKE_MM / 2.0 + BAR_BLANK_MM) * page.px_per_mm;
        cover(pixels(page, spanned(bar.from_mm, bar.to_mm), blank));
    }
    for line in &layout.lines {
        let blank = (line.width_mm / 2.0 + BAR_BLANK_MM) * page.px_per_mm;
        cover(pixels(page, spanned(line.from_mm, line.to_mm), blank));
    }
    verdict.findings.extend(spots(page, &known, panels));
}

/// The rectangle that two points span: left, lower, right, upper.
fn spanned(from: [f64; 2], to: [f64; 2]) -> [f64; 4] {
    let [left, lower] = [0, 1].map(|i| from[i].min(to[i]));
    let [right, upper] = [0, 1].map(|i| from[i].max(to[i]));
    [left, lower, right, upper]
}

/// The pixels of a rectangle of the page (mm) with `blank` more on every side: first and
/// past-the-end column and row, as left, upper, right, lower.
fn pixels(page: &Page, [x0, y0, x1, y1]: [f64; 4], blank: f64) -> [usize; 4] {
    let (least, most) = (page.px_from_page([x0, y1]), page.px_from_page([x1, y0]));
    let (width, height) = (page.image.width() as f64, page.image.height() as f64);
    let [left, upper] = least.map(|v| (v - blank).floor().max(0.0));
    let [right, lower] = most.map(|v| (v + blank).ceil() + 1.0);
    let (right, lower) = (right.clamp(0.0, width), lower.clamp(0.0, height));
    [left.min(right), upper.min(lower), right, lower].map(|v| v as usize)
}

/// Whether an area of the page has the ink of an outline, and no other.
fn has_ink(page: &Page, path: &BezPath, [x0, y0, x1, y1]: [usize; 4]) -> bool {
    let (width, height) = (x1 - x0, y1 - y0);
    let mut coverage = Coverage::new(width, height);
    let mut polygon: Vec<[f64; 2]> = Vec::new();
    kurbo::flatten(path, FLATNESS_MM, |element| match element {
        PathEl::MoveTo(p) | PathEl::LineTo(p) => {
            let [x, y] = page.px_from_page([p.x, p.y]);
            polygon.push([x - x0 as f64, y - y0 as f64]);
        }
        _ => {
            coverage.add(&polygon, 1.0);
            polygon.clear();
        }
    });
    // Which way outlines run is the font's business.
    let stated = coverage.finish().map(|v| v.abs().min(1.0));
    let found =
        Gray::from_fn(width, height, |x, y| 1.0 - f32::from(page.image.at(x0 + x, y0 + y)) / 255.0);
    let mean = |image: &Gray<f32>, x: usize, y: usize| {
        let rows = (y - 1..=y + 1).map(|y| image.row(y)[x - 1..=x + 1].iter().sum::<f32>());
        f64::from(rows.sum::<f32>()) / 9.0
    };
    let inside = |n: usize| 1..n.saturating_sub(1);
    inside(height).all(|y| {
        inside(width).all(|x| (mean(&stated, x, y) - mean(&found, x, y)).abs() <= MAX_TEXT_ERROR)
    })
}

/// Names each connected spot of wrong pixels outside the tiles and the `known` marks.
pub(super) fn spots(page: &Page, known: &[bool], panels: &[PlacedPanel]) -> Vec<Finding> {
    let (width, height) = (page.image.width(), page.image.height());
    let grounds: Vec<Ground> = panels.iter().map(Ground::new).collect();
    let mut wrong = vec![false; width * height];
    wrong.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, (wrong, &pixel)) in row.iter_mut().zip(page.image.row(y)).enumerate() {
            let ink = 1.0 - f64::from(pixel) / 255.0;
            let at = [x as f64, y as f64];
            // White is right wherever no inverted panel is; most of the sheet is done here.
            let plain = ink <= MAX_INK_ERROR && grounds.iter().all(|ground| !ground.inverted());
            *wrong = !plain
                && !known[y * width + x]
                && grounds
                    .iter()
                    .find_map(|ground| ground.expected(page, at))
                    .unwrap_or(Some(0.0))
                    .is_some_and(|expected| (ink - expected).abs() > MAX_INK_ERROR);
        }
    });
    let mut spots = Vec::new();
    for start in 0..wrong.len() {
        if !std::mem::take(&mut wrong[start]) {
            continue;
        }
        let (mut stack, mut count, mut moment) = (vec![start], 0.0, [0.0; 2]);
        while let Some(at) = stack.pop() {
            let (x, y) = (at % width, at / width);
            count += 1.0;
            moment = [moment[0] + x as f64, moment[1] + y as f64];
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    if std::mem::take(&mut wrong[y * width + x]) {
                        stack.push(y * width + x);
                    }
                }
            }
        }
        let at_mm = page.page_from_px(moment.map(|m| m / count));
        spots.push(Finding::Spot { at_mm, area_mm2: count / page.px_per_mm.powi(2) });
    }
    spots
}

/// The area of a panel on its page.
struct Ground<'a> {
    placed: &'a PlacedPanel<'a>,
    tiles: BTreeSet<Tile>,
    /// The tiles and the black field of an inverted panel: left, lower, right, upper end, mm.
    field: [f64; 4],
}

impl<'a> Ground<'a> {
    fn new(placed: &'a PlacedPanel<'a>) -> Self {
        let panel = placed.panel;
        let field = if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
        Self { placed, tiles: placed.tiles(), field }
    }

    fn inverted(&self) -> bool {
        self.placed.panel.inverted
    }

    /// What a pixel of the panel's area should be; `Some(None)` in and beside the tiles, which are
    /// compared by themselves, and at the edge of the field.
    fn expected(&self, page: &Page, [x, y]: [f64; 2]) -> Option<Option<f64>> {
        let [u, v] = self.placed.panel_from_page(page.page_from_px([x, y]));
        let [left, lower, right, upper] = self.field;
        let inside = (u - left).min(right - u).min(v - lower).min(upper - v) * page.px_per_mm;
        if inside < -EDGE_PX {
            return None;
        }
        let edge_mm = self.placed.panel.edge_mm;
        let near = EDGE_PX / page.px_per_mm;
        let steps = [[0.0, 0.0], [near, 0.0], [-near, 0.0], [0.0, near], [0.0, -near]];
        let in_tile = steps.iter().any(|[du, dv]| {
            self.tiles.contains(&tile_at([(u + du) / edge_mm, (v + dv) / edge_mm]))
        });
        let undecided = in_tile || (self.inverted() && inside < EDGE_PX);
        Some((!undecided).then_some(if self.inverted() { 1.0 } else { 0.0 }))
    }
}

/// The tile of the lattice at a position, in edges.
fn tile_at([x, y]: [f64; 2]) -> Tile {
    let row = y / ROW_HEIGHT;
    let col = x - row / 2.0;
    let anchor = Vertex::new(row.floor() as i32, col.floor() as i32);
    let upright = row - row.floor() + col - col.floor() < 1.0;
    if upright { Tile::upright(anchor) } else { Tile::inverted(anchor) }
}
