//! Verification outside the tiles: every text, check bar, line and logo has its ink, and the sheet has nothing else.
//!
//! The expected outlines come from the same code as the printed ones. This check therefore shows that the sheet has
//! exactly what the description states. The length of check bars is measured independently.

use glam::DVec2;
use rayon::prelude::*;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::document::page::Page;
use crate::finding::any::Finding;
use crate::finding::mark::MarkFinding;
use crate::panel::pattern::EDGE_PX;
use crate::panel::placed::PlacedPanel;
use crate::panel::text_area::BLANK_PX;
use crate::sheet::expected_marks::{Area, Mark, What, discs, marks, of_logo, pixels};
use crate::sheet::ground::{Ground, spots};
use crate::verdict::SheetVerdict;
use deltille_core::polygon;
use deltille_core::raster::{Coverage, Gray};
use deltille_layout::{Logo, SheetLayout};

/// Largest accepted difference between the ink of a printed mark and that of its expected outline, each the mean of
/// 3 × 3 pixels. An edge displaced by 0.02 mm at 300 dpi changes a mean by 0.08, a missing stroke by more than 0.5.
const MAX_MARK_ERROR: f64 = 0.3;

/// Margin around the window of a page that belongs to the window, px: its content is cut off at the rim, through
/// pixels and line widths.
const WINDOW_BLANK_PX: f64 = 3.0;

/// Compares the marks, and searches for unexpected ink. Skips the content of `window` (left, lower, right, upper
/// bound, mm), which is part of a larger sheet.
pub(crate) fn check(
    page: &Page,
    layout: &SheetLayout,
    logo: Option<&Logo>,
    panels: &[PlacedPanel],
    window: Option<[f64; 4]>,
    verdict: &mut SheetVerdict,
) {
    let grounds: Vec<Ground> = panels.iter().map(Ground::new).collect();
    let window = window.map(|window| pixels(page, window, WINDOW_BLANK_PX));
    // The content of the window and of the panels is compared separately.
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
    // A bar with the wrong length has already been reported.
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

/// Bounding rectangle of an outline in the image, and whether it belongs to a letter or a logo.
type Outline = GeomWithData<Rectangle<[f64; 2]>, (Vec<DVec2>, bool)>;

/// The expected marks of a page.
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

    /// Whether an area has exactly the ink of the marks at the pixels where `is_own` is true.
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

    /// Returns the expected ink of the marks in a part of the image.
    fn stated(&self, [x0, y0]: [usize; 2], [width, height]: [usize; 2]) -> Gray<f32> {
        let origin = DVec2::new(x0 as f64, y0 as f64);
        let (first, size) = (origin - 0.5, DVec2::new(width as f64, height as f64));
        let part = AABB::from_corners(first.to_array(), (first + size).to_array());
        let [mut letters, mut strokes] = [0, 1].map(|_| Coverage::new(width, height));
        for outline in self.outlines.locate_in_envelope_intersecting(part) {
            let (polygon, has_holes) = &outline.data;
            let polygon: Vec<DVec2> = polygon.iter().map(|&p| p - origin).collect();
            // The orientation of letter outlines depends on the font; outlines of strokes may cross.
            match has_holes {
                true => letters.add(&polygon, 1.0),
                false => strokes.add(&polygon, polygon::area(&polygon).signum()),
            }
        }
        let (letters, strokes) = (letters.finish(), strokes.finish());
        Gray::from_fn(width, height, |x, y| (letters.at(x, y).abs() + strokes.at(x, y)).min(1.0))
    }
}
