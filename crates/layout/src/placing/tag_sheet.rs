//! Sheets of single tags: a panel of one tile for each, in rows, on as many pages as needed.
//!
//! ```text
//!     ▲      ▲      ▲     Tags stand upright. Each has a quiet zone around it, and its id beneath. The
//!     0      1      2     gap below an id is larger than the one above, so that it clearly belongs to
//!     ▲      ▲            its tag.
//!     3      4            The label and the check bars are those of a board sheet.
//! ```

use glam::DVec2;

use super::arrangement::{Arrangement, Footprint, check_margin, on_page};
use super::margin_marks::ADVANCE_CAPS;
use crate::paper::{PaperSize, PaperSpec};
use crate::{Label, Placement, SheetLayout, SheetText};
use deltille_core::family::Family;
use deltille_core::lattice::ROW_HEIGHT;
use deltille_core::setting::Setting::{self, PaperMarginMm, TagSheetEdgeMm};
use deltille_core::targets::format_mm;
use deltille_core::targets::{TagSheetSpec, TargetError};

/// Quiet zone around a tag: fraction of its edge, and minimum, mm; also at least the edge of a cell.
const QUIET: (f64, f64) = (0.15, 3.0);
/// Gap between an id and the row below, in quiet zones.
const BELOW_ID: f64 = 1.5;
/// Capital height of an id as a fraction of the edge, and its range, mm.
const ID_CAP: (f64, [f64; 2]) = (0.07, [1.5, 5.0]);
/// Maximum length of the list of ids on a label, characters; longer lists are replaced by a count.
const LISTED: usize = 48;

/// Blank spaces of a sheet, mm.
struct Blanks {
    edge: f64,
    quiet: f64,
    id_cap: f64,
}

impl Blanks {
    fn new(edge: f64, spec: &TagSheetSpec, family: &Family) -> Self {
        let cell = edge / (f64::from(family.dimension().rows()) + 3.0 * spec.border_bits);
        let quiet = (QUIET.0 * edge).max(QUIET.1).max(cell);
        let (share, [least, most]) = ID_CAP;
        Self { edge, quiet, id_cap: (share * edge).clamp(least, most) }
    }

    /// Returns the distance from the base of one tag to that of its neighbour, to the right and below.
    fn pitch(&self) -> DVec2 {
        let below = self.quiet + self.id_cap + BELOW_ID * self.quiet;
        DVec2::new(self.edge + 2.0 * self.quiet, self.edge * ROW_HEIGHT + below)
    }

    /// Returns the footprint of a block of tags with their ids.
    fn footprint(&self, [columns, rows]: [usize; 2], margin_mm: f64) -> Footprint {
        let pitch = self.pitch();
        Footprint {
            width: pitch.x * columns as f64 - 2.0 * self.quiet,
            height: pitch.y * rows as f64 - BELOW_ID * self.quiet,
            edge_blank: margin_mm.max(self.quiet),
            mark_blank: self.quiet,
            is_centred: false,
        }
    }
}

/// Lays out the sheets of a list of tags.
pub(crate) fn sheets(
    name: &str,
    spec: &TagSheetSpec,
    family: &Family,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let blanks = Blanks::new(spec.edge_mm, spec, family);
    let (grid @ [columns, rows], arrangement) = arrange(spec, &blanks, family, paper)?;
    let pages: Vec<&[u32]> = spec.ids.chunks(columns * rows).collect();
    let count = pages.len();
    let sheets = pages.into_iter().enumerate().map(|(index, ids)| {
        let words = label(name, spec, family, ids, [index + 1, count]);
        page(&blanks, grid, &arrangement, ids, words)
    });
    Ok(sheets.collect())
}

/// Chooses the columns and rows of a page, at most as many as there are tags, and their position.
/// Uses the orientation that fits the most tags.
fn arrange(
    spec: &TagSheetSpec,
    blanks: &Blanks,
    family: &Family,
    paper: &PaperSpec,
) -> Result<([usize; 2], Arrangement), TargetError> {
    let margin = check_margin(paper)?;
    let size = paper.size.clone().or_else(|| PaperSize::automatic().next());
    let Some(size) = size else {
        return Err(TargetError::invalid(Setting::PaperSize, "no paper size is given"));
    };
    let pages = paper.pages_mm(&size);
    let pitch = blanks.pitch();
    let tags = spec.ids.len();
    let mut best: Option<([usize; 2], Arrangement)> = None;
    for &page in &pages {
        for columns in 1..=(((page.x / pitch.x) as usize + 1).min(tags)) {
            for rows in 1..=(((page.y / pitch.y) as usize + 1).min(tags.div_ceil(columns))) {
                let footprint = blanks.footprint([columns, rows], paper.margin_mm);
                let most = best.as_ref().map_or(0, |([c, r], _)| c * r);
                // Of two equal blocks, the later, wider one is used.
                let more = columns * rows > most || (columns * rows == most && columns > rows);
                if more && let Some(found) = on_page(&footprint, page, margin, false) {
                    best = Some(([columns, rows], found.with_logo(paper)));
                }
            }
        }
    }
    best.ok_or_else(|| {
        let edge = format_mm(spec.edge_mm);
        let fits = |mm: &u32| {
            let footprint = Blanks::new(f64::from(*mm), spec, family).footprint([1, 1], margin);
            pages.iter().any(|&page| on_page(&footprint, page, margin, false).is_some())
        };
        let instead = match (*TagSheetSpec::EDGE_MM.start() as u32..spec.edge_mm.ceil() as u32)
            .rev()
            .find(fits)
        {
            Some(mm) => format!("larger paper, or {TagSheetEdgeMm} of at most {mm} mm"),
            None => format!("larger paper, or a smaller {PaperMarginMm}"),
        };
        let problem = format!(
            "a tag with {edge} edges, its id and the check bars do not fit {size}: use {instead}"
        );
        TargetError::invalid(Setting::PaperSize, problem)
    })
}

/// Lays out one page: tags from the upper left, row by row.
fn page(
    blanks: &Blanks,
    grid @ [columns, rows]: [usize; 2],
    arrangement: &Arrangement,
    ids: &[u32],
    words: String,
) -> SheetLayout {
    let Footprint { width, height, .. } = blanks.footprint(grid, 0.0);
    let mut sheet = arrangement.sheet(0, [0.0, 0.0, width, height], words);
    let lower_left = sheet.placements[0].origin_mm;
    sheet.placements.clear();
    let (quiet, id_cap) = (DVec2::Y * blanks.quiet, DVec2::Y * blanks.id_cap);
    for (index, &id) in ids.iter().enumerate() {
        let (column, row) = (index % columns, rows - 1 - index / columns);
        let place = lower_left + blanks.pitch() * DVec2::new(column as f64, row as f64);
        let origin_mm = place + quiet + id_cap;
        sheet.placements.push(Placement { panel: id, angle_rad: 0.0, origin_mm });
        let text = id.to_string();
        let wide = (text.len() as f64 * ADVANCE_CAPS * blanks.id_cap).min(blanks.edge);
        sheet.texts.push(SheetText {
            text: Label::Words(text),
            at_mm: origin_mm + DVec2::X * ((blanks.edge - wide) / 2.0) - quiet - id_cap,
            angle_rad: 0.0,
            cap_height_mm: blanks.id_cap,
            max_width_mm: blanks.edge,
        });
    }
    sheet
}

/// Returns the label of a page, with everything needed to print it again.
fn label(
    name: &str,
    spec: &TagSheetSpec,
    family: &Family,
    ids: &[u32],
    [page, pages]: [usize; 2],
) -> String {
    let mut parts = vec![
        name.to_owned(),
        format!("{} {}", family.name(), listed(ids)),
        format!("fingerprint {}", family.fingerprint()),
        format!("edge {}", format_mm(spec.edge_mm)),
        format!("border {} bits", spec.border_bits),
    ];
    if pages > 1 {
        parts.push(format!("page {page} of {pages}"));
    }
    parts.push(format!("deltille {}", env!("CARGO_PKG_VERSION")));
    parts.join(" · ")
}

/// Describes ids in words: `ids 0–29`, `ids 3, 7, 20–25`; long lists are replaced by a count.
fn listed(ids: &[u32]) -> String {
    let runs = ids.chunk_by(|a, b| a.checked_add(1) == Some(*b)).filter_map(|run| {
        let (first, last) = (run.first()?, run.last()?);
        Some(if first == last { first.to_string() } else { format!("{first}–{last}") })
    });
    let text = runs.collect::<Vec<_>>().join(", ");
    match (ids, text.len()) {
        ([_], _) => format!("id {text}"),
        (_, ..=LISTED) => format!("ids {text}"),
        ([first, .., last], _) => format!("{} ids, {first} to {last}", ids.len()),
        ([], _) => "no ids".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Printing;
    use deltille_core::targets::TargetSpec;

    fn build(ids: Vec<u32>, edge_mm: f64, paper: &str) -> Result<Printing, TargetError> {
        let family = Family::shipped("d36h9").unwrap();
        let spec = TagSheetSpec { family: "d36h9".to_owned(), ids, edge_mm, border_bits: 1.5 };
        let paper = PaperSpec { size: Some(paper.parse().unwrap()), ..PaperSpec::default() };
        Printing::build("tags", &TargetSpec::Tags(spec), Some(&family), Some(&paper))
    }

    #[test]
    fn every_tag_is_on_one_page_with_a_quiet_zone() {
        for (edge, paper) in [(5.0, "A4"), (30.0, "A4"), (30.0, "letter"), (140.0, "A4")] {
            let ids: Vec<u32> = (100..300).collect();
            let target = build(ids.clone(), edge, paper).unwrap();
            let placed: Vec<u32> =
                target.sheets.iter().flat_map(|s| &s.placements).map(|p| p.panel).collect();
            assert_eq!(placed, ids);
            let quiet = (0.15 * edge).max(3.0) - 1e-9;
            for sheet in &target.sheets {
                for (i, a) in sheet.placements.iter().enumerate() {
                    let DVec2 { x, y } = a.origin_mm;
                    let upper = y + edge * ROW_HEIGHT;
                    assert!(x >= quiet && x + edge + quiet <= sheet.width_mm);
                    assert!(upper + quiet <= sheet.height_mm);
                    for b in &sheet.placements[..i] {
                        let apart = (a.origin_mm - b.origin_mm).abs();
                        let tag = DVec2::new(edge, edge * ROW_HEIGHT);
                        assert!(apart.cmpge(tag + 2.0 * quiet).any());
                    }
                    assert!(sheet.check_bars[0].from_mm.y + 1.0 + quiet <= y);
                    assert!(sheet.check_bars[1].from_mm.x - 1.0 - quiet >= x + edge);
                }
            }
        }
    }

    #[test]
    fn tags_that_do_not_fit_are_refused() {
        let error = build(vec![0], 250.0, "A4").unwrap_err().to_string();
        assert!(error.starts_with("`PaperSpec::size`: a tag"), "{error}");
        let largest = error.split("at most ").nth(1).and_then(|e| e.split(' ').next()).unwrap();
        let largest: f64 = largest.parse().unwrap();
        assert!(
            build(vec![0], largest, "A4").is_ok() && build(vec![0], largest + 1.0, "A4").is_err()
        );
        assert!(
            build(vec![0], 4.0, "A4")
                .unwrap_err()
                .to_string()
                .starts_with("`TagSheetSpec::edge_mm`: 4 mm")
        );
        assert!(
            build(vec![99_999], 30.0, "A4")
                .unwrap_err()
                .to_string()
                .starts_with("`TagSheetSpec::ids`")
        );
    }

    #[test]
    fn lists_of_ids_are_shortened() {
        assert_eq!(listed(&[4]), "id 4");
        assert_eq!(listed(&[3, 7, 20, 21, 22]), "ids 3, 7, 20–22");
        let odd: Vec<u32> = (0..100).map(|i| 2 * i + 1).collect();
        assert_eq!(listed(&odd), "100 ids, 1 to 199");
    }
}
