//! Sheets of ChArUco boards, AprilGrids and circles: the panel in the middle of the smallest paper that fits it.

use super::arrangement::{Footprint, fit};
use super::sheet_label::{imprint, tag_range};
use crate::SheetLayout;
use crate::paper::PaperSpec;
use deltille_core::setting::Setting::{
    self, AprilGridTagMm, AprilGridTags, CharucoSquareMm, CharucoSquares, CirclesCircles,
    CirclesSpacingMm, PaperMarginMm, PaperSize,
};
use deltille_core::targets::format_mm;
use deltille_core::targets::{
    AprilGridSpec, CharucoSpec, CirclesSpec, Panel, Target, TargetError, TargetSpec, fingerprint,
};

/// Smallest size proposed to make a target fit, mm: the smallest that office printers resolve.
const MIN_PROPOSED_MM: u32 = 5;

/// A panel whose size is determined by one length.
struct SinglePanel<'a> {
    /// Builds the panel for a given length, mm.
    of_size: &'a dyn Fn(f64) -> Panel,
    /// Requested length, mm.
    size_mm: f64,
    /// Setting of that length.
    setting: Setting,
    /// Setting whose reduction would also make the panel fit, such as the number of squares.
    fewer: Setting,
}

impl SinglePanel<'_> {
    fn footprint(&self, size_mm: f64, paper: &PaperSpec) -> Footprint {
        let panel = (self.of_size)(size_mm);
        let [left, lower, right, upper] = panel.bounds_mm();
        let quiet = panel.quiet_zone_mm();
        Footprint {
            width: right - left,
            height: upper - lower,
            edge_blank: paper.margin_mm.max(quiet),
            mark_blank: quiet,
            is_centred: false,
        }
    }

    /// Returns the error for a panel that does not fit, with a proposal.
    fn too_large(&self, paper: &PaperSpec) -> TargetError {
        let size = format_mm(self.size_mm);
        let on = paper.size.as_ref().map_or("even A0".to_owned(), ToString::to_string);
        let fits = |mm: &u32| {
            fit(&self.footprint(f64::from(*mm), paper), paper).is_ok_and(|found| found.is_some())
        };
        let smaller = match (MIN_PROPOSED_MM..self.size_mm.ceil() as u32).rev().find(fits) {
            Some(mm) => format!("{} of at most {mm} mm", self.setting),
            None => format!("a smaller {PaperMarginMm}"),
        };
        let problem = format!(
            "with {size}, the target and its marks do not fit {on}: use larger paper, fewer {}, or {smaller}",
            self.fewer
        );
        TargetError::invalid(PaperSize, problem)
    }
}

/// Lays out the sheet of a ChArUco board, an AprilGrid or circles; returns no sheet for other targets.
pub(crate) fn sheets(
    title: &str,
    target: &Target,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let Target { spec, panels, family, .. } = target;
    let imprint = imprint(fingerprint(panels, family.as_ref()));
    let family = family.as_ref().map_or("", |family| family.name.as_str());
    let sheet = match spec {
        TargetSpec::Charuco(spec) => {
            let dimension = spec.check()?;
            let of_size = |square_mm| {
                let marker_mm = spec.marker_mm * square_mm / spec.square_mm;
                CharucoSpec { square_mm, marker_mm, ..spec.clone() }.panel(dimension)
            };
            let (setting, fewer) = (CharucoSquareMm, CharucoSquares);
            let single = SinglePanel { of_size: &of_size, size_mm: spec.square_mm, setting, fewer };
            sheet(&single, paper, charuco_label(title, spec, family, imprint))?
        }
        TargetSpec::AprilGrid(spec) => {
            let of_size = |tag_mm| AprilGridSpec { tag_mm, ..spec.clone() }.panel();
            let (setting, fewer) = (AprilGridTagMm, AprilGridTags);
            let single = SinglePanel { of_size: &of_size, size_mm: spec.tag_mm, setting, fewer };
            sheet(&single, paper, aprilgrid_label(title, spec, family, imprint))?
        }
        TargetSpec::Circles(spec) => {
            let of_size = |spacing_mm| {
                let diameter_mm = spec.diameter_mm * spacing_mm / spec.spacing_mm;
                CirclesSpec { spacing_mm, diameter_mm, ..spec.clone() }.panel()
            };
            let (setting, fewer) = (CirclesSpacingMm, CirclesCircles);
            let single =
                SinglePanel { of_size: &of_size, size_mm: spec.spacing_mm, setting, fewer };
            sheet(&single, paper, circles_label(title, spec, imprint))?
        }
        _ => return Ok(Vec::new()),
    };
    Ok(vec![sheet])
}

/// Lays out a panel with its label and check bars.
fn sheet(
    single: &SinglePanel,
    paper: &PaperSpec,
    label: String,
) -> Result<SheetLayout, TargetError> {
    let arrangement = fit(&single.footprint(single.size_mm, paper), paper)?;
    let arrangement = arrangement.ok_or_else(|| single.too_large(paper))?;
    let panel = (single.of_size)(single.size_mm);
    Ok(arrangement.sheet(panel.id, panel.bounds_mm(), label))
}

/// Returns the label, with everything needed to reproduce the target.
fn charuco_label(title: &str, spec: &CharucoSpec, family: &str, imprint: String) -> String {
    let [columns, rows] = spec.squares;
    let last = spec.first_id + spec.markers() - 1;
    let mut parts = vec![
        title.to_owned(),
        format!("ChArUco {columns} × {rows} squares"),
        format!("square {}", format_mm(spec.square_mm)),
        format!("marker {}", format_mm(spec.marker_mm)),
        tag_range(family, spec.first_id, last),
    ];
    if spec.legacy {
        parts.push("legacy pattern".to_owned());
    }
    parts.push(format!("board {}", spec.board_id));
    parts.push(imprint);
    parts.join(" · ")
}

/// Returns the label, with everything needed to reproduce the target.
fn aprilgrid_label(title: &str, spec: &AprilGridSpec, family: &str, imprint: String) -> String {
    let [columns, rows] = spec.tags;
    let last = spec.first_id + spec.count() - 1;
    let parts = [
        title.to_owned(),
        format!("AprilGrid {columns} × {rows} tags"),
        format!("tagSize {}", format_mm(spec.tag_mm)),
        format!("tagSpacing {}", spec.gap),
        tag_range(family, spec.first_id, last),
        format!("border {} bits", spec.border_bits),
        format!("board {}", spec.board_id),
        imprint,
    ];
    parts.join(" · ")
}

/// Returns the label, with everything needed to reproduce the target.
fn circles_label(title: &str, spec: &CirclesSpec, imprint: String) -> String {
    let [columns, rows] = spec.circles;
    let kind = if spec.asymmetric { "asymmetric circles" } else { "circles" };
    let parts = [
        title.to_owned(),
        format!("{columns} × {rows} {kind}"),
        format!("spacing {}", format_mm(spec.spacing_mm)),
        format!("diameter {}", format_mm(spec.diameter_mm)),
        format!("board {}", spec.board_id),
        imprint,
    ];
    parts.join(" · ")
}
