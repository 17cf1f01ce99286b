//! A print with its finish: lines to cut along are added, and what does not go together is refused.

use glam::DVec2;

use crate::{Finish, LineKind, Printing, SheetLayout, SheetLine};
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::{BoardTwoSidedMm, PaperGuidePage, PaperPoster};
use deltille_core::targets::TargetError;

/// Width of the line to cut along, mm: the quarter of a point that print shops ask for.
const CONTOUR_MM: f64 = 0.1;

impl Printing {
    /// The same target printed otherwise. A contour is a line to cut along in the middle of what the paper's margin leaves
    /// blank; where boards are to be cut apart, it is the lines for that, of a board with two sides the outline of its plate. `margin_mm` is that margin.
    ///
    /// # Errors
    /// When a name is none of a spot colour, a board is to be joined of several pages, there is a guide, or two sides are to be
    /// mirrored.
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
            let problem = "pages to be joined are neither mirrored nor printed in spot colours: take paper as large as the board";
            return Err(TargetError::invalid(PaperPoster, problem));
        }
        if !finish.is_plain() && self.sheets.iter().any(|sheet| sheet.placements.is_empty()) {
            let problem = "the guide is for paper, to be read as it is: make it with a plain print";
            return Err(TargetError::invalid(PaperGuidePage, problem));
        }
        if finish.mirrored && self.target.spec.two_sided_mm().is_some() {
            let problem = "each side is seen from its own front: leave the mirror image out";
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
                        // Instead of the marks at the plate's corners.
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

/// Adds lines to cut along in the middle of the margin, unless the sheet has such.
fn add_contour(sheet: &mut SheetLayout, margin_mm: f64) {
    if sheet.lines.iter().any(|line| line.kind == LineKind::Cut) {
        return;
    }
    let inset = margin_mm.max(super::placing::arrangement::LEAST_MARGIN_MM) / 2.0;
    let (right, upper) = (sheet.width_mm - inset, sheet.height_mm - inset);
    add_outline(sheet, rectangle([inset, inset, right, upper]));
}

/// Adds the sides of a rectangle as lines to cut along.
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
    fn names_of_inks_are_told_from_other_words() {
        let refused = |white: &str, contour: &str| {
            let [white, contour] = [white, contour].map(|name| Some(name.to_owned()));
            let board = Printing::new("board", BoardSpec::deltille(4, 5, 20.0)).unwrap();
            board.finished(Finish { mirrored: false, white, contour }, 5.0).unwrap_err().to_string()
        };
        assert!(refused("black", "CutContour").starts_with("`Finish::white`: `black` stands for"));
        assert!(refused("", "CutContour").starts_with("`Finish::white`: `` is no name"));
        assert!(refused("White", "a/b").starts_with("`Finish::contour`: `a/b` is no name"));
        assert!(refused("White", "White").starts_with("`Finish::contour`: it is the name of"));
    }
}
