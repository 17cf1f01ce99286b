//! Reading and writing of the target file with its sheets (`docs/formats.md`, “Target”). Reading checks every field.

use std::collections::BTreeSet;

use glam::DVec2;

use crate::{Printing, SheetLayout};
use deltille_core::setting::Setting;
use deltille_core::targets::TargetFileError;
use deltille_core::targets::json;
use deltille_core::targets::json::Printed;
use deltille_core::targets::{Problem, problem};

/// Longest side of a sheet, mm: larger than any paper and than the net of any supported solid.
const LONGEST_SHEET_MM: f64 = 20_000.0;

impl Printing {
    /// Parses the text of a target file.
    ///
    /// # Errors
    /// Returns an error if the text is not a target file, has another version, or contains an invalid field.
    pub fn from_json(text: &str) -> Result<Self, TargetFileError> {
        let (target, Printed { sheets, finish, logo }) = json::read(text)?;
        let finish = finish.unwrap_or_default();
        let printing = Self { target, sheets, finish, logo };
        check(&printing)?;
        Ok(printing)
    }

    /// Returns the text of the target file, with one corner per line.
    ///
    /// ```
    /// use deltille_layout::Printing;
    /// use deltille_core::targets::{SolidShape, SolidSpec};
    ///
    /// let solid = Printing::new("ico", SolidSpec::new(SolidShape::Icosahedron))?;
    /// assert_eq!(Printing::from_json(&solid.to_json())?, solid);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to_json(&self) -> String {
        let Self { target, sheets, finish, logo } = self;
        let finish = (!finish.is_plain()).then_some(finish);
        json::write(
            target,
            Printed { sheets: sheets.iter().collect(), finish, logo: logo.as_ref() },
        )
    }
}

/// Checks the constraints that the types do not express. Returns the invalid field and the reason.
fn check(printing: &Printing) -> Result<(), Problem> {
    let panels: BTreeSet<u32> = printing.target.panels.iter().map(|panel| panel.id).collect();
    let named = |setting: Setting| {
        let path = setting.path();
        let field = path.rsplit_once(':').map_or(path, |(_, field)| field);
        format!("finish.{field}")
    };
    printing.finish.check().or_else(|(setting, what)| problem(named(setting), what))?;
    for (s, sheet) in printing.sheets.iter().enumerate() {
        check_sheet(sheet, printing, &format!("sheets[{s}]"))?;
        for (p, page) in sheet.pages.iter().enumerate() {
            let field = format!("sheets[{s}].pages[{p}]");
            check_sheet(&page.marks, printing, &format!("{field}.marks"))?;
            if !page.marks.placements.is_empty() || !page.marks.pages.is_empty() {
                let what =
                    "a page must not have panels or pages of its own: they belong to its sheet";
                return problem(format!("{field}.marks"), what);
            }
            let [left, lower, right, upper] = page.window_mm;
            let [width, height] = [page.marks.width_mm, page.marks.height_mm];
            let on_page = 0.0 <= left && left < right && right <= width;
            if !(on_page && 0.0 <= lower && lower < upper && upper <= height) {
                return problem(format!("{field}.window_mm"), "the window extends beyond the page");
            }
        }
        if let Some(placed) = sheet.placements.iter().find(|p| !panels.contains(&p.panel)) {
            let what = format!("no panel has id {}", placed.panel);
            return problem(format!("sheets[{s}].placements"), what);
        }
    }
    Ok(())
}

/// Checks the size of a sheet, that its lines lie within it, and that the file contains a logo if the sheet places one.
fn check_sheet(sheet: &SheetLayout, printing: &Printing, field: &str) -> Result<(), Problem> {
    let sides = [("width_mm", sheet.width_mm), ("height_mm", sheet.height_mm)];
    if let Some((side, _)) = sides.iter().find(|(_, mm)| *mm <= 0.0) {
        return problem(format!("{field}.{side}"), "it must be positive");
    }
    if let Some((side, _)) = sides.iter().find(|(_, mm)| *mm > LONGEST_SHEET_MM) {
        let what = format!("it must not exceed {LONGEST_SHEET_MM} mm");
        return problem(format!("{field}.{side}"), what);
    }
    if !sheet.logos.is_empty() && printing.logo.is_none() {
        return problem("logo", format!("missing, but `{field}.logos` places a logo"));
    }
    let on_sheet = |DVec2 { x, y }: DVec2| {
        (0.0..=sheet.width_mm).contains(&x) && (0.0..=sheet.height_mm).contains(&y)
    };
    match sheet.lines.iter().position(|l| !on_sheet(l.from_mm) || !on_sheet(l.to_mm)) {
        Some(line) => {
            problem(format!("{field}.lines[{line}]"), "the line extends beyond the sheet")
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::PaperSpec;
    use deltille_core::family::Family;
    use deltille_core::lattice::GridKind;
    use deltille_core::targets::{BoardSpec, TagSpec, Target, TargetSpec};

    fn board(rows: u32, cols: u32, edge_mm: f64, tagged: bool, boards: u32) -> Printing {
        let tags = tagged.then(TagSpec::default);
        let inverted = rows % 2 == 1;
        let plain = BoardSpec::new(GridKind::Deltille, rows, cols, edge_mm);
        let spec = BoardSpec { boards, board_id: 3, tags, inverted, ..plain };
        let family = Family::shipped("delTag25h7").unwrap();
        let paper = PaperSpec::default();
        Printing::build("board", &TargetSpec::Board(spec), Some(&family), Some(&paper)).unwrap()
    }

    proptest! {
        #[test]
        fn targets_survive_writing_and_reading(
            rows in 3u32..12, cols in 3u32..12, edge_mm in 5.0f64..30.0,
            tagged: bool, boards in 1u32..3,
        ) {
            let target = board(rows, cols, edge_mm, tagged, if tagged { boards } else { 1 });
            let json = target.to_json();
            prop_assert_eq!(&Printing::from_json(&json).unwrap(), &target);
            prop_assert_eq!(&Target::from_json(&json).unwrap(), &target.target);
        }

        #[test]
        fn truncated_files_are_refused(cut in 0.0f64..1.0) {
            let json = board(3, 3, 20.0, true, 1).to_json();
            let end = (cut * (json.len() - 2) as f64) as usize;
            if let Some(part) = json.get(..end) {
                prop_assert!(matches!(Printing::from_json(part), Err(TargetFileError::Json(_))));
            }
        }
    }

    /// Error message for a file in which `from` is replaced by `to`.
    fn complaint(from: &str, to: &str) -> String {
        let json = board(4, 4, 20.0, true, 1).to_json();
        assert!(json.contains(from), "{from} is not in {json}");
        Printing::from_json(&json.replacen(from, to, 1)).unwrap_err().to_string()
    }

    #[test]
    fn every_error_names_its_field() {
        assert!(complaint("target/1", "target/9").contains("`schema` is `deltille/target/9`"));
        let cases = [
            (r#""edge_mm": 20.0"#, r#""edge_mm": "wide""#, "spec"),
            (r#""id": 3"#, r#""id": -3"#, "panels[0].id"),
            (r#""kind": "deltille""#, r#""kind": "hexagons""#, "panels[0].kind"),
            (r#""panel_mm": [20.0"#, r#""panel_mm": [21.0"#, "panels[0].corners[0].panel_mm"),
            (r#""target_mm": [20.0"#, r#""target_mm": [21.0"#, "panels[0].corners[0].target_mm"),
            (r#""col": 2"#, r#""col": 1"#, "panels[0].corners[1].row"),
            (r#""id": 1, "row""#, r#""id": 0, "row""#, "panels[0].corners[1].id"),
            (r#""rotation": [1.0"#, r#""rotation": [0.9"#, "panels[0].pose.rotation"),
            (r#""width_mm": "#, r#""width_mm": -"#, "sheets[0].width_mm"),
            (r#""panel": 3"#, r#""panel": 4"#, "sheets[0].placements"),
            (r#""matrix""#, r#""matrices""#, "panels[0].matrices"),
        ];
        for (from, to, field) in cases {
            let said = complaint(from, to);
            assert!(said.starts_with(&format!("field `{field}")), "{from}: {said}");
        }
    }
}
