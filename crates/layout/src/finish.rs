//! How a target is printed where plain black on paper is not all: as its mirror image for the back of glass, and with
//! the spot colours that print shops tell special inks and cutters by.

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::{LineKind, Printing, SheetLayout, SheetLine};
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::{
    self, BoardTwoSidedMm, FinishContour, FinishWhite, PaperGuidePage, PaperPoster,
};
use deltille_core::targets::TargetError;

/// Width of the line to cut along, mm: the quarter of a point that print shops ask for.
const CONTOUR_MM: f64 = 0.1;

/// Most characters of the name of a spot colour.
const LONGEST_NAME: usize = 60;

/// Names that stand for something else than an ink of their own in a PDF (ISO 32000-1, 8.6.6.4), or for inks that are there
/// anyway.
const RESERVED: [&str; 6] = ["All", "None", "Cyan", "Magenta", "Yellow", "Black"];

/// How a target is printed. All positions in its description are those that are seen: on a mirrored one, through the
/// glass.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Finish {
    /// Whether pages, and drawings for a laser, are mirror images, to be looked at through what they are printed on.
    #[serde(default, skip_serializing_if = "is_false")]
    pub mirrored: bool,
    /// Name of the spot colour that lies beneath all of a page, such as `White`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub white: Option<String>,
    /// Name of the spot colour of lines to cut along, such as `CutContour`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contour: Option<String>,
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Finish {
    /// Whether it is black on paper, as everything is unless it is asked for otherwise.
    pub fn is_plain(&self) -> bool {
        *self == Self::default()
    }

    /// The spot colours, each with the setting that names it.
    pub fn spots(&self) -> impl Iterator<Item = (Setting, &str)> {
        let white = self.white.as_deref().map(|name| (FinishWhite, name));
        let contour = self.contour.as_deref().map(|name| (FinishContour, name));
        white.into_iter().chain(contour)
    }

    /// Checks the names; returns the setting at fault and what is wrong with it.
    pub(super) fn check(&self) -> Result<(), (Setting, String)> {
        for (setting, name) in self.spots() {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || " _-.".contains(c);
            let is_name =
                !name.is_empty() && name.len() <= LONGEST_NAME && name.chars().all(is_plain);
            if !is_name || name.trim() != name {
                let what = "is no name of a spot colour: give letters, digits, blanks, `_`, `-` and `.`, such as";
                return Err((setting, format!("`{name}` {what} RDG_WHITE or CutContour")));
            }
            if RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(name)) {
                let what = "stands for a process colour, or for all or none of them: give the name of an ink of its own";
                return Err((setting, format!("`{name}` {what}")));
            }
        }
        if self.white.is_some() && self.white == self.contour {
            let problem = "it is the name of the white, too: give another".to_owned();
            return Err((FinishContour, problem));
        }
        Ok(())
    }
}

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
