//! Several boards on one sheet, to be cut apart.
//!
//! ```text
//!   ┌──────────────┬──────────────┐   As many boards as fit, in rows from the upper left. Each has its quiet zone and its
//!   │ ▲▲▲▲▲▲▲▲▲▲▲  │ ▲▲▲▲▲▲▲▲▲▲▲  │   own label below, which stays with it. The check bars and the label of the whole
//!   │ ▲▲▲▲▲▲▲▲▲▲▲  │ ▲▲▲▲▲▲▲▲▲▲▲  │   sheet run along its lower and right margins.
//!   │ board 0 · …  │ board 1 · …  │
//!   │ note         │ note         │
//!   └──────────────┴──────────────┘
//! ```

use std::cmp::Reverse;

use glam::DVec2;

use super::arrangement::{Arrangement, Footprint, check_margin, on_page};
use super::margin_marks::ADVANCE_CAPS;
use super::sheet_label::{label, label_of_one};
use crate::marks::logo::LogoPlacement;
use crate::marks::logo_room::LogoSize;
use crate::paper::PaperSpec;
use crate::{Label, LineKind, Placement, SheetLayout, SheetLine, SheetText};
use deltille_core::lattice::{GridKind, ROW_HEIGHT};
use deltille_core::setting::Setting::PaperNote;
use deltille_core::targets::{BoardSpec, FamilyRef, Panel, TargetError, fingerprint};

/// Capital height of a board's label, mm.
const LABEL_CAP_MM: f64 = 2.0;
/// Gap around that label, mm.
const LABEL_GAP_MM: f64 = 1.5;
/// Gap above and below a logo beside that label, mm.
const LOGO_GAP_MM: f64 = 0.75;
/// Smallest legible capital height of a note, mm.
const MIN_CAP_MM: f64 = 0.9;
/// Gap between a quiet zone and the cutting line, mm.
const CUT_GAP_MM: f64 = 0.5;
/// Width of cutting lines, mm.
const LINE_MM: f64 = 0.15;

/// Phase offset between adjacent boards, as a fraction of the distance between rows or columns of tiles.
/// With the golden section, boards that are farther apart are also out of phase.
const OUT_OF_STEP: f64 = 0.382;

/// Layout of a board in its part of a sheet.
struct Cell {
    /// Lower-left and upper-right corner of its ink, in the panel frame, mm.
    ink: [DVec2; 2],
    /// Blank space around the ink, mm.
    blank: f64,
    /// Its size, mm.
    size: DVec2,
    /// Lower ends of the lines of its label, from top to bottom, measured from the lower end of the
    /// cell, mm.
    lines: Vec<f64>,
    /// Size of the logo beside the label, mm.
    logo: Option<DVec2>,
}

impl Cell {
    fn new(spec: &BoardSpec, panel: &Panel, paper: &PaperSpec) -> Self {
        let [left, lower, right, upper] =
            if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
        let ink = [DVec2::new(left, lower), DVec2::new(right, upper)];
        let blank = Footprint::new(spec, paper.margin_mm).mark_blank + CUT_GAP_MM;
        let count = 1 + usize::from(paper.note.is_some());
        let step = LABEL_CAP_MM + LABEL_GAP_MM;
        let lines = (0..count).rev().map(|line| LABEL_GAP_MM + line as f64 * step).collect();
        let below = blank + count as f64 * step + LABEL_GAP_MM;
        let least = ink[1] - ink[0] + DVec2::new(2.0 * blank, blank + below);
        // The tiles of one board must not continue those of the next when the whole sheet is viewed. Every second row
        // of triangles is shifted by half an edge.
        let step = spec.edge_mm
            * match spec.grid {
                GridKind::Deltille => DVec2::new(0.5, ROW_HEIGHT),
                GridKind::Checker => DVec2::ONE,
            };
        let size = ((least / step - OUT_OF_STEP).ceil() + OUT_OF_STEP) * step;
        Self { ink, blank, size, lines, logo: None }
    }

    /// Returns the cell with a logo beside the label, which must have room for these words.
    fn with_logo(self, logo: Option<LogoSize>, words: &str) -> Self {
        let lines = self.lines.len() as f64 * (LABEL_CAP_MM + LABEL_GAP_MM) + LABEL_GAP_MM;
        let [deep, most] =
            [lines, self.below() - self.blank].map(|room_mm| room_mm - 2.0 * LOGO_GAP_MM);
        let wanted = words.chars().count() as f64 * ADVANCE_CAPS * LABEL_CAP_MM;
        let logo = logo.map(|logo| logo.in_strip([self.line_mm(), wanted], deep, most));
        Self { logo, ..self }
    }

    /// Returns the space for a line of the label, mm.
    fn line_mm(&self) -> f64 {
        let logo_mm = self.logo.map_or(0.0, |size| LogoSize::taken(size.x));
        self.size.x - 2.0 * self.blank - logo_mm
    }

    /// Rejects a note that would be illegible.
    fn check_note(&self, note: Option<&str>) -> Result<(), TargetError> {
        let Some(note) = note else { return Ok(()) };
        let most = (self.line_mm() / (MIN_CAP_MM * ADVANCE_CAPS)).floor() as usize;
        let count = note.chars().count();
        if count <= most {
            return Ok(());
        }
        let problem = format!(
            "the note has {count} characters, but only {most} are legible below this board: shorten it, or use larger boards"
        );
        Err(TargetError::invalid(PaperNote, problem))
    }

    /// Returns the space below the board, including its label.
    fn below(&self) -> f64 {
        self.size.y - self.blank - (self.ink[1].y - self.ink[0].y)
    }
}

/// Lays out sheets with as many boards on each as fit.
pub(crate) fn sheets(
    name: &str,
    spec: &BoardSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let Some(first) = panels.first() else { return Ok(Vec::new()) };
    let cell = Cell::new(spec, first, paper)
        .with_logo(LogoSize::of(paper), &label_of_one(spec, first, family));
    let note = paper.note.as_deref().map(str::trim);
    cell.check_note(note)?;
    let (grid @ [columns, rows], arrangement) = arrange(&cell, panels.len(), paper)?
        .ok_or_else(|| super::arrangement::does_not_fit(spec, paper, |spec| fits(spec, paper)))?;
    let target = fingerprint(panels, family);
    let pages: Vec<&[Panel]> = panels.chunks(columns * rows).collect();
    let count = pages.len();
    let sheets = pages.into_iter().enumerate().map(|(index, panels)| {
        let mut words = label(name, spec, panels, family, target);
        if count > 1 {
            words += &format!(" · page {} of {count}", index + 1);
        }
        let boards = Boards { panels, spec, family, note };
        sheet(&cell, grid, &arrangement, &boards, words)
    });
    Ok(sheets.collect())
}

/// Returns whether a board of this kind fits on the paper.
pub(crate) fn fits(spec: &BoardSpec, paper: &PaperSpec) -> bool {
    let panels = deltille_core::targets::untied_panels(&BoardSpec { boards: 1, ..spec.clone() });
    let cell = panels.first().map(|panel| Cell::new(spec, panel, paper));
    cell.is_some_and(|cell| arrange(&cell, 1, paper).is_ok_and(|found| found.is_some()))
}

/// Chooses the columns and rows of a page, at most as many as there are boards, and their position. Uses the smallest
/// paper that fits one board, in the orientation that fits the most boards.
fn arrange(
    cell: &Cell,
    boards: usize,
    paper: &PaperSpec,
) -> Result<Option<([usize; 2], Arrangement)>, TargetError> {
    let margin = check_margin(paper)?;
    // Prefers the most boards, then the smallest grid.
    let worth = |[c, r]: [usize; 2]| ((c * r).min(boards), Reverse(c * r), c);
    let on_sheet = |page: DVec2| {
        let size = cell.size;
        let most = (page / size).floor();
        let [columns, rows] = [most.x as usize, most.y as usize];
        let grids = (1..=columns.min(boards))
            .flat_map(|c| (1..=rows.min(boards.div_ceil(c))).map(move |r| [c, r]));
        let fitting = grids.filter_map(|grid @ [c, r]| {
            let footprint = Footprint {
                width: size.x * c as f64,
                height: size.y * r as f64,
                edge_blank: margin,
                mark_blank: LABEL_GAP_MM,
                is_centred: false,
            };
            Some((grid, on_page(&footprint, page, margin, false)?))
        });
        fitting.max_by_key(|(grid, _)| worth(*grid))
    };
    let on_size = |size: &crate::PaperSize| {
        let found = paper.pages_mm(size).into_iter().filter_map(on_sheet);
        found.max_by_key(|(grid, _)| worth(*grid))
    };
    Ok(paper.sizes().iter().find_map(on_size))
}

/// The boards of a sheet.
struct Boards<'a> {
    panels: &'a [Panel],
    spec: &'a BoardSpec,
    family: Option<&'a FamilyRef>,
    /// Note below each board.
    note: Option<&'a str>,
}

/// Lays out one sheet: boards from the upper left, row by row, each with its logo, and the lines between them.
fn sheet(
    cell: &Cell,
    [columns, rows]: [usize; 2],
    arrangement: &Arrangement,
    &Boards { panels, spec, family, note }: &Boards,
    words: String,
) -> SheetLayout {
    let size = cell.size;
    let whole = size * DVec2::new(columns as f64, rows as f64);
    let mut sheet = arrangement.sheet(0, [0.0, 0.0, whole.x, whole.y], words);
    let lower_left = sheet.placements[0].origin_mm;
    let at = |column: usize, row: usize| lower_left + size * DVec2::new(column as f64, row as f64);
    let line =
        |from_mm, to_mm| SheetLine { kind: LineKind::Cut, from_mm, to_mm, width_mm: LINE_MM };
    sheet.lines.extend((0..=columns).map(|column| line(at(column, 0), at(column, rows))));
    sheet.lines.extend((0..=rows).map(|row| line(at(0, row), at(columns, row))));
    sheet.placements.clear();
    for (index, panel) in panels.iter().enumerate() {
        let corner = at(index % columns, rows - 1 - index / columns);
        let origin_mm = corner + DVec2::new(cell.blank, cell.below()) - cell.ink[0];
        sheet.placements.push(Placement { panel: panel.id, angle_rad: 0.0, origin_mm });
        let words = [Some(label_of_one(spec, panel, family)), note.map(str::to_owned)];
        if let Some(DVec2 { x: width_mm, y: height_mm }) = cell.logo {
            let right = size.x - cell.blank - width_mm;
            let at_mm = corner + DVec2::new(right, LOGO_GAP_MM);
            sheet.logos.push(LogoPlacement { at_mm, angle_rad: 0.0, height_mm });
        }
        let lines = words.into_iter().flatten().zip(&cell.lines);
        sheet.texts.extend(lines.map(|(words, lower_mm)| SheetText {
            text: Label::Words(words),
            at_mm: corner + DVec2::new(cell.blank, lower_mm + LABEL_CAP_MM / 3.0),
            angle_rad: 0.0,
            cap_height_mm: LABEL_CAP_MM,
            max_width_mm: cell.line_mm(),
        }));
    }
    sheet
}
