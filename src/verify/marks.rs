//! What lies outside the tiles: every text has its ink, and nothing else is on the sheet.
//!
//! The letters are those of the built-in font, so that their outlines come from the same place as
//! those printed; what is proved is that the sheet has the words of the description.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use kurbo::{Affine, BezPath, PathEl, Point, Rect, Shape};
use rayon::prelude::*;

use super::document::Page;
use super::tiles::{EDGE_PX, PROBES, PlacedPanel};
use super::{Finding, SheetVerdict};
use crate::artwork;
use crate::lattice::Tile;
use crate::raster::{Coverage, Gray};
use crate::target::{CHECK_BAR_STROKE_MM, SheetLayout, SheetLine, SheetText};

/// Ink of a text and of its outline, each the mean of 3 × 3 pixels, may differ by this. An edge
/// that lies 0.02 mm off at 300 dpi changes a mean by 0.08, a missing stroke by more than 0.5.
const MAX_TEXT_ERROR: f64 = 0.3;

/// White around a text that belongs to it, px.
const TEXT_BLANK_PX: f64 = 3.0;

/// Beyond the ends and strokes of a check bar nothing is called a spot, mm: what is wrong with a
/// bar, its measurement tells.
const BAR_BLANK_MM: f64 = 0.3;

/// Least ink of a line, relative to what its width lets a pixel have at most.
const LEAST_LINE_INK: f64 = 0.3;

/// So near to the ends of a stroke its ink is not looked at, px.
const LINE_END_PX: f64 = 1.5;

/// Blank around the window of a page that belongs to it, px: what it shows is cut off at its rim,
/// through pixels and through the width of lines.
const WINDOW_BLANK_PX: f64 = 3.0;

/// More spots of a page are not listed: it is dirty all over.
const MOST_SPOTS: usize = 200;

/// How finely curves are turned into lines, mm.
const FLATNESS_MM: f64 = 0.002;

/// Compares the texts and lines, and looks for ink where none should be. What is in `window`
/// (left, lower, right, upper end, mm), the part of a larger sheet, is left to others.
pub(super) fn check(
    page: &Page,
    layout: &SheetLayout,
    panels: &[PlacedPanel],
    window: Option<[f64; 4]>,
    verdict: &mut SheetVerdict,
) {
    let (width, height) = (page.image.width(), page.image.height());
    let mut known = vec![false; width * height];
    for (index, text) in layout.texts.iter().enumerate() {
        let words = Words::new(text);
        if words.as_ref().is_none_or(|words| !words.has_ink(page)) {
            let SheetText { text, .. } = text;
            verdict.findings.push(Finding::TextDiffers { text: index + 1, stated: text.clone() });
        }
        words.iter().for_each(|words| words.cover(page, &mut known));
    }
    let mut cover = |[x0, y0, x1, y1]: [usize; 4]| {
        (y0..y1).for_each(|y| known[y * width + x0..y * width + x1].fill(true));
    };
    for bar in &layout.check_bars {
        let blank = (CHECK_BAR_STROKE_MM / 2.0 + BAR_BLANK_MM) * page.px_per_mm;
        cover(pixels(page, spanned(bar.from_mm, bar.to_mm), blank));
    }
    for (index, line) in layout.lines.iter().enumerate() {
        if !has_strokes(page, line) {
            let finding = Finding::LineDiffers { line: index + 1, purpose: line.kind };
            verdict.findings.push(finding);
        }
        let blank = (line.width_mm / 2.0 + BAR_BLANK_MM) * page.px_per_mm;
        let length_px = distance(line.from_mm, line.to_mm) * page.px_per_mm;
        let steps = length_px.ceil().max(1.0) as usize;
        for n in 0..=steps {
            let at = between(line.from_mm, line.to_mm, n as f64 / steps as f64);
            cover(pixels(page, spanned(at, at), blank));
        }
    }
    window.into_iter().for_each(|window| cover(pixels(page, window, WINDOW_BLANK_PX)));
    verdict.findings.extend(spots(page, &known, panels));
}

/// Whether a line is there: ink along its strokes, and none between them.
fn has_strokes(page: &Page, line: &SheetLine) -> bool {
    let strokes = artwork::strokes_mm(line);
    let across = {
        let length = distance(line.from_mm, line.to_mm);
        [0, 1]
            .map(|i| [line.from_mm[1] - line.to_mm[1], line.to_mm[0] - line.from_mm[0]][i] / length)
    };
    // A hairline lies between pixels: its ink is that of the darkest place across it.
    let ink = |at: [f64; 2]| {
        let [x, y] = page.px_from_page(at);
        let offsets = [-1.0, -0.5, 0.0, 0.5, 1.0];
        offsets
            .map(|d| page.ink([x + d * across[0], y - d * across[1]]))
            .into_iter()
            .fold(0.0, f64::max)
    };
    let full = (line.width_mm * page.px_per_mm).min(1.0);
    let inked = |[from, to]: &[[f64; 2]; 2]| {
        // The ends blur over a pixel.
        let length_px = distance(*from, *to) * page.px_per_mm;
        let margin = (LINE_END_PX / length_px).min(0.5);
        let steps = (length_px / 2.0).ceil().max(1.0) as usize;
        (0..=steps).all(|n| {
            let part = margin + (1.0 - 2.0 * margin) * n as f64 / steps as f64;
            ink(between(*from, *to, part)) > LEAST_LINE_INK * full
        })
    };
    strokes.iter().all(inked)
        && strokes.windows(2).all(|pair| {
            let gap_px = distance(pair[0][1], pair[1][0]) * page.px_per_mm;
            gap_px < 2.0 * LINE_END_PX
                || ink(between(pair[0][1], pair[1][0], 0.5)) < LEAST_LINE_INK * full
        })
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The point at a part of the way from a to b.
fn between(a: [f64; 2], b: [f64; 2], part: f64) -> [f64; 2] {
    [0, 1].map(|i| a[i] + (b[i] - a[i]) * part)
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

/// The outline of a text and the area that belongs to it: its bounds along its own base line, so
/// that a slanted text claims no more than an upright one.
struct Words {
    path: BezPath,
    /// From the page to a frame along the base line.
    along: Affine,
    /// Bounds in that frame, mm.
    bounds: Rect,
}

impl Words {
    /// `None` where the built-in font lacks a letter.
    fn new(text: &SheetText) -> Option<Self> {
        let path = artwork::text_outline(text).ok()?;
        let along = Affine::rotate(-text.angle_rad);
        let bounds = (along * &path).bounding_box();
        Some(Self { path, along, bounds })
    }

    /// The rectangle of pixels around all of it.
    fn pixels(&self, page: &Page) -> [usize; 4] {
        let bounds = self.path.bounding_box();
        pixels(page, [bounds.x0, bounds.y0, bounds.x1, bounds.y1], TEXT_BLANK_PX)
    }

    /// Whether a pixel belongs to it, with `blank` around.
    fn contains(&self, page: &Page, x: usize, y: usize, blank_px: f64) -> bool {
        let [x, y] = page.page_from_px([x as f64, y as f64]);
        let blank = blank_px / page.px_per_mm;
        self.bounds.inflate(blank, blank).contains(self.along * Point::new(x, y))
    }

    /// Marks its pixels.
    fn cover(&self, page: &Page, known: &mut [bool]) {
        if self.path.is_empty() {
            return;
        }
        let [x0, y0, x1, y1] = self.pixels(page);
        for y in y0..y1 {
            for x in x0..x1 {
                known[y * page.image.width() + x] |= self.contains(page, x, y, TEXT_BLANK_PX);
            }
        }
    }

    /// Whether its area has the ink of its outline, and no other.
    fn has_ink(&self, page: &Page) -> bool {
        if self.path.is_empty() {
            return true;
        }
        let [x0, y0, x1, y1] = self.pixels(page);
        let (width, height) = (x1 - x0, y1 - y0);
        let mut coverage = Coverage::new(width, height);
        let mut polygon: Vec<[f64; 2]> = Vec::new();
        kurbo::flatten(&self.path, FLATNESS_MM, |element| match element {
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
        let found = Gray::from_fn(width, height, |x, y| {
            1.0 - f32::from(page.image.at(x0 + x, y0 + y)) / 255.0
        });
        let mean = |image: &Gray<f32>, x: usize, y: usize| {
            let rows = (y - 1..=y + 1).map(|y| image.row(y)[x - 1..=x + 1].iter().sum::<f32>());
            f64::from(rows.sum::<f32>()) / 9.0
        };
        let inside = |n: usize| 1..n.saturating_sub(1);
        inside(height).all(|y| {
            inside(width).all(|x| {
                !self.contains(page, x0 + x, y0 + y, TEXT_BLANK_PX - 1.0)
                    || (mean(&stated, x, y) - mean(&found, x, y)).abs() <= MAX_TEXT_ERROR
            })
        })
    }
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
            let plain =
                ink <= page.max_ink_error && grounds.iter().all(|ground| !ground.inverted());
            *wrong = !plain
                && !known[y * width + x]
                && grounds
                    .iter()
                    .find_map(|ground| ground.expected(page, at))
                    .unwrap_or(Some(0.0))
                    .is_some_and(|expected| (ink - expected).abs() > page.max_ink_error);
        }
    });
    let mut spots = Vec::new();
    for start in 0..wrong.len() {
        if spots.len() == MOST_SPOTS {
            break;
        }
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
    /// Where on the picture that may be: left, upper, right, lower end, px.
    around_px: [f64; 4],
}

impl<'a> Ground<'a> {
    fn new(placed: &'a PlacedPanel<'a>) -> Self {
        let panel = placed.panel;
        let field = if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
        let [left, lower, right, upper] = field;
        let ends = [[left, lower], [right, lower], [right, upper], [left, upper]];
        let ends = ends.map(|p| placed.page.px_from_page(placed.page_from_panel(p)));
        let most = |i: usize, sign: f64| {
            ends.map(|p| sign * p[i]).into_iter().fold(f64::MIN, f64::max) + 2.0 * EDGE_PX
        };
        let around_px = [-most(0, -1.0), -most(1, -1.0), most(0, 1.0), most(1, 1.0)];
        Self { placed, tiles: panel.tiles(), field, around_px }
    }

    fn inverted(&self) -> bool {
        self.placed.panel.inverted
    }

    /// What a pixel of the panel's area should be; `Some(None)` in and beside the tiles, which are
    /// compared by themselves, and at the edge of the field. Between the tiles of a panel that is
    /// not inverted there may be another one.
    fn expected(&self, page: &Page, [x, y]: [f64; 2]) -> Option<Option<f64>> {
        let [left, upper, right, lower] = self.around_px;
        if x < left || x > right || y < upper || y > lower {
            return None;
        }
        let [u, v] = self.placed.panel_from_page(page.page_from_px([x, y]));
        let [left, lower, right, upper] = self.field;
        let inside = (u - left).min(right - u).min(v - lower).min(upper - v) * page.px_per_mm;
        if inside < -EDGE_PX {
            return None;
        }
        let edge_mm = self.placed.panel.edge_mm;
        let near = EDGE_PX / page.px_per_mm;
        let reaches = |[du, dv]: [f64; 2]| {
            let at = [(u + du) / edge_mm, (v + dv) / edge_mm];
            self.tiles.contains(&self.placed.panel.kind.tile_at(at))
        };
        // Fine enough that no tip of a tile, also a lone one, slips between two directions.
        let around = (0..PROBES).map(|n| f64::from(n) * TAU / f64::from(PROBES));
        let in_tile = reaches([0.0, 0.0])
            || around.into_iter().any(|angle| reaches([near * angle.cos(), near * angle.sin()]));
        let undecided = in_tile || (self.inverted() && inside < EDGE_PX);
        if undecided { Some(None) } else { self.inverted().then_some(Some(1.0)) }
    }
}
