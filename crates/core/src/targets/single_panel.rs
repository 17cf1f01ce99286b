//! The sheet of a target that is one panel, in the middle of the smallest paper that takes it.

use super::layout::{Footprint, fit};
use super::length::format_mm;
use super::paper::PaperSpec;
use super::{Panel, SheetLayout, TargetError};

/// Finest size that is proposed to make a target fit, mm: what office printers resolve.
const LEAST_PROPOSED_MM: u32 = 5;

/// A panel whose size is given by one length.
pub(super) struct SinglePanel<'a> {
    /// The panel for any such length, mm.
    pub of_size: &'a dyn Fn(f64) -> Panel,
    /// The length asked for, mm.
    pub size_mm: f64,
    /// The field that sets it.
    pub setting: &'static str,
    /// What else would make it fit, such as fewer squares.
    pub fewer: &'static str,
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

    /// Why it cannot be printed, and what would do.
    fn too_large(&self, paper: &PaperSpec) -> TargetError {
        let size = format_mm(self.size_mm);
        let on = paper.size.as_ref().map_or("even A0".to_owned(), ToString::to_string);
        let fits = |mm: &u32| {
            fit(&self.footprint(f64::from(*mm), paper), paper).is_ok_and(|found| found.is_some())
        };
        let smaller = match (LEAST_PROPOSED_MM..self.size_mm.ceil() as u32).rev().find(fits) {
            Some(mm) => format!("`{}` of at most {mm} mm", self.setting),
            None => "a smaller `PaperSpec::margin_mm`".to_owned(),
        };
        let problem = format!(
            "with {size} the target and what is printed around it do not fit {on}: take larger paper, {}, or {smaller}",
            self.fewer
        );
        TargetError::invalid("PaperSpec::size", problem)
    }
}

/// Lays a panel out with its label and check bars.
pub(super) fn sheet(
    single: &SinglePanel,
    paper: &PaperSpec,
    label: String,
) -> Result<SheetLayout, TargetError> {
    let arrangement = fit(&single.footprint(single.size_mm, paper), paper)?;
    let arrangement = arrangement.ok_or_else(|| single.too_large(paper))?;
    let panel = (single.of_size)(single.size_mm);
    Ok(arrangement.sheet(panel.id, panel.bounds_mm(), label))
}
