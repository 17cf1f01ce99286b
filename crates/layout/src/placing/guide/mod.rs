//! The guide page of a target: a figure, assembly instructions, and a ruler.
//!
//! ```text
//!   ┌──────────────────────┐
//!   │ name                 │   The figure shows the finished solid from outside, or the board on its
//!   │     ╱╲               │   plate. Faces have their numbers, and an arrow towards their upper end.
//!   │    ╱ 3╲   z│         │   The axes are those of the target's description.
//!   │   ╱____╲   └─ x      │
//!   │ 1. Print …           │   The page consists of lines and texts like other sheets, so that it is
//!   │ 2. Cut …             │   verified in the same way.
//!   │ ├──┴──┴──┴──┤        │
//!   └──────────────────────┘
//! ```
//!
//! 1. `model`: the lines of the figure; 2. `steps`: the instructions. This file lays out both on the page.

mod model;
mod steps;

use glam::{DVec2, DVec3};

use self::model::{Model, THICK_MM, THIN_MM, View};
use self::steps::steps;
use super::arrangement::{Footprint, fit_upright};
use super::margin_marks::ADVANCE_CAPS;
use crate::paper::{Orientation, PaperSize, PaperSpec};
use crate::{Label, LineKind, SheetLayout, SheetLine, SheetText};
use deltille_core::setting::Setting::PaperMarginMm;
use deltille_core::targets::format_mm;
use deltille_core::targets::{Incircle, Target, TargetError, TargetSpec};
use deltille_core::words::counted;

/// Range of paper sides used for the guide page, mm: the sizes that desktop printers print. For
/// other paper, the page is A4.
const AT_A_DESK_MM: [f64; 2] = [140.0, 360.0];
/// Capital heights of the name, of the steps and of small texts, mm.
const NAME_CAP_MM: f64 = 6.0;
const STEP_CAP_MM: f64 = 2.3;
const SMALL_CAP_MM: f64 = 1.8;
/// Line spacing within a step, and additional spacing between steps, mm.
const LINE_SPACING_MM: f64 = 4.6;
const STEP_SPACING_MM: f64 = 1.8;
/// Indentation of the text of a step, after its number, mm.
const INDENT_MM: f64 = 6.0;
/// Height of the ruler with its numbers, and length of its longest marks, mm.
const RULER_MM: f64 = 9.0;
const MARK_MM: f64 = 4.0;
/// Gap between name, figure, steps and ruler, mm.
const BLANK_MM: f64 = 5.0;
/// Smallest and largest fraction of the space between name and ruler that the figure takes.
const FIGURE_SHARE: (f64, f64) = (0.35, 0.62);
/// Length of the axes in the figure, mm.
const AXIS_MM: f64 = 12.0;
/// Sine of the smallest viewing angle at which a face is numbered.
const MIN_SINE: f64 = 0.2;
/// Capital heights of face numbers, mm.
const NUMBER_CAP_MM: std::ops::RangeInclusive<f64> = 1.5..=6.0;

/// Returns the guide page for a target that was laid out on `paper`.
pub(crate) fn sheet(
    title: &str,
    target: &Target,
    sheets: &[SheetLayout],
    paper: &PaperSpec,
) -> Result<SheetLayout, TargetError> {
    let paper = PaperSpec {
        size: Some(at_a_desk(paper)),
        orientation: Orientation::Portrait,
        ..paper.clone()
    };
    // The guide uses the space that the bars along the margins leave. A small board stands in for its content here.
    let small = Footprint {
        width: 50.0,
        height: 100.0,
        edge_blank: paper.margin_mm,
        mark_blank: BLANK_MM,
        is_centred: false,
    };
    let arrangement = fit_upright(&small, &paper)?.ok_or_else(|| {
        let problem = format!(
            "a margin of {} leaves no room for the guide page: use a smaller one",
            format_mm(paper.margin_mm)
        );
        TargetError::invalid(PaperMarginMm, problem)
    })?;
    let mut sheet = arrangement.sheet(0, [0.0; 4], description(title, target));
    sheet.placements.clear();
    let [left, lower, right, upper] = arrangement.clear_mm();
    let (least, most) = (DVec2::new(left, lower + BLANK_MM), DVec2::new(right - BLANK_MM, upper));
    Ok(Page { sheet, least, most }.filled(target, sheets, &paper))
}

/// Returns the paper itself if a desktop printer can print it, else A4.
fn at_a_desk(paper: &PaperSpec) -> PaperSize {
    let fits = |size: &&PaperSize| {
        let DVec2 { x, y } = size.portrait_mm();
        (AT_A_DESK_MM[0]..=AT_A_DESK_MM[1]).contains(&x) && y <= AT_A_DESK_MM[1]
    };
    let own = paper.size.as_ref().filter(fits).cloned();
    own.unwrap_or_else(|| PaperSize::automatic().next().expect("A4 is an automatic size"))
}

/// Describes the target in one line.
fn description(title: &str, target: &Target) -> String {
    let what = if matches!(target.spec, TargetSpec::Circles(_)) { "circle" } else { "corner" };
    let corners: usize = target.panels.iter().map(|panel| panel.corners.len()).sum();
    let mut parts = vec![title.to_owned(), "guide".to_owned(), counted(corners, what)];
    for kind in target.tilings() {
        if let Some((family, ids)) = target.tags_of_tiling(kind).filter(|(_, ids)| !ids.is_empty())
        {
            parts.push(format!("{} of {}", counted(ids.len(), "tag"), family.name));
        }
    }
    parts.push(format!("deltille {}", env!("CARGO_PKG_VERSION")));
    parts.join(" · ")
}

/// The page, and its remaining free area, mm.
struct Page {
    sheet: SheetLayout,
    least: DVec2,
    most: DVec2,
}

impl Page {
    fn filled(mut self, target: &Target, sheets: &[SheetLayout], paper: &PaperSpec) -> SheetLayout {
        self.most.y -= NAME_CAP_MM;
        self.text(target.name.to_string(), DVec2::new(self.least.x, self.most.y), NAME_CAP_MM);
        self.most.y -= BLANK_MM;
        self.ruler();
        let steps = self.wrapped(&steps(target, sheets, paper));
        let room = self.most.y - self.least.y;
        let height =
            (room - height(&steps) - BLANK_MM).clamp(FIGURE_SHARE.0 * room, FIGURE_SHARE.1 * room);
        let lower = DVec2::new(self.least.x, self.most.y - height);
        self.figures(target, [lower, self.most]);
        self.most.y -= height + BLANK_MM;
        self.steps(steps);
        self.sheet
    }

    fn text(&mut self, text: String, at_mm: DVec2, cap_height_mm: f64) {
        let max_width_mm = self.most.x - at_mm.x;
        let (text, angle_rad) = (Label::Words(text), 0.0);
        self.sheet.texts.push(SheetText { text, at_mm, angle_rad, cap_height_mm, max_width_mm });
    }

    /// Adds a line of text centred at a position.
    fn centred(&mut self, text: String, middle: DVec2, cap_mm: f64) {
        let width = text.chars().count() as f64 * ADVANCE_CAPS * cap_mm;
        self.text(text, middle - DVec2::new(width, cap_mm) / 2.0, cap_mm);
    }

    fn line(&mut self, from_mm: DVec2, to_mm: DVec2, width_mm: f64) {
        self.sheet.lines.push(SheetLine { kind: LineKind::Align, from_mm, to_mm, width_mm });
    }

    /// Adds a ruler in centimetres and half centimetres, as long as the page allows.
    fn ruler(&mut self) {
        let (base, start) = (self.least.y + SMALL_CAP_MM + 1.5, self.least.x + THIN_MM);
        let halves = ((self.most.x - start - SMALL_CAP_MM) / 5.0).floor() as u32;
        for half in 0..=halves {
            let foot = DVec2::new(start + 5.0 * f64::from(half), base);
            let is_whole = half.is_multiple_of(2);
            let height = if is_whole { MARK_MM } else { MARK_MM / 2.0 };
            self.line(foot, foot + height * DVec2::Y, THIN_MM);
            if is_whole {
                let below = foot - (1.2 + SMALL_CAP_MM / 2.0) * DVec2::Y;
                self.centred((half / 2).to_string(), below, SMALL_CAP_MM);
            }
        }
        let word = DVec2::new(start, base + MARK_MM + 1.2);
        self.text("Ruler, centimetres".to_owned(), word, SMALL_CAP_MM);
        self.least.y += RULER_MM + BLANK_MM;
    }

    /// Wraps the lines of each step at the page width.
    fn wrapped(&self, steps: &[String]) -> Vec<Vec<String>> {
        let room = self.most.x - self.least.x - INDENT_MM;
        let characters = (room / (ADVANCE_CAPS * STEP_CAP_MM)) as usize;
        let lines =
            |step: &String| step.lines().flat_map(|line| wrapped(line, characters)).collect();
        steps.iter().map(lines).collect()
    }

    /// Adds the numbered steps, scaled down if the page is too small.
    fn steps(&mut self, steps: Vec<Vec<String>>) {
        let scale = ((self.most.y - self.least.y) / height(&steps)).min(1.0);
        let mut y = self.most.y;
        for (step, lines) in steps.into_iter().enumerate() {
            let first = DVec2::new(self.least.x, y - scale * LINE_SPACING_MM);
            self.text(format!("{}.", step + 1), first, scale * STEP_CAP_MM);
            for line in lines {
                y -= scale * LINE_SPACING_MM;
                self.text(line, DVec2::new(self.least.x + INDENT_MM, y), scale * STEP_CAP_MM);
            }
            y -= scale * STEP_SPACING_MM;
        }
    }

    /// Adds the figures of the target. A solid is drawn from two opposite sides, so that every face is visible in one
    /// of them.
    fn figures(&mut self, target: &Target, [lower, upper]: [DVec2; 2]) {
        let front = Model::of(target);
        if front.numbers.is_empty() {
            self.figure(&front, [lower, upper]);
            return;
        }
        let middle = lower.midpoint(upper).x;
        self.figure(&front, [lower, DVec2::new(middle, upper.y)]);
        let back = Model { view: View::from(-front.view.towards, DVec3::Z), ..front };
        self.figure(&back, [DVec2::new(middle, lower.y), upper]);
    }

    /// Draws the model with its axes, as large as the rectangle allows.
    fn figure(&mut self, model: &Model, [lower, upper]: [DVec2; 2]) {
        let seen = model.faces.iter().flatten().map(|&point| model.view.projected(point));
        let seen: Vec<DVec2> = seen.collect();
        let bounds = [DVec2::min, DVec2::max]
            .map(|most| seen.iter().copied().reduce(most).unwrap_or_default());
        // The axes lie below a solid, which is drawn twice, or to the left of a board.
        let axes = match model.numbers.is_empty() {
            true => DVec2::new(2.0 * AXIS_MM, 0.0),
            false => DVec2::new(0.0, 2.0 * AXIS_MM),
        };
        let room = upper - lower - axes - BLANK_MM;
        let size = bounds[1] - bounds[0];
        let scale = (room.x / size.x).min(room.y / size.y);
        let middle = (lower + axes).midpoint(upper);
        let on_page = |point: DVec2| middle + scale * (point - bounds[0].midpoint(bounds[1]));
        for (line, width) in &model.lines {
            for [from, to] in model.seen_of(*line) {
                self.line(on_page(from), on_page(to), *width);
            }
        }
        for (face, number) in model.numbers.iter().enumerate() {
            self.number(model, face, number, scale, on_page);
        }
        let origin = lower + DVec2::splat(1.2 * AXIS_MM);
        for (axis, name) in [(DVec3::X, "x"), (DVec3::Y, "y"), (DVec3::Z, "z")] {
            let way = AXIS_MM * model.view.projected(axis);
            self.arrow(origin, origin + way, THICK_MM);
            let beside = origin + way + 2.5 * way.normalize_or_zero();
            self.centred(name.to_owned(), beside, STEP_CAP_MM);
        }
    }

    /// Draws the number of a face, and an arrow towards its upper end, if the face is clearly visible.
    fn number(
        &mut self,
        model: &Model,
        face: usize,
        number: &str,
        scale: f64,
        on_page: impl Fn(DVec2) -> DVec2,
    ) {
        let circle = Incircle::of(&model.faces[face]);
        let sine = circle.normal.dot(model.view.towards);
        if sine < MIN_SINE || model.is_hidden(circle.centre, Some(face)) {
            return;
        }
        let cap = (0.5 * sine * circle.radius * scale).min(*NUMBER_CAP_MM.end());
        if cap < *NUMBER_CAP_MM.start() {
            return;
        }
        let along = circle.radius * model.up[face];
        let place = |share: f64| on_page(model.view.projected(circle.centre + share * along));
        self.centred(number.to_owned(), place(-0.15), cap);
        self.arrow(place(0.42), place(0.85), THIN_MM);
    }

    fn arrow(&mut self, from: DVec2, to: DVec2, width_mm: f64) {
        self.line(from, to, width_mm);
        let barb = (from - to).normalize_or_zero() * 1.8;
        for turn in [-0.45, 0.45] {
            self.line(to, to + DVec2::from_angle(turn).rotate(barb), width_mm);
        }
    }
}

/// Returns the height of the steps, mm.
fn height(steps: &[Vec<String>]) -> f64 {
    let lines: usize = steps.iter().map(Vec::len).sum();
    lines as f64 * LINE_SPACING_MM + steps.len() as f64 * STEP_SPACING_MM
}

/// Wraps text at spaces into lines of at most `most` characters.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Printing;
    use deltille_core::targets::{BoardSpec, SolidShape, SolidSpec};

    fn guide(spec: impl Into<TargetSpec>) -> SheetLayout {
        let target = Printing::new("target", spec).unwrap();
        sheet("target", &target.target, &target.sheets, &PaperSpec::default()).unwrap()
    }

    #[test]
    fn guides_fit_on_the_page_and_contain_the_steps() {
        let board = guide(BoardSpec::deltille(10, 11, 20.0));
        let solid = guide(SolidSpec::new(SolidShape::Cube));
        let bare = guide(SolidSpec { tags: None, ..SolidSpec::new(SolidShape::Cube) });
        for (sheet, words) in
            [(&board, "bubbles"), (&solid, "Score dashed"), (&bare, "distinguished")]
        {
            assert_eq!((sheet.width_mm, sheet.height_mm), (210.0, 297.0));
            let on_page =
                |p: DVec2| p.cmpge(DVec2::splat(5.0)).all() && p.x <= 205.0 && p.y <= 292.0;
            assert!(sheet.lines.iter().all(|line| on_page(line.from_mm) && on_page(line.to_mm)));
            let says = |words| sheet.texts.iter().any(|t| t.text.to_string().contains(words));
            assert!(says(words));
            // Bare faces cannot be labelled, so the guide must not propose that.
            let is_bare = std::ptr::eq(sheet, &bare);
            assert_eq!(says("deltille calibrate"), !is_bare);
            assert!(!(is_bare && says("deltille rig")));
        }
    }
}
