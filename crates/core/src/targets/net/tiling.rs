//! A net that is larger than the paper, over several pages.
//!
//! ```text
//!   A1────┬┬────┐A2     The sheet is as large as the windows of all pages together. Neighbouring
//!   │     ││    │       windows overlap; crosses in the overlap are printed on both pages. Rows
//!   ├─────┼┼────┤ ×     are letters from the top, columns numbers from the left. Windows that
//!   ├─────┼┼────┤       show nothing of the net are not printed.
//!   B1────┴┴────┘B2
//! ```

use glam::DVec2;

use super::plane::{Motion, bounds, gap_mm};
use super::sheet::instructions;
use crate::targets::angles::direction;
use crate::targets::layout::{ADVANCE_CAPS, Arrangement, Footprint, fit_upright};
use crate::targets::length::format_mm;
use crate::targets::paper::{Orientation, PaperSize, PaperSpec};
use crate::targets::{
    Label, LineKind, SheetLayout, SheetLine, SheetPage, SheetText, SolidSpec, TargetError,
};

/// Width of what neighbouring windows share, mm.
const OVERLAP_MM: f64 = 10.0;

/// Blank around the net on its sheet, mm.
const BORDER_MM: f64 = 3.0;

/// Blank between the window and the marks of the page, mm.
const BLANK_MM: f64 = 1.5;

/// Height of the words between window and check bar, mm; the overview beside them is as high.
const WORDS_MM: f64 = 13.0;

/// Smallest window, mm: on less there is more overlap than net.
const LEAST_WINDOW_MM: f64 = 40.0;

/// Most pages of a net: an afternoon's work.
const MOST_PAGES: usize = 120;

/// Largest sheet, mm²: pictures of it that still resolve its hairlines can be verified.
const MOST_AREA_MM2: f64 = 4e6;

/// Length of an arm of a cross, and its blank, mm: it has room in a slanted margin of 5 mm.
const CROSS_MM: (f64, f64) = (1.3, 0.35);

/// Places for crosses are tried in steps of this, mm: less than the room to spare in such a margin.
const CROSS_STEP_MM: f64 = 0.5;

/// Width of the lines of crosses, and of the overview's, mm.
const LINE_MM: f64 = 0.15;

/// Width of the frame around the page's own window on the overview, mm.
const FRAME_MM: f64 = 0.5;

/// Capital height of the page's name, mm.
const NAME_CAP_MM: f64 = 6.0;

/// How a net lies over pages.
pub struct Tiling {
    /// A page as it would be without a net.
    page: Arrangement,
    /// The window on the page: left, lower, right, upper end, mm.
    window_mm: [f64; 4],
    /// Columns and rows of windows.
    counts: [usize; 2],
    sheet_from_net: Motion,
}

impl Tiling {
    /// The tiling with the fewest windows, on A0 unless the paper is said.
    pub fn new(spec: &SolidSpec, points: &[DVec2], paper: &PaperSpec) -> Result<Self, TargetError> {
        let size = match &paper.size {
            Some(size) => size.clone(),
            None => PaperSize::automatic().last().expect("there are sizes"),
        };
        let orientations = match paper.orientation {
            Orientation::Auto => vec![Orientation::Portrait, Orientation::Landscape],
            one => vec![one],
        };
        let mut best: Option<Self> = None;
        for orientation in orientations {
            let paper = PaperSpec { size: Some(size.clone()), orientation, ..paper.clone() };
            let least = Footprint {
                width: LEAST_WINDOW_MM,
                height: LEAST_WINDOW_MM + WORDS_MM,
                edge_blank: paper.margin_mm,
                mark_blank: 2.0 * BLANK_MM,
            };
            let Some(page) = fit_upright(&least, &paper)? else { continue };
            for angle in [0.0, std::f64::consts::FRAC_PI_2] {
                let tiling = Self::on(&page, Motion::turning(angle), points);
                let count = |t: &Self| t.counts[0] * t.counts[1];
                if best.as_ref().is_none_or(|best| count(&tiling) < count(best)) {
                    best = Some(tiling);
                }
            }
        }
        let Some(tiling) = best else {
            let problem = format!("{size} is too small for pages of a net: take larger paper");
            return Err(TargetError::invalid("PaperSpec::size", problem));
        };
        tiling.check(spec, &size)?;
        Ok(tiling)
    }

    fn on(page: &Arrangement, turn: Motion, points: &[DVec2]) -> Self {
        let [left, lower, right, upper] = page.clear_mm();
        let window_mm = [left, lower + BLANK_MM + WORDS_MM, right - BLANK_MM, upper];
        let window = DVec2::new(window_mm[2] - window_mm[0], window_mm[3] - window_mm[1]);
        let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
        let [x0, y0, x1, y1] = bounds(&turned);
        let count = |size: f64, window: f64| {
            let beyond = (size + 2.0 * BORDER_MM - OVERLAP_MM) / (window - OVERLAP_MM);
            beyond.ceil().max(1.0) as usize
        };
        let counts = [count(x1 - x0, window.x), count(y1 - y0, window.y)];
        let mut tiling = Self { page: *page, window_mm, counts, sheet_from_net: turn };
        // The net lies in the middle of the sheet.
        let middle = DVec2::new(x0 + x1, y0 + y1) / 2.0;
        tiling.sheet_from_net.shift = tiling.size_mm() / 2.0 - middle;
        tiling
    }

    fn check(&self, spec: &SolidSpec, size: &PaperSize) -> Result<(), TargetError> {
        let pages = self.counts[0] * self.counts[1];
        let area = self.size_mm().element_product();
        let too_large = (area / MOST_AREA_MM2).max(pages as f64 / MOST_PAGES as f64);
        if too_large <= 1.0 {
            return Ok(());
        }
        let edge = (spec.edge_mm / too_large.sqrt() * 0.95).floor();
        let problem = format!(
            "the net of a solid with {} edges takes {pages} pages of {size}, more than can be \
             assembled and verified: take `SolidSheets::PerFace`, or \
             `SolidSpec::edge_mm` of at most {edge} mm{}",
            format_mm(spec.edge_mm),
            if area <= MOST_AREA_MM2 { ", or larger `PaperSpec::size`" } else { "" }
        );
        Err(TargetError::invalid("SolidSpec::edge_mm", problem))
    }

    /// Where the net lies on the sheet.
    pub fn sheet_from_net(&self) -> Motion {
        self.sheet_from_net
    }

    /// The sheet, still empty.
    pub fn sheet(&self) -> SheetLayout {
        let DVec2 { x: width_mm, y: height_mm } = self.size_mm();
        SheetLayout {
            width_mm,
            height_mm,
            placements: Vec::new(),
            check_bars: Vec::new(),
            lines: Vec::new(),
            texts: Vec::new(),
            pages: Vec::new(),
        }
    }

    fn window_size(&self) -> DVec2 {
        let [left, lower, right, upper] = self.window_mm;
        DVec2::new(right - left, upper - lower)
    }

    /// Width and height of the sheet, mm.
    fn size_mm(&self) -> DVec2 {
        let [columns, rows] = self.counts.map(|count| count as f64);
        (self.window_size() - OVERLAP_MM) * DVec2::new(columns, rows) + OVERLAP_MM
    }

    /// The window in a column and a row (from the top) on the sheet: left, lower, right, upper.
    fn window_on_sheet(&self, column: usize, row: usize) -> [f64; 4] {
        let window = self.window_size();
        let left = (window.x - OVERLAP_MM) * column as f64;
        let upper = self.size_mm().y - (window.y - OVERLAP_MM) * row as f64;
        [left, upper - window.y, left + window.x, upper]
    }

    /// Adds crosses to a sheet that holds the net, and its pages. `faces` holds the outline of the
    /// tiles of each panel, by its id.
    pub fn add_pages(&self, sheet: &mut SheetLayout, faces: &[(u32, [DVec2; 3])], label: &str) {
        let obstacles = obstacles(sheet, faces);
        let [columns, rows] = self.counts;
        let shown: Vec<(usize, usize)> = (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .filter(|&(column, row)| {
                let window = rectangle(self.window_on_sheet(column, row));
                obstacles.iter().any(|polygon| gap_mm(polygon, &window) < 0.0)
            })
            .collect();
        let overview = sheet.lines.clone();
        for &(column, row) in &shown {
            for next in [(column + 1, row), (column, row + 1)] {
                if shown.contains(&next) {
                    let a = self.window_on_sheet(column, row);
                    let b = self.window_on_sheet(next.0, next.1);
                    let shared = [a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])];
                    sheet.lines.extend(crosses(shared, &obstacles));
                }
            }
        }
        let name = |(column, row): (usize, usize)| format!("{}{}", letters(row), column + 1);
        let pages = shown.iter().map(|&(column, row)| {
            let [left, lower, ..] = self.window_mm;
            let window = self.window_on_sheet(column, row);
            let label = format!("{label} · page {}", name((column, row)));
            let mut marks = self.page.sheet(0, [0.0; 4], label);
            marks.placements.clear();
            self.explain(&mut marks, name((column, row)), &sheet.lines);
            self.draw_overview(&mut marks, &overview, window);
            SheetPage {
                label: name((column, row)),
                window_mm: self.window_mm,
                sheet_at_mm: DVec2::new(left - window[0], lower - window[1]),
                marks,
            }
        });
        sheet.pages = pages.collect();
    }

    /// Size of the overview, mm, and its scale.
    fn overview(&self) -> (DVec2, f64) {
        let size = self.size_mm();
        let high = WORDS_MM - 2.0 * BLANK_MM;
        let scale = (high / size.y).min(0.25 * self.window_size().x / size.x);
        (size * scale, scale)
    }

    /// The name of the page, and what to do with it.
    fn explain(&self, marks: &mut SheetLayout, name: String, lines: &[SheetLine]) {
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
        marks.texts.extend(instructions(lines, DVec2::new(start, at), room));
        let join = "Join the pages first: what overlaps is the same on both; lay cross on cross.";
        marks.texts.push(text(join.to_owned(), (start, at + 7.2), 2.2, room));
    }

    /// A small picture of the sheet with the window of the page framed.
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

/// Rows after Z are AA, AB, …
fn letters(mut row: usize) -> String {
    let mut letters = String::new();
    loop {
        letters.insert(0, char::from(b'A' + (row % 26) as u8));
        if row < 26 {
            return letters;
        }
        row = row / 26 - 1;
    }
}

/// A rectangle, counter-clockwise.
fn rectangle([left, lower, right, upper]: [f64; 4]) -> [DVec2; 4] {
    [(left, lower), (right, lower), (right, upper), (left, upper)].map(DVec2::from)
}

/// Everything printed on a sheet, as convex polygons.
fn obstacles(sheet: &SheetLayout, faces: &[(u32, [DVec2; 3])]) -> Vec<Vec<DVec2>> {
    let tiles = sheet.placements.iter().filter_map(|placement| {
        let (_, face) = faces.iter().find(|(panel, _)| *panel == placement.panel)?;
        Some(face.map(|p| placement.page_from_panel(p)).to_vec())
    });
    let lines = sheet.lines.iter().map(|l| vec![l.from_mm, l.to_mm]);
    let texts = sheet.texts.iter().map(|text| {
        let width = text.text.characters() as f64 * ADVANCE_CAPS * text.cap_height_mm;
        let width = width.min(text.max_width_mm);
        let along = direction(text.angle_rad);
        let (at, up) = (text.at_mm, along.perp() * text.cap_height_mm);
        let below = at - up * 0.33;
        vec![below, below + along * width, at + up + along * width, at + up]
    });
    tiles.chain(lines).chain(texts).collect()
}

/// Up to two crosses in an area, as far apart as what is printed there allows.
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
