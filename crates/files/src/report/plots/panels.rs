//! Drawing of values at the corners of a target: each corner has a coloured dot at its position on the panel, and an arrow.
//! All panels of a target share one scale and are arranged in rows.

use std::fmt::Write as _;

use glam::DVec2;

use deltille_calibrate::PanelRef;
use deltille_core::statistics::median;

/// Margin around every panel, user units; the margin below contains the name of the panel.
const MARGIN: f64 = 26.0;

/// Maximum number of panels in a row.
const PANELS_IN_A_ROW: usize = 5;

/// Radius of a dot as a fraction of the corner spacing, and its minimum and maximum, user units.
const DOT_PART: f64 = 0.16;
const DOTS: [f64; 2] = [1.2, 7.0];

/// The values that are shown at a corner.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    /// Its panel.
    pub panel: PanelRef,
    /// Its lattice row on the panel.
    pub row: i32,
    /// Its lattice column.
    pub col: i32,
    /// Its position in the panel frame, mm; y up.
    pub at_mm: DVec2,
    /// Its offset in the panel frame, mm, drawn as an enlarged arrow.
    pub by_mm: DVec2,
    /// Whether the offset is significant; others are drawn in grey.
    pub is_confirmed: bool,
    /// CSS colour of the dot.
    pub colour: String,
    /// Tooltip; omitted if empty.
    pub title: String,
}

/// The layout of the panels in the drawing.
pub(super) struct Panels<'a> {
    /// Marks of each panel.
    panels: Vec<&'a [Mark]>,
    /// Size of a panel with its margins, user units.
    cell: DVec2,
    /// Margin around the marks, with room for the arrows of the outermost corners, user units.
    margin: f64,
    /// User units per millimetre on the panel.
    per_mm: f64,
    /// Median distance between neighbouring corners, mm.
    spacing_mm: f64,
}

impl<'a> Panels<'a> {
    /// Lays out marks, sorted by panel, at the largest scale that fits the width and height, user units.
    pub(super) fn new(marks: &'a [Mark], width: f64, most_height: f64) -> Self {
        let panels: Vec<&[Mark]> = marks.chunk_by(|a, b| a.panel == b.panel).collect();
        let in_a_row = panels.len().clamp(1, PANELS_IN_A_ROW);
        let rows = panels.len().div_ceil(in_a_row).max(1);
        // The largest panel sets the scale of all. Arrows may extend by one corner spacing.
        let largest = panels.iter().map(|marks| size_mm(marks)).fold(DVec2::ONE, DVec2::max);
        let spacing_mm = spacing_mm(marks);
        let room = DVec2::new(width / in_a_row as f64, most_height / rows as f64) - 2.0 * MARGIN;
        let per_mm = (room / (largest + 2.0 * spacing_mm)).min_element().max(1e-9);
        let margin = MARGIN + spacing_mm * per_mm;
        let high = largest.y * per_mm + 2.0 * margin;
        let cell = DVec2::new(width / in_a_row as f64, high);
        Self { panels, cell, margin, per_mm, spacing_mm }
    }

    /// The median distance from a corner to the next in its row, mm.
    pub(super) fn spacing_mm(&self) -> f64 {
        self.spacing_mm
    }

    /// User units per millimetre on the panel.
    pub(super) fn per_mm(&self) -> f64 {
        self.per_mm
    }

    /// Height of the whole drawing, user units.
    pub(super) fn height(&self) -> f64 {
        let in_a_row = self.panels.len().clamp(1, PANELS_IN_A_ROW);
        self.panels.len().div_ceil(in_a_row) as f64 * self.cell.y
    }

    /// The SVG elements of all panels, with offsets enlarged by a factor.
    pub(super) fn drawn(&self, enlarged: f64) -> String {
        let in_a_row = self.panels.len().clamp(1, PANELS_IN_A_ROW);
        let mut drawn = String::new();
        for (index, marks) in self.panels.iter().enumerate() {
            let at = DVec2::new((index % in_a_row) as f64, (index / in_a_row) as f64) * self.cell;
            let [low, high] = extent_mm(marks);
            // Centred in its cell.
            let wide = (high.x - low.x) * self.per_mm;
            let left = at.x + (self.cell.x - wide) / 2.0;
            let bottom = at.y + self.cell.y - self.margin;
            drawn += &self.panel(marks, low, DVec2::new(left, bottom), enlarged);
            if self.panels.len() > 1 {
                let (name, y) = (marks[0].panel, bottom + 20.0);
                let _ = write!(drawn, "<text x=\"{left:.1}\" y=\"{y:.1}\">panel {name}</text>");
            }
        }
        drawn
    }

    /// The SVG elements of one panel. `low` is the lower left end of its marks, mm, which is drawn at
    /// `origin`, user units; y points up on the panel and down in the SVG.
    fn panel(&self, marks: &[Mark], low: DVec2, origin: DVec2, enlarged: f64) -> String {
        let up = DVec2::new(1.0, -1.0);
        let [least, most] = DOTS;
        let radius = (DOT_PART * self.spacing_mm * self.per_mm).clamp(least, most);
        let mut drawn = String::new();
        for mark in marks {
            let DVec2 { x, y } = origin + up * (mark.at_mm - low) * self.per_mm;
            let by = up * mark.by_mm * enlarged * self.per_mm;
            let class = if mark.is_confirmed { "offset" } else { "offset chance" };
            let title = match mark.title.as_str() {
                "" => String::new(),
                title => format!("<title>{title}</title>"),
            };
            let _ = write!(
                drawn,
                "<circle class=\"place\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{}\">{title}</circle>\
                 <line class=\"{class}\" x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{:.1}\"/>",
                mark.colour,
                x + by.x,
                y + by.y
            );
        }
        drawn
    }
}

/// Lower left and upper right end of the positions of marks, mm.
fn extent_mm(marks: &[Mark]) -> [DVec2; 2] {
    let places = marks.iter().map(|mark| mark.at_mm);
    places
        .fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
}

/// Width and height of the positions of marks, mm.
fn size_mm(marks: &[Mark]) -> DVec2 {
    let [low, high] = extent_mm(marks);
    high - low
}

/// Median distance between consecutive marks in a row of a panel, mm; 1 mm if no row has two marks.
fn spacing_mm(marks: &[Mark]) -> f64 {
    let pairs = marks.windows(2).filter(|pair| {
        (pair[0].panel, pair[0].row, pair[0].col + 1) == (pair[1].panel, pair[1].row, pair[1].col)
    });
    median(pairs.map(|pair| pair[0].at_mm.distance(pair[1].at_mm)).collect()).unwrap_or(1.0)
}
