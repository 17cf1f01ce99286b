//! The expected marks of a sheet: outlines in black, and the area that belongs to each.

use std::f64::consts::TAU;

use glam::DVec2;
use kurbo::{Affine, BezPath, PathEl, Point, Rect, Shape as _};

use crate::document::page::Page;
use crate::finding::mark::MarkFinding;
use crate::panel::placed::PlacedPanel;
use crate::panel::text_area::BLANK_PX;
use deltille_core::targets::Corner;
use deltille_layout::artwork;
use deltille_layout::{CHECK_BAR_STROKE_MM, Logo, LogoPlacement, SheetLayout};

/// Maximum length of the pieces in which long marks are compared, mm.
const PIECE_MM: f64 = 20.0;

/// Largest deviation of the line segments that replace curves, mm.
const FLATNESS_MM: f64 = 0.002;

/// Sides of the polygon that is compared with a disc: even for a disc of a metre they deviate from the circle by at
/// most 5 µm.
const DISC_SIDES: u32 = 720;

/// Kind and index of a mark.
#[derive(Clone, Copy)]
pub(super) enum What {
    Text(usize),
    CheckBar(usize),
    Line(usize),
    Logo(usize),
    /// Row and column of the disc on its panel.
    Disc(i32, i32),
}

impl What {
    /// Returns the finding that a mark differs from the layout.
    pub(super) fn differs(self, layout: &SheetLayout) -> MarkFinding {
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

/// A mark outside the panels.
pub(super) struct Mark {
    pub what: What,
    /// Its black outlines, in the page frame, mm.
    pub outlines: Vec<Vec<DVec2>>,
    /// Its area, in pieces.
    pub areas: Vec<Area>,
}

/// A rectangle along a mark, so that a slanted mark claims no more area than an upright one.
pub(super) struct Area {
    /// Map from the page to a frame along the mark.
    along: Affine,
    /// Extent in that frame, mm.
    bounds: Rect,
}

/// Returns the mark of a logo at its position.
pub(super) fn of_logo(logo: &Logo, place: &LogoPlacement, index: usize) -> Mark {
    let along =
        Affine::rotate(-place.angle_rad) * Affine::translate((-place.at_mm.x, -place.at_mm.y));
    let bounds = Rect::new(0.0, 0.0, logo.width() * place.height_mm, place.height_mm);
    let areas = vec![Area { along, bounds }];
    Mark { what: What::Logo(index), outlines: logo.outlines_mm(place), areas }
}

/// Returns all marks of a layout except its logos, and findings for texts that cannot be drawn.
pub(super) fn marks(layout: &SheetLayout) -> (Vec<Mark>, Vec<MarkFinding>) {
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

/// Returns the discs of a panel, as polygons with enough sides to be circles.
pub(super) fn discs(placed: &PlacedPanel) -> Vec<Mark> {
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

/// Converts a path to polygons.
fn polygons(path: &BezPath) -> Vec<Vec<DVec2>> {
    let mut polygons: Vec<Vec<DVec2>> = Vec::new();
    kurbo::flatten(path, FLATNESS_MM, |element| match (element, polygons.last_mut()) {
        (PathEl::MoveTo(p), _) => polygons.push(vec![DVec2::new(p.x, p.y)]),
        (PathEl::LineTo(p), Some(polygon)) => polygon.push(DVec2::new(p.x, p.y)),
        _ => {}
    });
    polygons
}

/// Returns the pieces of the area of a straight mark.
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
    /// Returns the pixel rectangle around the area.
    pub(super) fn pixels(&self, page: &Page) -> [usize; 4] {
        let Rect { x0, y0, x1, y1 } = self.along.inverse().transform_rect_bbox(self.bounds);
        pixels(page, [x0, y0, x1, y1], BLANK_PX)
    }

    /// Whether a pixel belongs to the area or to the margin of `blank_px` around it.
    pub(super) fn contains(&self, page: &Page, x: usize, y: usize, blank_px: f64) -> bool {
        let place = page.page_from_px(DVec2::new(x as f64, y as f64));
        let blank = blank_px / page.px_per_mm;
        self.bounds.inflate(blank, blank).contains(self.along * Point::new(place.x, place.y))
    }

    /// Marks the pixels of the area.
    pub(super) fn cover(&self, page: &Page, known: &mut [bool]) {
        let [x0, y0, x1, y1] = self.pixels(page);
        for y in y0..y1 {
            for x in x0..x1 {
                known[y * page.image.width() + x] |= self.contains(page, x, y, BLANK_PX);
            }
        }
    }
}

/// Returns the pixels of a rectangle of the page (mm), with a margin of `blank` on every side, as left, upper, right
/// and lower bound; right and lower are past the end.
pub(super) fn pixels(page: &Page, [x0, y0, x1, y1]: [f64; 4], blank: f64) -> [usize; 4] {
    let [least, most] = [(x0, y1), (x1, y0)].map(|place| page.px_from_page(place.into()));
    let size = DVec2::new(page.image.width() as f64, page.image.height() as f64);
    let last = ((most + blank).ceil() + 1.0).clamp(DVec2::ZERO, size);
    let first = (least - blank).floor().max(DVec2::ZERO).min(last);
    [first.x, first.y, last.x, last.y].map(|v| v as usize)
}
