//! Applies a finish to a print: adds cutting lines and rejects settings that conflict.

use glam::DVec2;

use crate::{Finish, LineKind, Printing, SheetLayout, SheetLine};
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::{BoardTwoSidedMm, PaperGuidePage, PaperPoster};
use deltille_core::targets::TargetError;

/// Width of a cutting line, mm: the quarter point that print shops ask for.
const CONTOUR_MM: f64 = 0.1;

impl Printing {
    /// Returns the same target with another finish. `margin_mm` is the margin of the paper. A contour becomes a cutting
    /// line in the middle of that margin. Packed boards keep the lines that separate them. A two-sided board gets the
    /// outline of its plate instead.
    ///
    /// # Errors
    /// Returns an error if a spot colour name is invalid, or if a two-sided board is to be
    /// mirrored. A finish that is not plain is also an error if a board spans several pages or the
    /// print has a guide page.
    ///
    /// ```
    /// use deltille_layout::{Finish, Printing};
    /// use deltille_core::targets::BoardSpec;
    ///
    /// let finish = Finish { mirrored: true, ..Finish::default() };
    /// let pane = Printing::new("pane", BoardSpec::deltille(4, 5, 20.0))?.finished(finish, 5.0)?;
    /// assert!(pane.to_json().contains("\"mirrored\": true"));
    /// # Ok::<(), deltille_core::targets::TargetError>(())
    /// ```
    pub fn finished(mut self, finish: Finish, margin_mm: f64) -> Result<Self, TargetError> {
        finish.check().map_err(|(setting, problem)| TargetError::invalid(setting, problem))?;
        if !finish.is_plain() && self.sheets.iter().any(|sheet| !sheet.pages.is_empty()) {
            let problem = "a board on several pages cannot be mirrored or printed in spot colours: use paper as large as the board";
            return Err(TargetError::invalid(PaperPoster, problem));
        }
        if !finish.is_plain() && self.sheets.iter().any(|sheet| sheet.placements.is_empty()) {
            let problem = "the guide page cannot be mirrored or printed in spot colours: add it to a print without these settings";
            return Err(TargetError::invalid(PaperGuidePage, problem));
        }
        if finish.mirrored && self.target.spec.two_sided_mm().is_some() {
            let problem = "a two-sided board cannot be mirrored, because each side is seen from its own front";
            return Err(TargetError::invalid(BoardTwoSidedMm, problem));
        }
        if finish.contour.is_some() {
            for sheet in &mut self.sheets {
                let side =
                    sheet.placements.first().filter(|_| self.target.spec.two_sided_mm().is_some());
                let side = side.and_then(|placed| {
                    let panel = self.target.panels.iter().find(|panel| panel.id == placed.panel)?;
                    Some((panel.field_mm(), *placed))
                });
                match side {
                    Some((field_mm, placed)) => {
                        // Replaces the marks at the corners of the plate.
                        sheet.lines.clear();
                        let corners = rectangle(field_mm);
                        add_outline(sheet, corners.map(|corner| placed.page_from_panel(corner)));
                    }
                    None => add_contour(sheet, margin_mm),
                }
            }
        }
        Ok(Self { finish, ..self })
    }
}

/// Adds cutting lines in the middle of the margin, unless the sheet already has cutting lines.
fn add_contour(sheet: &mut SheetLayout, margin_mm: f64) {
    if sheet.lines.iter().any(|line| line.kind == LineKind::Cut) {
        return;
    }
    let inset = margin_mm.max(super::placing::arrangement::MIN_MARGIN_MM) / 2.0;
    let (right, upper) = (sheet.width_mm - inset, sheet.height_mm - inset);
    add_outline(sheet, rectangle([inset, inset, right, upper]));
}

/// Adds the sides of a rectangle as cutting lines.
fn add_outline(sheet: &mut SheetLayout, corners: [DVec2; 4]) {
    let sides = corners.into_iter().zip(corners.into_iter().cycle().skip(1));
    sheet.lines.extend(sides.map(|(from_mm, to_mm)| SheetLine {
        kind: LineKind::Cut,
        from_mm,
        to_mm,
        width_mm: CONTOUR_MM,
    }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use deltille_core::targets::BoardSpec;

    #[test]
    fn invalid_ink_names_are_refused() {
        let refused = |white: &str, contour: &str| {
            let [white, contour] = [white, contour].map(|name| Some(name.to_owned()));
            let board = Printing::new("board", BoardSpec::deltille(4, 5, 20.0)).unwrap();
            board.finished(Finish { mirrored: false, white, contour }, 5.0).unwrap_err().to_string()
        };
        assert!(
            refused("black", "CutContour").starts_with("`Finish::white`: `black` is reserved for")
        );
        assert!(refused("", "CutContour").starts_with("`Finish::white`: `` is not a valid"));
        assert!(refused("White", "a/b").starts_with("`Finish::contour`: `a/b` is not a valid"));
        assert!(
            refused("White", "White").starts_with("`Finish::contour`: this name is already used")
        );
    }
}
