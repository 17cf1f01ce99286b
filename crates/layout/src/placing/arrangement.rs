//! Arrangement of a board, its label and its check bars on a page.
//!
//! ```text
//!   ┌────────────────────────────────┐
//!   │  ▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲      ┬  │   The board is centred on the page, unless a mark would then
//!   │  ▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲      │  │   enter its quiet zone. Check bars run along the lower and the
//!   │  ▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲      │  │   right margin, with their texts between the ends. The label
//!   │0 ▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲▲      │  │   lies below the lower bar, or beside the right one if the board
//!   │  ├────── 180 mm ──────┤     ┴  │   fits only then. The id of the board is printed in large type if
//!   │  name · 10 × 11 corners · …    │   there is room.
//!   └────────────────────────────────┘
//! ```

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::margin_marks::{
    ADVANCE_CAPS, BAR_CAP_MM, BAR_INDENT_MM, LABEL_CAP_MM, Marks, Strip, bar_words,
};
use crate::marks::logo::LogoPlacement;
use crate::marks::logo_room::LogoSize;
use crate::paper::{Orientation, PaperSize, PaperSpec};
use crate::{CheckBar, Label, LineKind, Placement, SheetLayout, SheetLine, SheetText};
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::PaperMarginMm;
use deltille_core::targets::format_mm;
use deltille_core::targets::size_mm;
use deltille_core::targets::{BoardSpec, Panel, TargetError};

/// Capital height of a board's id, mm: legible from three metres. The second value is the smallest height that is
/// printed.
const LARGE_CAP_MM: f64 = 8.0;
const MIN_LARGE_CAP_MM: f64 = 4.0;
/// Gaps between a bar, its text and the label, mm. The first value that leaves room for the board is used. The second
/// is what 10 × 11 corners with 20 mm edges leave on A4.
const GAPS_MM: [f64; 2] = [1.5, 0.8];
/// Gap between the black field of an inverted board and the marks, mm.
const FIELD_GAP_MM: f64 = 1.0;
/// Distances from the corner of a plate at which its crop marks begin and end, mm.
const CROP_MM: [f64; 2] = [1.0, 5.0];
/// Width of crop marks, mm.
const CROP_WIDTH_MM: f64 = 0.15;
/// Smallest blank strip along the edges of the paper, mm, even with a smaller margin. A pixel at 200 dpi is 0.13 mm,
/// and the stroke of a bar that touches the edge can be neither measured nor trimmed.
pub(crate) const MIN_MARGIN_MM: f64 = 0.5;
/// Smallest edge length proposed to make a board fit, mm. Below it, office printers do not resolve
/// the cells of a tag.
const MIN_PROPOSED_MM: u32 = 5;

/// Bounding rectangle of a panel's ink, and the blank space it needs, mm.
pub(crate) struct Footprint {
    pub width: f64,
    pub height: f64,
    /// Minimum distance to the edges of the paper.
    pub edge_blank: f64,
    /// Minimum distance to the marks.
    pub mark_blank: f64,
    /// Whether the panel must stand upright, centred horizontally, so that the two sides of a sheet match.
    pub is_centred: bool,
}

impl Footprint {
    pub(crate) fn new(spec: &BoardSpec, margin_mm: f64) -> Self {
        let DVec2 { x: width, y: height } = size_mm(spec);
        let quiet = Panel::quiet_zone_at_mm(spec.edge_mm);
        let is_centred = spec.two_sided_mm.is_some();
        let crop_mm = if is_centred { CROP_MM[1] } else { 0.0 };
        if spec.inverted {
            let (width, height) = (width + 2.0 * quiet, height + 2.0 * quiet);
            let (edge_blank, mark_blank) = (margin_mm + crop_mm, FIELD_GAP_MM + crop_mm);
            return Self { width, height, edge_blank, mark_blank, is_centred };
        }
        let (edge_blank, mark_blank) = (margin_mm.max(quiet + crop_mm), quiet + crop_mm);
        Self { width, height, edge_blank, mark_blank, is_centred }
    }
}

/// Arrangement of a sheet before its panel is known: page size and positions.
#[derive(Clone, Copy)]
pub(crate) struct Arrangement {
    page: DVec2,
    margin: f64,
    /// Whether the board is rotated by 90° counter-clockwise.
    turned: bool,
    /// Lower-left corner of the footprint.
    board_at: DVec2,
    /// Marks along the lower and the right margin.
    marks: [Marks; 2],
    /// Space between these margins and the blank around the footprint.
    rooms: [f64; 2],
    /// Requested size of the logo, if any.
    logo: Option<LogoSize>,
}

/// Fits a board on paper. Preferences, in order: the smallest paper (if the size is free), the orientation of the
/// board's longer side, the unrotated board, the label below.
pub(crate) fn arrange(spec: &BoardSpec, paper: &PaperSpec) -> Result<Arrangement, TargetError> {
    let fitting = |spec: &BoardSpec| fit(&Footprint::new(spec, paper.margin_mm), paper);
    let fits = |smaller: &BoardSpec| fitting(smaller).is_ok_and(|found| found.is_some());
    fitting(spec)?.ok_or_else(|| does_not_fit(spec, paper, fits))
}

/// Returns the error for a board that does not fit on the paper. It proposes the largest edge length that `fits`.
pub(crate) fn does_not_fit(
    spec: &BoardSpec,
    paper: &PaperSpec,
    fits: impl Fn(&BoardSpec) -> bool,
) -> TargetError {
    TargetError::DoesNotFit {
        rows: spec.rows,
        cols: spec.cols,
        edge: format_mm(spec.edge_mm),
        paper: match (&paper.size, paper.orientation) {
            (None, _) => "even A0".to_owned(),
            (Some(size), Orientation::Auto) => size.to_string(),
            (Some(size), Orientation::Portrait) => format!("{size} portrait"),
            (Some(size), Orientation::Landscape) => format!("{size} landscape"),
        },
        packed: paper.packed,
        fitting_edge_mm: (MIN_PROPOSED_MM..=spec.edge_mm.ceil() as u32)
            .rev()
            .find(|&mm| fits(&BoardSpec { edge_mm: f64::from(mm), ..spec.clone() })),
    }
}

/// Fits a footprint on paper; `None` if it does not fit.
pub(crate) fn fit(
    footprint: &Footprint,
    paper: &PaperSpec,
) -> Result<Option<Arrangement>, TargetError> {
    let rotations: &[bool] = if footprint.is_centred { &[false] } else { &[false, true] };
    fit_turned(footprint, paper, rotations)
}

/// Fits a footprint on paper without rotation; `None` if it does not fit.
pub(crate) fn fit_upright(
    footprint: &Footprint,
    paper: &PaperSpec,
) -> Result<Option<Arrangement>, TargetError> {
    fit_turned(footprint, paper, &[false])
}

fn fit_turned(
    footprint: &Footprint,
    paper: &PaperSpec,
    rotations: &[bool],
) -> Result<Option<Arrangement>, TargetError> {
    let margin = check_margin(paper)?;
    let sizes = paper.sizes();
    let fitting = |size| on_size(footprint, size, paper.orientation, margin, rotations);
    let found: Option<Arrangement> = sizes.iter().find_map(fitting);
    Ok(found.map(|arrangement| arrangement.with_logo(paper)))
}

/// Returns the requested margin, mm, but at least the minimum.
pub(crate) fn check_margin(paper: &PaperSpec) -> Result<f64, TargetError> {
    let margin = paper.margin_mm;
    if !(0.0..=100.0).contains(&margin) {
        let problem = format!("{} is not between 0 mm and 100 mm", format_mm(margin));
        return Err(TargetError::invalid(PaperMarginMm, problem));
    }
    Ok(margin.max(MIN_MARGIN_MM))
}

/// Fits a board on one size of paper.
fn on_size(
    footprint: &Footprint,
    size: &PaperSize,
    orientation: Orientation,
    margin: f64,
    rotations: &[bool],
) -> Option<Arrangement> {
    let (portrait, landscape) = (size.portrait_mm(), size.landscape_mm());
    let pages = match orientation {
        Orientation::Portrait => vec![portrait],
        Orientation::Landscape => vec![landscape],
        Orientation::Auto if footprint.width < footprint.height => vec![portrait, landscape],
        Orientation::Auto => vec![landscape, portrait],
    };
    rotations
        .iter()
        .find_map(|&turned| pages.iter().find_map(|&page| on_page(footprint, page, margin, turned)))
}

/// Fits a board on one page.
pub(crate) fn on_page(
    footprint: &Footprint,
    page: DVec2,
    margin: f64,
    turned: bool,
) -> Option<Arrangement> {
    let Footprint { width, height, edge_blank, mark_blank, is_centred } = *footprint;
    let board = if turned { DVec2::new(height, width) } else { DVec2::new(width, height) };
    // The widest gaps that leave room along one axis, with or without the label there.
    let widest = |axis: usize, label: bool| {
        let outside = edge_blank + margin + mark_blank;
        let room = page[axis] - outside - board[axis];
        GAPS_MM.into_iter().map(|gap| Marks { label, gap }).find(|marks| marks.depth() <= room)
    };
    [true, false].into_iter().find_map(|label_below| {
        let (lower, right) = (widest(1, label_below)?, widest(0, !label_below)?);
        let middle = (page - board) / 2.0;
        let right_end = page.x - margin - right.depth() - mark_blank - board.x;
        let lower_end = margin + lower.depth() + mark_blank;
        if is_centred && right_end < middle.x {
            return None;
        }
        let board_at = DVec2::new(middle.x.min(right_end), middle.y.max(lower_end));
        let right_room = page.x - margin - mark_blank - board.x - board_at.x;
        let rooms = [board_at.y - margin - mark_blank, right_room];
        let marks = [lower, right];
        Some(Arrangement { page, margin, turned, board_at, marks, rooms, logo: None })
    })
}

impl Arrangement {
    /// Returns the arrangement with the logo of the paper.
    pub(crate) fn with_logo(self, paper: &PaperSpec) -> Self {
        Self { logo: LogoSize::of(paper), ..self }
    }

    /// Returns the sheet of one panel, whose `ink` is a rectangle in the panel frame. An empty rectangle means that
    /// other content fills the sheet up to its margin strips.
    pub(crate) fn sheet(&self, panel: u32, ink: [f64; 4], label: String) -> SheetLayout {
        let DVec2 { x: width_mm, y: height_mm } = self.page;
        let [lower_marks, right_marks] = self.marks;
        let corner = right_marks.depth() + right_marks.gap;
        let mut lower = Strip {
            start: DVec2::splat(self.margin),
            turned: false,
            length: width_mm - 2.0 * self.margin - corner,
        };
        let mut right = Strip {
            start: DVec2::new(width_mm - self.margin, self.margin),
            turned: true,
            length: height_mm - 2.0 * self.margin,
        };
        let logo = self.logo.map(|size| {
            let (strip, marks, room) = match lower_marks.label {
                true => (&mut lower, lower_marks, self.rooms[0]),
                false => (&mut right, right_marks, self.rooms[1]),
            };
            let deep = marks.depth();
            let most = if ink[0] < ink[2] { room.max(deep) } else { deep };
            let words = label.chars().count() as f64 * ADVANCE_CAPS * LABEL_CAP_MM;
            let room = [strip.length, words];
            let DVec2 { x: width, y: height_mm } = size.in_strip(room, deep, most);
            let (at_mm, angle_rad) = (strip.at(strip.length - width, 0.0), strip.angle());
            strip.length -= LogoSize::taken(width);
            LogoPlacement { at_mm, angle_rad, height_mm }
        });
        let strips = [(lower, lower_marks), (right, right_marks)];
        let label = strips.iter().filter(|(_, marks)| marks.label).map(|(strip, _)| SheetText {
            text: Label::Words(label.clone()),
            at_mm: strip.at(0.0, Marks::LABEL),
            angle_rad: strip.angle(),
            cap_height_mm: LABEL_CAP_MM,
            max_width_mm: strip.length,
        });
        let words = strips.iter().map(|(strip, marks)| SheetText {
            text: Label::Words(bar_words(strip.bar_mm())),
            at_mm: strip.at(BAR_INDENT_MM, marks.words()),
            angle_rad: strip.angle(),
            cap_height_mm: BAR_CAP_MM,
            max_width_mm: strip.bar_mm() - 2.0 * BAR_INDENT_MM,
        });
        let bars = strips.iter().map(|(strip, marks)| CheckBar {
            from_mm: strip.at(0.0, marks.line()),
            to_mm: strip.at(strip.bar_mm(), marks.line()),
        });
        let (texts, check_bars) = (label.chain(words).collect(), bars.collect());
        SheetLayout {
            width_mm,
            height_mm,
            placements: vec![self.placement(panel, ink)],
            lines: Vec::new(),
            check_bars,
            texts,
            logos: logo.into_iter().collect(),
            pages: Vec::new(),
        }
    }

    /// Lays out the id of a board in large type beside its lower-left corner, upright relative to the board. It
    /// identifies the board and its orientation from several metres away. Returns `None` if it does not fit. `ink` is a
    /// rectangle in the board frame.
    pub(crate) fn large_id(&self, spec: &BoardSpec, id: u32, ink: [f64; 4]) -> Option<SheetText> {
        let placement = self.placement(id, ink);
        let [left, lower, right, upper] = self.clear_mm();
        let corners = [DVec2::new(left, lower), DVec2::new(right, upper)];
        let [a, b] = corners.map(|corner| placement.panel_from_page(corner));
        let clear = a.min(b);
        let blank = Footprint::new(spec, self.margin).mark_blank;
        let text = id.to_string();
        let caps_wide = ADVANCE_CAPS * text.len() as f64;
        let cap_in = |room: f64, caps: f64| {
            let cap = (room / caps).min(LARGE_CAP_MM);
            (cap >= MIN_LARGE_CAP_MM).then_some(cap)
        };
        let end = DVec2::new(ink[0], ink[1]) - blank;
        let beside = cap_in(end.x - clear.x, caps_wide)
            .map(|cap| (cap, DVec2::new(end.x - caps_wide * cap, ink[1])));
        let below = cap_in(end.y - clear.y, 1.0).map(|cap| (cap, DVec2::new(ink[0], end.y - cap)));
        let places = below.into_iter().chain(beside);
        let (cap_height_mm, at) = places.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(SheetText {
            text: Label::Words(text),
            at_mm: placement.page_from_panel(at),
            angle_rad: placement.angle_rad,
            cap_height_mm,
            max_width_mm: caps_wide * cap_height_mm,
        })
    }

    /// Returns whether a line of text overlaps the logo of its sheet.
    pub(crate) fn logo_meets(&self, sheet: &SheetLayout, text: &SheetText) -> bool {
        let box_of = |at: DVec2, angle_rad: f64, size: DVec2| {
            let turn = DVec2::from_angle(angle_rad);
            let end = at + turn.rotate(size);
            [at.min(end), at.max(end)]
        };
        let size = DVec2::new(text.max_width_mm, text.cap_height_mm);
        let words = box_of(text.at_mm, text.angle_rad, size);
        let width = self.logo.map_or(0.0, LogoSize::width);
        sheet.logos.iter().any(|logo| {
            let size = logo.height_mm * DVec2::new(width, 1.0);
            let [least, most] = box_of(logo.at_mm, logo.angle_rad, size);
            words[0].cmplt(most).all() && words[1].cmpgt(least).all()
        })
    }

    /// Returns crop marks at the corners of a plate, a rectangle in the board frame. They serve for cutting out the
    /// sheet and for aligning the two sides.
    pub(crate) fn crop_marks(&self, panel: u32, ink: [f64; 4], plate: [f64; 4]) -> Vec<SheetLine> {
        let placement = self.placement(panel, ink);
        let corners = rectangle(plate);
        let middle = (corners[0] + corners[2]) / 2.0;
        let marks = corners.into_iter().flat_map(|corner| {
            let out = (corner - middle).signum();
            [DVec2::X, DVec2::Y]
                .map(|axis| CROP_MM.map(|mm| placement.page_from_panel(corner + mm * out * axis)))
        });
        let line = |[from_mm, to_mm]: [DVec2; 2]| SheetLine {
            kind: LineKind::Align,
            from_mm,
            to_mm,
            width_mm: CROP_WIDTH_MM,
        };
        marks.map(line).collect()
    }

    /// Returns the width and height of the page, mm.
    pub(crate) fn page_mm(&self) -> DVec2 {
        self.page
    }

    /// Returns the lower-left corner of the footprint on the page, mm.
    pub(crate) fn footprint_at_mm(&self) -> DVec2 {
        self.board_at
    }

    /// Returns the area that the margins and the marks leave free: left, lower, right and upper end, mm.
    pub(crate) fn clear_mm(&self) -> [f64; 4] {
        let [lower, right] = self.marks.map(Marks::depth);
        let margin = self.margin;
        [margin, margin + lower, self.page.x - margin - right, self.page.y - margin]
    }

    fn placement(&self, panel: u32, [left, lower, _, upper]: [f64; 4]) -> Placement {
        if self.turned {
            // (u, v) of the panel maps to (−v, u), so its upper end lies on the left.
            let origin_mm = self.board_at + DVec2::new(upper, -left);
            return Placement { panel, angle_rad: FRAC_PI_2, origin_mm };
        }
        let origin_mm = self.board_at - DVec2::new(left, lower);
        Placement { panel, angle_rad: 0.0, origin_mm }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Printing;
    use crate::placing::margin_marks::{BAR_STEP_MM, CHECK_BAR_STROKE_MM};
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{TargetSpec, least_untagged_corners};

    fn spec(rows: u32, cols: u32, edge_mm: f64) -> BoardSpec {
        BoardSpec { tags: None, ..BoardSpec::new(GridKind::Deltille, rows, cols, edge_mm) }
    }

    fn build(spec: &BoardSpec, paper: &PaperSpec) -> Result<Printing, TargetError> {
        Printing::build("board", &TargetSpec::Board(spec.clone()), None, Some(paper))
    }

    fn on(size: &str, orientation: Orientation) -> PaperSpec {
        PaperSpec { size: Some(size.parse().unwrap()), orientation, ..PaperSpec::default() }
    }

    /// Page rectangle of a placed panel's ink.
    fn ink(target: &Printing) -> [f64; 4] {
        let (panel, placement) = (&target.target.panels[0], &target.sheets[0].placements[0]);
        let [left, lower, right, upper] =
            if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
        let corners = [DVec2::new(left, lower), DVec2::new(right, upper)];
        let [a, b] = corners.map(|corner| placement.page_from_panel(corner));
        let (least, most) = (a.min(b), a.max(b));
        [least.x, least.y, most.x, most.y]
    }

    #[test]
    fn the_published_board_fits_a4_and_letter_at_20_mm() {
        for size in ["A4", "letter"] {
            let target = build(&spec(10, 11, 20.0), &on(size, Orientation::Auto)).unwrap();
            let sheet = &target.sheets[0];
            assert!(sheet.width_mm > sheet.height_mm);
            let lengths = sheet.check_bars.iter().map(CheckBar::length_mm);
            assert!(lengths.into_iter().all(|mm| mm >= 190.0), "{:?}", sheet.check_bars);
        }
        let automatic = build(&spec(10, 11, 20.0), &PaperSpec::default()).unwrap();
        assert_eq!((automatic.sheets[0].width_mm, automatic.sheets[0].height_mm), (297.0, 210.0));
    }

    #[test]
    fn boards_are_rotated_to_match_the_orientation() {
        let target = build(&spec(10, 11, 20.0), &on("A4", Orientation::Portrait)).unwrap();
        assert_eq!((target.sheets[0].width_mm, target.sheets[0].height_mm), (210.0, 297.0));
        assert_eq!(target.sheets[0].placements[0].angle_rad, FRAC_PI_2);
    }

    #[test]
    fn boards_that_do_not_fit_are_refused_with_an_edge_that_fits() {
        let paper = on("A4", Orientation::Auto);
        let error = build(&spec(10, 11, 30.0), &paper).unwrap_err();
        assert!(error.to_string().contains("`BoardSpec::edge_mm` of at most 20 mm"), "{error}");
        assert!(build(&spec(10, 11, 20.0), &paper).is_ok());
        let error = build(&spec(200, 300, 30.0), &PaperSpec::default()).unwrap_err();
        assert!(error.to_string().contains("even A0"), "{error}");
    }

    proptest! {
        /// Ink stays clear of the margin, and marks stay clear of the quiet zone and of each other.
        #[test]
        fn nothing_overlaps(
            rows in 2u32..20, cols in 2u32..20, edge in 5.0f64..40.0, margin in 0.0f64..20.0,
            inverted: bool, orientation in 0usize..3, checker: bool,
        ) {
            use Orientation::{Auto, Landscape, Portrait};
            let grid = if checker { GridKind::Checker } else { GridKind::Deltille };
            // Smaller boards need tags to be distinguished from texture.
            prop_assume!(rows * cols >= least_untagged_corners(grid));
            let spec = BoardSpec { grid, inverted, ..spec(rows, cols, edge) };
            let orientation = [Auto, Landscape, Portrait][orientation];
            let paper = PaperSpec { orientation, margin_mm: margin, ..PaperSpec::default() };
            let target = match build(&spec, &paper) {
                Ok(target) => target,
                Err(TargetError::DoesNotFit { fitting_edge_mm, .. }) => {
                    // Only ink wider than A0 minus its margins does not fit; a much smaller edge does.
                    let across = [edge * f64::from(cols), 0.86 * edge * f64::from(rows)];
                    prop_assert!(across.iter().any(|&mm| mm > 600.0), "{across:?} do not fit A0");
                    prop_assert!(fitting_edge_mm.is_none_or(|mm| f64::from(mm) < edge));
                    return Ok(());
                }
                Err(error) => return Err(TestCaseError::fail(error.to_string())),
            };
            let sheet = &target.sheets[0];
            let [left, lower, right, upper] = ink(&target);
            let margin = margin.max(MIN_MARGIN_MM);
            let edge_blank = if inverted { margin } else { margin.max(target.target.panels[0].quiet_zone_mm()) };
            let mark_blank = if inverted { FIELD_GAP_MM } else { target.target.panels[0].quiet_zone_mm() };
            let slack = 1e-9;
            prop_assert!(left >= edge_blank - slack && upper <= sheet.height_mm - edge_blank + slack);
            let [below, beside] = &sheet.check_bars[..] else { panic!("two bars") };
            prop_assert!(below.from_mm.y + (CHECK_BAR_STROKE_MM / 2.0) + mark_blank <= lower + slack);
            prop_assert!(beside.from_mm.x - (CHECK_BAR_STROKE_MM / 2.0) - mark_blank >= right - slack);
            prop_assert!(below.to_mm.x < beside.to_mm.x - (CHECK_BAR_STROKE_MM / 2.0));
            for (bar, axis) in [(below, 0), (beside, 1)] {
                let size = [sheet.width_mm, sheet.height_mm][axis];
                prop_assert!(bar.from_mm[axis] >= margin - slack && bar.to_mm[axis] <= size - margin + slack);
                prop_assert!(bar.length_mm() % BAR_STEP_MM < 1e-9 || bar.length_mm() % BAR_STEP_MM > BAR_STEP_MM - 1e-9);
            }
            for text in &sheet.texts {
                prop_assert!(text.at_mm.min_element() >= margin - slack, "{text:?} in a margin of {margin}");
            }
        }
    }
}
