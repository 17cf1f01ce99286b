//! Verification outside the tiles: every text, check bar, line and logo has its ink, and there is nothing
//! else on the sheet.
//!
//! The expected outlines come from the same code as the printed ones; so this proves that the sheet
//! has what the description states, and no more. The length of check bars is measured
//! independently.

use std::f64::consts::TAU;

use glam::DVec2;
use kurbo::{Affine, BezPath, PathEl, Point, Rect, Shape};
use rayon::prelude::*;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};
use serde::Serialize;

use super::document::{MAX_INK_ERROR, Page};
use super::tile_table::TileTable;
use super::tiles::{EDGE_PX, PROBES, PlacedPanel};
use super::{Finding, SheetVerdict};
use deltille_core::polygon;
use deltille_core::polygon::rectangle;
use deltille_core::raster::{Coverage, Gray};
use deltille_core::targets::Corner;
use deltille_layout::artwork;
use deltille_layout::{
    CHECK_BAR_STROKE_MM, Label, LineKind, Logo, LogoPlacement, SheetLayout, SheetText,
};

/// Ink of a mark and of its outline, each the mean of 3 × 3 pixels, may differ by this. An edge
/// that lies 0.02 mm off at 300 dpi changes a mean by 0.08, a missing stroke by more than 0.5.
const MAX_MARK_ERROR: f64 = 0.3;

/// White around a mark that belongs to it, px.
const BLANK_PX: f64 = 3.0;

/// Long marks are compared in pieces of at most this length, mm.
const PIECE_MM: f64 = 20.0;

/// Blank around the window of a page that belongs to it, px: what it shows is cut off at its rim,
/// through pixels and through the width of lines.
const WINDOW_BLANK_PX: f64 = 3.0;

/// Most spots of a page that are listed; with more it is dirty all over.
const MOST_SPOTS: usize = 200;

/// Greatest deviation of the line segments that replace curves, mm.
const FLATNESS_MM: f64 = 0.002;

/// Sides of the polygon that is compared with a disc: of a metre they are within 5 µm of a circle.
const DISC_SIDES: u32 = 720;

/// A deviation outside the tiles of a sheet. Lengths in mm in the page frame.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum MarkFinding {
    /// A check bar has another length, or is missing.
    #[error("check bar {bar} {}", measured(*found_mm, *stated_mm))]
    CheckBar {
        /// Which bar, from 1.
        bar: usize,
        /// Measured; `None` when an end was not found.
        found_mm: Option<f64>,
        /// Stated.
        stated_mm: f64,
    },
    /// A check bar of the stated length is drawn otherwise.
    #[error("check bar {bar} differs from the description")]
    CheckBarDiffers {
        /// Which bar, from 1.
        bar: usize,
    },
    /// A text is missing, or differs.
    #[error("label {text} differs from the description")]
    TextDiffers {
        /// Which text of the sheet, from 1.
        text: usize,
        /// The stated text.
        stated: Label,
    },
    /// A logo is missing, or differs.
    #[error("logo {logo} differs from the description")]
    LogoDiffers {
        /// Which logo of the sheet, from 1.
        logo: usize,
    },
    /// A line is missing, or differs.
    #[error("line {line}, to {}, differs from the description", purpose.name())]
    LineDiffers {
        /// Which line of the sheet, from 1.
        line: usize,
        /// Its purpose.
        purpose: LineKind,
    },
    /// A disc is not round, or not solid.
    #[error("circle at row {row} col {col} differs from the description")]
    DiscDiffers {
        /// Lattice row.
        row: i32,
        /// Lattice column.
        col: i32,
    },
    /// Ink, or on a black field a lack of it, outside the tiles, texts, check bars and logos.
    #[error("spot of {area_mm2:.3} mm² at ({:.2}, {:.2}) mm", at_mm.x, at_mm.y)]
    Spot {
        /// The middle of the spot.
        at_mm: DVec2,
        /// Its area, mm².
        area_mm2: f64,
    },
}

impl MarkFinding {
    /// The same finding with its position converted to another frame.
    pub(super) fn moved(self, place: impl Fn(DVec2) -> DVec2) -> Self {
        match self {
            Self::Spot { at_mm, area_mm2 } => Self::Spot { at_mm: place(at_mm), area_mm2 },
            other => other,
        }
    }
}

/// The measurement of a check bar in words.
fn measured(found_mm: Option<f64>, stated_mm: f64) -> String {
    match found_mm {
        Some(found_mm) => format!("measures {found_mm:.3} mm instead of {stated_mm:.3} mm"),
        None => "not found".to_owned(),
    }
}

/// Compares the marks, and looks for ink where none should be. What is in `window`
/// (left, lower, right, upper end, mm), the part of a larger sheet, is left to others.
pub(super) fn check(
    page: &Page,
    (layout, logo): (&SheetLayout, Option<&Logo>),
    panels: &[PlacedPanel],
    window: Option<[f64; 4]>,
    verdict: &mut SheetVerdict,
) {
    let grounds: Vec<Ground> = panels.iter().map(Ground::new).collect();
    let window = window.map(|window| pixels(page, window, WINDOW_BLANK_PX));
    // What the window or a panel shows is compared by itself.
    let is_own = |x: usize, y: usize| {
        let in_window =
            |[x0, y0, x1, y1]: [usize; 4]| (x0..x1).contains(&x) && (y0..y1).contains(&y);
        let at = DVec2::new(x as f64, y as f64);
        let is_beside = |ground: &Ground| ground.expected(page, at, EDGE_PX).is_none();
        let in_tiles = || panels.iter().any(|panel| panel.is_text(at, 0.0));
        !window.is_some_and(in_window) && (grounds.iter().all(is_beside) || in_tiles())
    };
    let (mut marks, mut findings) = marks(layout);
    let logos = layout.logos.iter().enumerate();
    marks.extend(logos.filter_map(|(index, place)| Some(of_logo(logo?, place, index))));
    marks.extend(panels.iter().flat_map(discs));
    let drawn = Drawn::new(page, &marks);
    findings.par_extend(marks.par_iter().filter_map(|mark| {
        let is_right = mark.areas.iter().all(|area| drawn.is_in(area, is_own));
        (!is_right).then(|| mark.what.differs(layout))
    }));
    // A bar of another length has been reported.
    let is_said = |differs: &MarkFinding| {
        let is_same = |found: &Finding| match (found, differs) {
            (
                Finding::Mark(MarkFinding::CheckBar { bar, .. }),
                MarkFinding::CheckBarDiffers { bar: other },
            ) => bar == other,
            _ => false,
        };
        verdict.findings.iter().any(is_same)
    };
    findings.retain(|finding| !is_said(finding));
    verdict.findings.extend(findings.into_iter().map(Finding::from));
    let width = page.image.width();
    let mut known = vec![false; page.image.pixels().len()];
    if let Some([x0, y0, x1, y1]) = window {
        (y0..y1).for_each(|y| known[y * width + x0..y * width + x1].fill(true));
    }
    marks.iter().flat_map(|mark| &mark.areas).for_each(|area| area.cover(page, &mut known));
    verdict.findings.extend(spots(page, &known, panels).into_iter().map(Finding::from));
}

/// Kind and index of a mark.
#[derive(Clone, Copy)]
enum What {
    Text(usize),
    CheckBar(usize),
    Line(usize),
    Logo(usize),
    /// By row and column of its panel.
    Disc(i32, i32),
}

impl What {
    /// The finding that a mark differs from the layout.
    fn differs(self, layout: &SheetLayout) -> MarkFinding {
        match self {
            Self::Text(i) => {
                MarkFinding::TextDiffers { text: i + 1, stated: layout.texts[i].text.clone() }
            }
            Self::CheckBar(i) => MarkFinding::CheckBarDiffers { bar: i + 1 },
            Self::Line(i) => {
                MarkFinding::LineDiffers { line: i + 1, purpose: layout.lines[i].kind }
            }
            Self::Logo(i) => MarkFinding::LogoDiffers { logo: i + 1 },
            Self::Disc(row, col) => MarkFinding::DiscDiffers { row, col },
        }
    }
}

/// A mark beside the panels.
struct Mark {
    what: What,
    /// Its black outlines, in the page frame, mm.
    outlines: Vec<Vec<DVec2>>,
    /// Its area, in pieces.
    areas: Vec<Area>,
}

/// A rectangle along a mark, so that what is slanted claims no more than what is upright.
struct Area {
    /// From the page to a frame along the mark.
    along: Affine,
    /// In that frame, mm.
    bounds: Rect,
}

/// A logo where it lies.
fn of_logo(logo: &Logo, place: &LogoPlacement, index: usize) -> Mark {
    let along =
        Affine::rotate(-place.angle_rad) * Affine::translate((-place.at_mm.x, -place.at_mm.y));
    let bounds = Rect::new(0.0, 0.0, logo.width() * place.height_mm, place.height_mm);
    let areas = vec![Area { along, bounds }];
    Mark { what: What::Logo(index), outlines: logo.outlines_mm(place), areas }
}

/// All marks of a layout but its logos, and findings for texts that cannot be drawn.
fn marks(layout: &SheetLayout) -> (Vec<Mark>, Vec<MarkFinding>) {
    let (mut marks, mut findings) = (Vec::new(), Vec::new());
    for (index, text) in layout.texts.iter().enumerate() {
        match artwork::text_outline(text) {
            Ok(path) if path.is_empty() => {}
            Ok(path) => {
                let along = Affine::rotate(-text.angle_rad);
                let bounds = (along * &path).bounding_box();
                let areas = vec![Area { along, bounds }];
                marks.push(Mark { what: What::Text(index), outlines: polygons(&path), areas });
            }
            Err(_) => findings.push(What::Text(index).differs(layout)),
        }
    }
    for (index, bar) in layout.check_bars.iter().enumerate() {
        let areas = pieces([bar.from_mm, bar.to_mm], CHECK_BAR_STROKE_MM);
        let outlines = polygons(&artwork::check_bar_outline(bar));
        marks.push(Mark { what: What::CheckBar(index), outlines, areas });
    }
    for (index, line) in artwork::drawn_lines(layout) {
        let areas = pieces([line.from_mm, line.to_mm], line.width_mm);
        let stroke = |[from, to]: [DVec2; 2]| {
            let length = from.distance(to).max(f64::MIN_POSITIVE);
            let across = (to - from).perp() / length * line.width_mm / 2.0;
            vec![from + across, from - across, to - across, to + across]
        };
        let outlines = artwork::strokes_mm(line).into_iter().map(stroke).collect();
        marks.push(Mark { what: What::Line(index), outlines, areas });
    }
    (marks, findings)
}

/// The corners of a rectangle around a text, with the blank that belongs to it, px; `None` where it has no ink, or cannot be
/// drawn.
pub(super) fn rectangle_px(page: &Page, text: &SheetText) -> Option<[DVec2; 4]> {
    let path = artwork::text_outline(text).ok().filter(|path| !path.is_empty())?;
    let along = Affine::rotate(-text.angle_rad);
    let blank = BLANK_PX / page.px_per_mm;
    let Rect { x0, y0, x1, y1 } = (along * &path).bounding_box().inflate(blank, blank);
    let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(Point::from);
    Some(corners.map(|corner| {
        let Point { x, y } = along.inverse() * corner;
        page.px_from_page(DVec2::new(x, y))
    }))
}

/// The discs of a panel, each a polygon of so many sides that it is a circle.
fn discs(placed: &PlacedPanel) -> Vec<Mark> {
    let Some(diameter) = placed.panel.discs_mm else { return Vec::new() };
    let radius = diameter / 2.0;
    let disc = |corner: &Corner| {
        let middle = placed.page_from_panel(corner.panel_mm);
        let angles = (0..DISC_SIDES).map(|n| f64::from(n) * TAU / f64::from(DISC_SIDES));
        let outline = angles.map(|angle| middle + radius * DVec2::from_angle(angle)).collect();
        let bounds = Rect::from_center_size((middle.x, middle.y), (diameter, diameter));
        Mark {
            what: What::Disc(corner.row, corner.col),
            outlines: vec![outline],
            areas: vec![Area { along: Affine::IDENTITY, bounds }],
        }
    };
    placed.panel.corners.iter().map(disc).collect()
}

/// A path as polygons.
fn polygons(path: &BezPath) -> Vec<Vec<DVec2>> {
    let mut polygons: Vec<Vec<DVec2>> = Vec::new();
    kurbo::flatten(path, FLATNESS_MM, |element| match (element, polygons.last_mut()) {
        (PathEl::MoveTo(p), _) => polygons.push(vec![DVec2::new(p.x, p.y)]),
        (PathEl::LineTo(p), Some(polygon)) => polygon.push(DVec2::new(p.x, p.y)),
        _ => {}
    });
    polygons
}

/// Pieces of the area of a straight mark.
fn pieces([from, to]: [DVec2; 2], width_mm: f64) -> Vec<Area> {
    let length = from.distance(to);
    let along = Affine::rotate(-(to - from).to_angle()) * Affine::translate((-from.x, -from.y));
    let count = (length / PIECE_MM).ceil().max(1.0);
    let piece = |n: usize| {
        let [start, end] = [n, n + 1].map(|n| n as f64 / count * length);
        Area { along, bounds: Rect::new(start, -width_mm / 2.0, end, width_mm / 2.0) }
    };
    (0..count as usize).map(piece).collect()
}

impl Area {
    /// The rectangle of pixels around it.
    fn pixels(&self, page: &Page) -> [usize; 4] {
        let Rect { x0, y0, x1, y1 } = self.along.inverse().transform_rect_bbox(self.bounds);
        pixels(page, [x0, y0, x1, y1], BLANK_PX)
    }

    /// Whether a pixel belongs to it, with `blank` around.
    fn contains(&self, page: &Page, x: usize, y: usize, blank_px: f64) -> bool {
        let place = page.page_from_px(DVec2::new(x as f64, y as f64));
        let blank = blank_px / page.px_per_mm;
        self.bounds.inflate(blank, blank).contains(self.along * Point::new(place.x, place.y))
    }

    /// Marks its pixels.
    fn cover(&self, page: &Page, known: &mut [bool]) {
        let [x0, y0, x1, y1] = self.pixels(page);
        for y in y0..y1 {
            for x in x0..x1 {
                known[y * page.image.width() + x] |= self.contains(page, x, y, BLANK_PX);
            }
        }
    }
}

/// An outline in the picture, by the rectangle around it, and whether it is of a letter or a logo.
type Outline = GeomWithData<Rectangle<[f64; 2]>, (Vec<DVec2>, bool)>;

/// The marks that a page should show.
struct Drawn<'a> {
    page: &'a Page,
    outlines: RTree<Outline>,
}

impl<'a> Drawn<'a> {
    fn new(page: &'a Page, marks: &[Mark]) -> Self {
        let of_mark = |mark: &Mark| {
            let has_holes = matches!(mark.what, What::Text(_) | What::Logo(_));
            let of = move |polygon: &Vec<DVec2>| {
                let polygon: Vec<DVec2> = polygon.iter().map(|&p| page.px_from_page(p)).collect();
                let end = |of: fn(DVec2, DVec2) -> DVec2| polygon.iter().copied().reduce(of);
                let (least, most) = (end(DVec2::min)?, end(DVec2::max)?);
                let around = Rectangle::from_corners(least.to_array(), most.to_array());
                Some(GeomWithData::new(around, (polygon, has_holes)))
            };
            mark.outlines.iter().filter_map(of).collect::<Vec<_>>()
        };
        Self { page, outlines: RTree::bulk_load(marks.iter().flat_map(of_mark).collect()) }
    }

    /// Whether an area has the ink of the marks, and no other, where it `is_own`.
    fn is_in(&self, area: &Area, is_own: impl Fn(usize, usize) -> bool) -> bool {
        let page = self.page;
        let [x0, y0, x1, y1] = area.pixels(page);
        let (width, height) = (x1 - x0, y1 - y0);
        let stated = self.stated([x0, y0], [width, height]);
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
                (mean(&stated, x, y) - mean(&found, x, y)).abs() <= MAX_MARK_ERROR
                    || !area.contains(page, x0 + x, y0 + y, BLANK_PX - 1.0)
                    || !is_own(x0 + x, y0 + y)
            })
        })
    }

    /// The ink of the marks in a part of the picture.
    fn stated(&self, [x0, y0]: [usize; 2], [width, height]: [usize; 2]) -> Gray<f32> {
        let origin = DVec2::new(x0 as f64, y0 as f64);
        let (first, size) = (origin - 0.5, DVec2::new(width as f64, height as f64));
        let part = AABB::from_corners(first.to_array(), (first + size).to_array());
        let [mut letters, mut strokes] = [0, 1].map(|_| Coverage::new(width, height));
        for outline in self.outlines.locate_in_envelope_intersecting(part) {
            let (polygon, has_holes) = &outline.data;
            let polygon: Vec<DVec2> = polygon.iter().map(|&p| p - origin).collect();
            // Which way outlines of letters run is the font's business; those of strokes cross each other.
            match has_holes {
                true => letters.add(&polygon, 1.0),
                false => strokes.add(&polygon, polygon::area(&polygon).signum()),
            }
        }
        let (letters, strokes) = (letters.finish(), strokes.finish());
        Gray::from_fn(width, height, |x, y| (letters.at(x, y).abs() + strokes.at(x, y)).min(1.0))
    }
}

/// The pixels of a rectangle of the page (mm) with `blank` more on every side: first and
/// past-the-end column and row, as left, upper, right, lower.
fn pixels(page: &Page, [x0, y0, x1, y1]: [f64; 4], blank: f64) -> [usize; 4] {
    let [least, most] = [(x0, y1), (x1, y0)].map(|place| page.px_from_page(place.into()));
    let size = DVec2::new(page.image.width() as f64, page.image.height() as f64);
    let last = ((most + blank).ceil() + 1.0).clamp(DVec2::ZERO, size);
    let first = (least - blank).floor().max(DVec2::ZERO).min(last);
    [first.x, first.y, last.x, last.y].map(|v| v as usize)
}

/// Names each connected spot of wrong pixels outside the tiles and the `known` marks.
pub(super) fn spots(page: &Page, known: &[bool], panels: &[PlacedPanel]) -> Vec<MarkFinding> {
    let (width, height) = (page.image.width(), page.image.height());
    let grounds: Vec<Ground> = panels.iter().map(Ground::new).collect();
    let is_inverted = grounds.iter().any(Ground::inverted);
    let mut wrong = vec![false; width * height];
    wrong.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, (wrong, &pixel)) in row.iter_mut().zip(page.image.row(y)).enumerate() {
            let ink = 1.0 - f64::from(pixel) / 255.0;
            // White is right wherever no inverted panel is; most of the sheet is done here.
            let plain = ink <= MAX_INK_ERROR && !is_inverted;
            if plain || known[y * width + x] {
                continue;
            }
            let pixel = DVec2::new(x as f64, y as f64);
            // Most of what is black is in tiles, which are compared by themselves.
            if grounds.iter().any(|ground| ground.has_tile_at(page, pixel)) {
                continue;
            }
            // Where this far from edges.
            let is_off = |most: f64, near_px: f64| {
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

/// Names each connected spot of wrong pixels of a page.
pub(super) fn named(page: &Page, mut wrong: Vec<bool>) -> Vec<MarkFinding> {
    let (width, height) = (page.image.width(), page.image.height());
    let mut spots = Vec::new();
    for start in 0..wrong.len() {
        if spots.len() == MOST_SPOTS {
            break;
        }
        if !std::mem::take(&mut wrong[start]) {
            continue;
        }
        let (mut stack, mut count, mut moment) = (vec![start], 0.0, DVec2::ZERO);
        while let Some(at) = stack.pop() {
            let (x, y) = (at % width, at / width);
            count += 1.0;
            moment += DVec2::new(x as f64, y as f64);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    if std::mem::take(&mut wrong[y * width + x]) {
                        stack.push(y * width + x);
                    }
                }
            }
        }
        let at_mm = page.page_from_px(moment / count);
        spots.push(MarkFinding::Spot { at_mm, area_mm2: count / page.px_per_mm.powi(2) });
    }
    spots
}

/// The area of a panel on its page.
struct Ground<'a> {
    placed: &'a PlacedPanel<'a>,
    tiles: TileTable<()>,
    /// Directions in which tiles are looked for beside a pixel: fine enough that no tip of a tile, also a lone
    /// one, slips between two.
    probes: Vec<DVec2>,
    /// Outline of the tiles, or of the black field of an inverted panel, counter-clockwise: from where each side begins, and
    /// which way is inwards, mm.
    field: Vec<[DVec2; 2]>,
    /// Where on the picture that may be: left, upper, right, lower end, px.
    around_px: [f64; 4],
}

impl<'a> Ground<'a> {
    fn new(placed: &'a PlacedPanel<'a>) -> Self {
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

    /// Whether a pixel is on the picture where the panel may be.
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

    /// What a pixel of the panel's area should be; `Some(None)` in and beside the tiles, which are
    /// compared by themselves, and at the edge of the field, `near_px` to either side. Between the tiles of a panel
    /// that is not inverted there may be another one.
    fn expected(&self, page: &Page, pixel: DVec2, near_px: f64) -> Option<Option<f64>> {
        if !self.is_around(pixel) {
            return None;
        }
        let place = self.placed.panel_from_page(page.page_from_px(pixel));
        let depths = self.field.iter().map(|[from, inwards]| (place - from).dot(*inwards));
        let inside = depths.fold(f64::INFINITY, f64::min) * page.px_per_mm;
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
