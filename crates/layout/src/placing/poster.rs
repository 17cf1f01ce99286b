//! A net or a board larger than the paper, printed over several pages.
//!
//! ```text
//!   1─────┬┬────┐2      The sheet is as large as the windows of all pages together. Neighbouring
//!   │     ││    │       windows overlap; crosses in the overlap are printed on both pages. Pages
//!   ├─────┼┼────┤ ×     are numbered row by row from the upper left. Windows that would show
//!   ├─────┼┼────┤       nothing are not printed. A page with a left or upper neighbour has a trim
//!   3─────┴┴────┘4      line on that side. Ticks on the neighbour mark the position of the
//!                       trimmed edge.
//! ```

use glam::DVec2;

use super::arrangement::{Arrangement, Footprint, fit_upright};
use super::margin_marks::ADVANCE_CAPS;
use super::net::plane::{Motion, gap_mm};
use crate::paper::{Orientation, PaperSize, PaperSpec};
use crate::{Label, LineKind, SheetLayout, SheetLine, SheetPage, SheetText};
use deltille_core::angles::direction;
use deltille_core::polygon::{bounds, rectangle};
use deltille_core::setting::Setting;
use deltille_core::targets::TargetError;

/// Width of the overlap of neighbouring windows, mm.
const OVERLAP_MM: f64 = 10.0;

/// Blank border around the print on its sheet, mm.
const BORDER_MM: f64 = 3.0;

/// Gap between the window and the marks of the page, mm.
const BLANK_MM: f64 = 1.5;

/// Height of the text between window and check bar, mm; the overview beside it has the same height.
const WORDS_MM: f64 = 13.0;

/// Smallest window, mm: a smaller one would consist mostly of overlap.
const MIN_WINDOW_MM: f64 = 40.0;

/// Maximum number of pages of a sheet or a net: an afternoon's work.
pub(crate) const MAX_PAGES: usize = 120;

/// Largest sheet, mm²: images of it that still resolve its hairlines can be verified.
const MAX_AREA_MM2: f64 = 4e6;

/// Length of an arm of a cross, and the gap around it, mm: a cross fits in a slanted margin of 5 mm.
const CROSS_MM: (f64, f64) = (1.3, 0.35);

/// Step between candidate positions of crosses, mm: less than the spare space in such a margin.
const CROSS_STEP_MM: f64 = 0.5;

/// Width of the lines of crosses and of the overview, mm.
const LINE_MM: f64 = 0.15;

/// Distance of the trim line from the window, mm: the remaining paper hides nothing.
const TRIM_MM: f64 = 0.3;

/// Length of a tick, mm.
pub(crate) const TICK_MM: f64 = 2.0;

/// Width of the frame around the page's own window in the overview, mm.
const FRAME_MM: f64 = 0.5;

/// Capital height of the name of the page, mm.
const NAME_CAP_MM: f64 = 6.0;

/// Layout of a net or a board over several pages.
pub(crate) struct Poster {
    /// A page without its window.
    page: Arrangement,
    /// The window on the page: left, lower, right, upper end, mm.
    window_mm: [f64; 4],
    /// Columns and rows of windows.
    counts: [usize; 2],
    sheet_from_points: Motion,
}

impl Poster {
    /// Returns the layout with the fewest windows that shows all points, on A0 unless a paper size is given.
    pub(crate) fn new(points: &[DVec2], paper: &PaperSpec) -> Result<Self, TargetError> {
        let size = Self::paper_size(paper);
        let orientations = match paper.orientation {
            Orientation::Auto => vec![Orientation::Portrait, Orientation::Landscape],
            one => vec![one],
        };
        let mut best: Option<Self> = None;
        for orientation in orientations {
            let paper = PaperSpec { size: Some(size.clone()), orientation, ..paper.clone() };
            let least = Footprint {
                width: MIN_WINDOW_MM,
                height: MIN_WINDOW_MM + WORDS_MM,
                edge_blank: paper.margin_mm,
                mark_blank: 2.0 * BLANK_MM,
                is_centred: false,
            };
            let Some(page) = fit_upright(&least, &paper)? else { continue };
            for angle in [0.0, std::f64::consts::FRAC_PI_2] {
                let poster = Self::on(&page, Motion::turning(angle), points);
                if best.as_ref().is_none_or(|best| poster.windows() < best.windows()) {
                    best = Some(poster);
                }
            }
        }
        best.ok_or_else(|| {
            let problem =
                format!("{size} is too small for the pages of a larger sheet: use larger paper");
            TargetError::invalid(Setting::PaperSize, problem)
        })
    }

    /// Returns the paper of its pages: the largest allowed size.
    fn paper_size(paper: &PaperSpec) -> PaperSize {
        paper.sizes().pop().expect("at least one size is allowed")
    }

    fn on(page: &Arrangement, turn: Motion, points: &[DVec2]) -> Self {
        let [left, lower, right, upper] = page.clear_mm();
        let trim = 2.0 * TRIM_MM;
        let window_mm = [left + trim, lower + BLANK_MM + WORDS_MM, right - BLANK_MM, upper - trim];
        let window = DVec2::new(window_mm[2] - window_mm[0], window_mm[3] - window_mm[1]);
        let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
        let [x0, y0, x1, y1] = bounds(&turned);
        let count = |size: f64, window: f64| {
            let beyond = (size + 2.0 * BORDER_MM - OVERLAP_MM) / (window - OVERLAP_MM);
            beyond.ceil().max(1.0) as usize
        };
        let counts = [count(x1 - x0, window.x), count(y1 - y0, window.y)];
        let mut poster = Self { page: *page, window_mm, counts, sheet_from_points: turn };
        // The points lie in the middle of the sheet.
        let middle = DVec2::new(x0 + x1, y0 + y1) / 2.0;
        poster.sheet_from_points.shift = poster.size_mm() / 2.0 - middle;
        poster
    }

    /// Returns the number of windows, including empty ones.
    fn windows(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    /// Rejects more pages, or a larger sheet, than can be assembled and verified. `what` has edges of `edge_mm`, given
    /// by `setting`. The error proposes an edge that would fit, or the setting `instead`.
    pub(crate) fn check(
        &self,
        what: &str,
        setting: Setting,
        edge_mm: f64,
        instead: Option<Setting>,
        paper: &PaperSpec,
    ) -> Result<(), TargetError> {
        let area = self.size_mm().element_product();
        let excess = (area / MAX_AREA_MM2).max(self.windows() as f64 / MAX_PAGES as f64);
        if excess <= 1.0 {
            return Ok(());
        }
        let edge = (edge_mm / excess.sqrt() * 0.95).floor();
        let instead = instead.map_or(String::new(), |instead| format!("{instead}, "));
        let problem = format!(
            "{what} takes {} pages of {}, more than can be assembled and verified: use {instead}{setting} of at most \
             {edge} mm, or a larger {}",
            self.windows(),
            Self::paper_size(paper),
            Setting::PaperSize
        );
        Err(TargetError::invalid(setting, problem))
    }

    /// Returns the transform from the points to the sheet.
    pub(crate) fn sheet_from_points(&self) -> Motion {
        self.sheet_from_points
    }

    /// Returns the empty sheet.
    pub(crate) fn sheet(&self) -> SheetLayout {
        let DVec2 { x: width_mm, y: height_mm } = self.size_mm();
        SheetLayout {
            width_mm,
            height_mm,
            placements: Vec::new(),
            check_bars: Vec::new(),
            lines: Vec::new(),
            texts: Vec::new(),
            logos: Vec::new(),
            pages: Vec::new(),
        }
    }

    fn window_size(&self) -> DVec2 {
        let [left, lower, right, upper] = self.window_mm;
        DVec2::new(right - left, upper - lower)
    }

    /// Returns the width and height of the sheet, mm.
    fn size_mm(&self) -> DVec2 {
        let [columns, rows] = self.counts.map(|count| count as f64);
        (self.window_size() - OVERLAP_MM) * DVec2::new(columns, rows) + OVERLAP_MM
    }

    /// Returns the window in a column and a row (from the top) on the sheet: left, lower, right, upper.
    fn window_on_sheet(&self, column: usize, row: usize) -> [f64; 4] {
        let window = self.window_size();
        let left = (window.x - OVERLAP_MM) * column as f64;
        let upper = self.size_mm().y - (window.y - OVERLAP_MM) * row as f64;
        [left, upper - window.y, left + window.x, upper]
    }

    /// Adds crosses and pages to a sheet that is otherwise complete.
    ///
    /// `areas` are convex polygons of the sheet that no cross may overlap, in addition to its lines and texts. Every
    /// page shows a small `overview`, the `label` in small type, and its number in large type, prefixed with `of`.
    /// `words` lays out the instructions from a position, within a given width.
    pub(crate) fn add_pages(
        &self,
        sheet: &mut SheetLayout,
        areas: Vec<Vec<DVec2>>,
        overview: &[SheetLine],
        label: &str,
        of: &str,
        words: impl Fn(DVec2, f64) -> Vec<SheetText>,
    ) {
        let mut obstacles = obstacles(sheet, areas);
        let [columns, rows] = self.counts;
        let shown: Vec<(usize, usize)> = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .filter(|&(column, row)| {
                let window = rectangle(self.window_on_sheet(column, row));
                obstacles.iter().any(|polygon| gap_mm(polygon, &window) < 0.0)
            })
            .collect();
        let mut overlaps = Vec::new();
        for &(column, row) in &shown {
            for next in [(column + 1, row), (column, row + 1)] {
                if shown.contains(&next) {
                    let a = self.window_on_sheet(column, row);
                    let b = self.window_on_sheet(next.0, next.1);
                    let shared = [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])];
                    sheet.lines.extend(crosses(shared, &obstacles));
                    overlaps.push((shared, next.0 > column));
                }
            }
        }
        obstacles.extend(sheet.lines.iter().map(|line| vec![line.from_mm, line.to_mm]));
        for (shared, is_left) in overlaps {
            let ticks = ticks(shared, is_left, &obstacles);
            obstacles.extend(ticks.iter().map(|tick| vec![tick.from_mm, tick.to_mm]));
            sheet.lines.extend(ticks);
        }
        let pages = shown.iter().enumerate().map(|(index, &(column, row))| {
            let [left, lower, ..] = self.window_mm;
            let window = self.window_on_sheet(column, row);
            let name = format!("{} of {}", index + 1, shown.len());
            let mut marks = self.page.sheet(0, [0.0; 4], format!("{label} · page {name}"));
            let name = format!("{of}{name}");
            marks.placements.clear();
            let number_of = |beside: Option<(usize, usize)>| {
                let index = shown.iter().position(|&at| Some(at) == beside)?;
                Some(index + 1)
            };
            let before = number_of(column.checked_sub(1).map(|column| (column, row)));
            let above = number_of(row.checked_sub(1).map(|row| (column, row)));
            self.explain(&mut marks, name, joining(before, above), &words);
            self.draw_overview(&mut marks, overview, window);
            marks.lines.extend(self.trims(before.is_some(), above.is_some()));
            SheetPage {
                label: (index + 1).to_string(),
                window_mm: self.window_mm,
                sheet_at_mm: DVec2::new(left - window[0], lower - window[1]),
                marks,
            }
        });
        sheet.pages = pages.collect();
    }

    /// Returns the trim lines of a page, on the sides where it has a left or upper neighbour.
    fn trims(&self, left: bool, above: bool) -> impl Iterator<Item = SheetLine> {
        let [x0, y0, x1, y1] = self.window_mm;
        let (x, y) = (x0 - TRIM_MM, y1 + TRIM_MM);
        let upright = left.then_some([DVec2::new(x, y0), DVec2::new(x, y)]);
        let level = above.then_some([DVec2::new(x, y), DVec2::new(x1, y)]);
        upright.into_iter().chain(level).map(|[from_mm, to_mm]| SheetLine {
            kind: LineKind::Align,
            from_mm,
            to_mm,
            width_mm: LINE_MM,
        })
    }

    /// Returns the size of the overview, mm, and its scale.
    fn overview(&self) -> (DVec2, f64) {
        let size = self.size_mm();
        let high = WORDS_MM - 2.0 * BLANK_MM;
        let scale = (high / size.y).min(0.25 * self.window_size().x / size.x);
        (size * scale, scale)
    }

    /// Adds the name of the page and its instructions.
    fn explain(
        &self,
        marks: &mut SheetLayout,
        name: String,
        joining: String,
        words: impl Fn(DVec2, f64) -> Vec<SheetText>,
    ) {
        let [left, lower, right, _] = self.page.clear_mm();
        let at = lower + BLANK_MM;
        let (overview, _) = self.overview();
        let width = name.chars().count() as f64 * ADVANCE_CAPS * NAME_CAP_MM;
        let start = left + width + 3.0;
        let room = right - overview.x - 3.0 * BLANK_MM - start;
        let text = |text: String, at: (f64, f64), cap_height_mm, max_width_mm| SheetText {
            text: Label::Words(text),
            at_mm: at.into(),
            angle_rad: 0.0,
            cap_height_mm,
            max_width_mm,
        };
        let middle = at + (WORDS_MM - 2.0 * BLANK_MM - NAME_CAP_MM) / 2.0;
        marks.texts.push(text(name, (left, middle), NAME_CAP_MM, width));
        let words = words(DVec2::new(start, at), room);
        let above = at + words.len() as f64 * 3.6;
        marks.texts.extend(words);
        marks.texts.push(text(joining, (start, above), 2.2, room));
    }

    /// Draws a small overview of the sheet, with the window of the page framed.
    fn draw_overview(&self, marks: &mut SheetLayout, lines: &[SheetLine], window: [f64; 4]) {
        let [_, lower, right, _] = self.page.clear_mm();
        let (size, scale) = self.overview();
        let origin = DVec2::new(right - BLANK_MM - size.x, lower + BLANK_MM);
        let place = |p: DVec2| origin + p * scale;
        let small = |line: &SheetLine| SheetLine {
            kind: LineKind::Align,
            from_mm: place(line.from_mm),
            to_mm: place(line.to_mm),
            width_mm: LINE_MM,
        };
        marks.lines.extend(lines.iter().map(small));
        let frame = rectangle(window);
        marks.lines.extend((0..4).map(|i| SheetLine {
            width_mm: FRAME_MM,
            ..small(&SheetLine {
                kind: LineKind::Align,
                from_mm: frame[i],
                to_mm: frame[(i + 1) % 4],
                width_mm: FRAME_MM,
            })
        }));
    }
}

/// Returns the instructions for a page that has pages with these numbers on its left and above.
fn joining(left: Option<usize>, above: Option<usize>) -> String {
    let (line, pages) = match (left, above) {
        (None, None) => return "Start with this page; glue the next ones onto it.".to_owned(),
        (Some(left), None) => ("the line on the left", format!("page {left}")),
        (None, Some(above)) => ("the line above", format!("page {above}")),
        (Some(left), Some(above)) => {
            ("the lines on the left and above", format!("pages {left} and {above}"))
        }
    };
    format!("Trim along {line}; glue onto {pages}. Align the edge with the ticks, and the crosses.")
}

/// Converts all printed marks of a sheet to convex polygons.
fn obstacles(sheet: &SheetLayout, areas: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    let lines = sheet.lines.iter().map(|l| vec![l.from_mm, l.to_mm]);
    let texts = sheet.texts.iter().map(|text| {
        let width = text.text.characters() as f64 * ADVANCE_CAPS * text.cap_height_mm;
        let width = width.min(text.max_width_mm);
        let along = direction(text.angle_rad);
        let (at, up) = (text.at_mm, along.perp() * text.cap_height_mm);
        let below = at - up * 0.33;
        vec![below, below + along * width, at + up + along * width, at + up]
    });
    areas.into_iter().chain(lines).chain(texts).collect()
}

/// Returns up to two ticks that mark the trimmed edge of a page on its left or upper neighbour. They lie beside that
/// edge, outside the shared area.
fn ticks(
    [left, lower, right, upper]: [f64; 4],
    is_left: bool,
    obstacles: &[Vec<DVec2>],
) -> Vec<SheetLine> {
    let (origin, along, out, length) = match is_left {
        true => (DVec2::new(left, lower), DVec2::Y, -DVec2::X, upper - lower),
        false => (DVec2::new(left, upper), DVec2::X, DVec2::Y, right - left),
    };
    let ends = |at: f64| [TRIM_MM, TRIM_MM + TICK_MM].map(|far| origin + along * at + out * far);
    let clear = |at: &f64| {
        let [near, far] = ends(*at);
        let blank = CROSS_MM.1 * (along + out);
        let low = near.min(far) - blank.abs();
        let high = near.max(far) + blank.abs();
        let area = rectangle([low.x, low.y, high.x, high.y]);
        obstacles.iter().all(|polygon| gap_mm(polygon, &area) > 0.0)
    };
    let steps = (length / CROSS_STEP_MM) as usize;
    let places = || (4..steps.saturating_sub(3)).map(|n| n as f64 * CROSS_STEP_MM);
    let first = places().find(clear);
    let last =
        places().rev().find(clear).filter(|last| first.is_some_and(|first| last - first > TICK_MM));
    let found = first.into_iter().chain(last).map(ends);
    found
        .map(|[from_mm, to_mm]| SheetLine {
            kind: LineKind::Align,
            from_mm,
            to_mm,
            width_mm: LINE_MM,
        })
        .collect()
}

/// Returns up to two crosses in an area, as far apart as the printed marks allow.
fn crosses(shared: [f64; 4], obstacles: &[Vec<DVec2>]) -> Vec<SheetLine> {
    let (arm, blank) = CROSS_MM;
    let near: Vec<&Vec<DVec2>> =
        obstacles.iter().filter(|polygon| gap_mm(polygon, &rectangle(shared)) < arm).collect();
    let [left, lower, right, upper] = shared;
    let (middle, half) = (
        DVec2::new(left + right, lower + upper) / 2.0,
        [right - left, upper - lower].map(|s| s / 2.0),
    );
    let lengthwise = usize::from(half[1] > half[0]);
    let reach = arm + 1.0;
    let along = (half[lengthwise] - reach).max(0.0);
    let across = (half[1 - lengthwise] - reach).max(0.0);
    let clear = |at: DVec2| {
        let area = arm + blank;
        let square = rectangle([at.x - area, at.y - area, at.x + area, at.y + area]);
        near.iter().all(|polygon| gap_mm(polygon, &square) > 0.0)
    };
    let at =
        |u: f64, v: f64| middle + if lengthwise == 0 { DVec2::new(u, v) } else { DVec2::new(v, u) };
    let steps = (2.0 * along / CROSS_STEP_MM) as usize;
    let from_one_end = |sign: f64| {
        let places = (0..=steps).map(|n| n as f64 * CROSS_STEP_MM);
        let places = places.flat_map(|n| [0.0, 0.5, -0.5, 1.0, -1.0].map(|v| (n, v)));
        places.map(|(n, v)| at(sign * (n - along), v * across)).find(|&at| clear(at))
    };
    let mut found: Vec<DVec2> = [1.0, -1.0].into_iter().filter_map(from_one_end).collect();
    found.dedup_by(|a, b| a.distance(*b) < 4.0 * arm);
    let stroke = |from_mm: DVec2, to_mm: DVec2| SheetLine {
        kind: LineKind::Align,
        from_mm,
        to_mm,
        width_mm: LINE_MM,
    };
    let arms = [DVec2::X * arm, DVec2::Y * arm];
    found.into_iter().flat_map(|at| arms.map(|arm| stroke(at - arm, at + arm))).collect()
}
