//! A target together with the sheets on which it is printed.

use std::borrow::Cow;

use super::paper::{PaperSize, PaperSpec, SolidSheets};
use crate::marks::{logo_room, tag_ids};
use crate::placing::arrangement::arrange;
use crate::placing::poster::Poster;
use crate::placing::sheet_label::label;
use crate::placing::{face_sheet, guide, net, packed, single_panel, tag_sheet};
use crate::{Finish, LineKind, Logo, Placement, SheetLayout, SheetLine};
use deltille_core::angles::turn_of;
use deltille_core::family::Family;
use deltille_core::polygon::rectangle;
use deltille_core::setting::Setting::{BoardEdgeMm, PaperNote, PaperPacked};
use deltille_core::targets::shipped_family;
use deltille_core::targets::{
    BoardSpec, FamilyRef, Panel, SolidShape, SolidSpec, Target, TargetError, TargetSpec,
    fingerprint,
};

/// A target, and the sheets on which it is printed.
#[derive(Clone, Debug, PartialEq)]
pub struct Printing {
    /// The printed target.
    pub target: Target,
    /// Positions of its panels on paper; empty if the target was made, or read from a file, without sheets.
    pub sheets: Vec<SheetLayout>,
    /// How the sheets are printed.
    pub finish: Finish,
    /// The logo on the sheets.
    pub logo: Option<Logo>,
}

impl From<Target> for Printing {
    /// Creates a printing without sheets.
    fn from(target: Target) -> Self {
        Self { target, sheets: Vec::new(), finish: Finish::default(), logo: None }
    }
}

impl Printing {
    /// Builds the target described by `spec` with a shipped family, on the smallest paper that fits it.
    ///
    /// # Errors
    /// Returns an error if the name is not a valid file name, a number is out of range, the family
    /// is not shipped or has too
    /// few codes, or the target does not fit on A0.
    ///
    /// ```
    /// use deltille_layout::Printing;
    /// use deltille_core::targets::BoardSpec;
    ///
    /// let desk = Printing::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    /// assert_eq!(desk.target.panels[0].corners.len(), 110);
    /// assert_eq!([desk.sheets[0].width_mm, desk.sheets[0].height_mm], [297.0, 210.0]);
    /// # Ok::<(), deltille_core::targets::TargetError>(())
    /// ```
    pub fn new(name: &str, spec: impl Into<TargetSpec>) -> Result<Self, TargetError> {
        let spec = spec.into();
        Self::build(name, &spec, shipped_family(&spec)?.as_ref(), Some(&PaperSpec::default()))
    }

    /// Builds the target described by `spec` and lays it out on `paper`; without paper, the printing has no sheets.
    /// `family` contains the codes of the tags; an untagged target does not need one.
    ///
    /// # Errors
    /// Returns an error if a number is out of range, the family is the wrong one or has too few codes, or the target
    /// does not fit on the paper.
    pub fn build(
        name: &str,
        spec: &TargetSpec,
        family: Option<&Family>,
        paper: Option<&PaperSpec>,
    ) -> Result<Self, TargetError> {
        let target = Target::build(name, spec, family)?;
        match paper {
            Some(paper) => Self::on_paper(target, paper),
            None => Ok(target.into()),
        }
    }

    /// Lays out a target on paper.
    fn on_paper(target: Target, paper: &PaperSpec) -> Result<Self, TargetError> {
        logo_room::check(paper)?;
        let title = match &paper.note {
            Some(note) => format!("{} · {}", target.name, checked_note(note)?),
            None => target.name.to_string(),
        };
        let Target { spec, panels, family: named, .. } = &target;
        let sheets = match spec {
            TargetSpec::Board(spec) => board_sheets(&title, spec, panels, named.as_ref(), paper)?,
            TargetSpec::Solid(spec) => match paper.solids {
                SolidSheets::Net | SolidSheets::SeamedNet => {
                    net::sheets(&title, spec, panels, named.as_ref(), paper)?
                }
                SolidSheets::PerFace => {
                    face_sheet::sheets(&title, spec, panels, named.as_ref(), paper)?
                }
            },
            TargetSpec::Tags(spec) => match target.family()? {
                Some(family) => tag_sheet::sheets(&title, spec, family, paper)?,
                None => Vec::new(),
            },
            TargetSpec::Charuco(_) | TargetSpec::AprilGrid(_) | TargetSpec::Circles(_) => {
                single_panel::sheets(&title, &target, paper)?
            }
            TargetSpec::Listed(_) => return Err(TargetError::Listed),
        };
        logo_room::check_sheets(&sheets, paper)?;
        let logo = paper.logo.clone();
        let mut printing = Self { target, sheets, finish: Finish::default(), logo };
        if paper.tag_ids {
            tag_ids::add(&printing.target, &mut printing.sheets)?;
        }
        if paper.guide_page {
            let guide = guide::sheet(&title, &printing.target, &printing.sheets, paper)?;
            printing.sheets.push(guide);
        }
        Ok(printing)
    }

    /// Returns the printing with the name that is printed on the sheets. For a measured or refined
    /// target, that is the name of
    /// its plan.
    pub fn under_printed_name(&self) -> Cow<'_, Self> {
        let Some(plan) = &self.target.plan else { return Cow::Borrowed(self) };
        let mut printing = self.clone();
        printing.target.name = plan.name.clone();
        Cow::Owned(printing)
    }

    /// Describes the pages, such as `page 297 × 210 mm (A4)` or `5 pages 210 × 297 mm (A4)`; empty without sheets.
    pub fn pages_in_words(&self) -> String {
        let Some(sheet) = self.sheets.first() else { return String::new() };
        let page = sheet.first_page();
        let [width, height] = [page.width_mm, page.height_mm];
        let pages = match self.page_count() {
            1 => "page".to_owned(),
            count => format!("{count} pages"),
        };
        let name = PaperSize::name_of_mm(width, height);
        let name = name.map_or(String::new(), |name| format!(" ({name})"));
        let [width, height] = [width, height].map(|mm| (mm * 1e3).round() / 1e3);
        format!("{pages} {width} × {height} mm{name}")
    }

    /// Returns the total number of pages of all sheets.
    pub fn page_count(&self) -> usize {
        self.sheets.iter().map(SheetLayout::page_count).sum()
    }
}

/// Maximum number of characters in a note: a longer one would make the label illegible.
const LONGEST_NOTE: usize = 80;

/// Checks that a note can be printed, and trims it.
fn checked_note(note: &str) -> Result<&str, TargetError> {
    let refused = |problem: String| Err(TargetError::invalid(PaperNote, problem));
    let is_printed = |c: char| (' '..='~').contains(&c) || "°±·×–−".contains(c);
    let count = note.chars().count();
    match note.chars().find(|&c| !is_printed(c)) {
        Some(other) => {
            refused(format!("the built-in font has no {other:?}: use ASCII and ° ± · × – −"))
        }
        None if count > LONGEST_NOTE => refused(format!(
            "the note has {count} characters, more than the maximum of {LONGEST_NOTE}: shorten it"
        )),
        None if note.trim().is_empty() => {
            refused("the note is empty: omit it, or enter text".to_owned())
        }
        None => Ok(note.trim()),
    }
}

/// Lays out the sheets of boards.
fn board_sheets(
    name: &str,
    board: &BoardSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    if paper.packed {
        if board.two_sided_mm.is_some() {
            let problem =
                "a two-sided board cannot be packed, because each side needs its own sheet";
            return Err(TargetError::invalid(PaperPacked, problem));
        }
        return packed::sheets(name, board, panels, family, paper);
    }
    let target = fingerprint(panels, family);
    let words = |panel: &Panel| label(name, board, std::slice::from_ref(panel), family, target);
    match arrange(board, paper) {
        Ok(arrangement) => {
            let sheet = |panel: &Panel| {
                let ink = if panel.inverted { panel.field_mm() } else { panel.bounds_mm() };
                let mut sheet = arrangement.sheet(panel.id, ink, words(panel));
                let large_id = arrangement.large_id(board, panel.id, ink);
                sheet.texts.extend(large_id.filter(|id| !arrangement.logo_meets(&sheet, id)));
                if board.two_sided_mm.is_some() {
                    sheet.lines.extend(arrangement.crop_marks(panel.id, ink, panel.field_mm()));
                }
                sheet
            };
            Ok(panels.iter().map(sheet).collect())
        }
        Err(TargetError::DoesNotFit { .. }) if paper.poster => {
            panels.iter().map(|panel| poster(board, panel, paper, &words(panel))).collect()
        }
        Err(error) => Err(error),
    }
}

/// Lays out a board that is larger than the paper on several pages.
fn poster(
    board: &BoardSpec,
    panel: &Panel,
    paper: &PaperSpec,
    label: &str,
) -> Result<SheetLayout, TargetError> {
    let corners = rectangle(panel.field_mm());
    let poster = Poster::new(&corners, paper)?;
    poster.check("the board", BoardEdgeMm, board.edge_mm, None, paper)?;
    let mut sheet = poster.sheet();
    let motion = poster.sheet_from_points();
    sheet.placements.push(Placement {
        panel: panel.id,
        angle_rad: turn_of(motion.turn),
        origin_mm: motion.shift,
    });
    // Crosses stay clear of the board and its quiet zone.
    let field = corners.map(|corner| motion.apply(corner));
    let outline = field.iter().zip(field.iter().cycle().skip(1));
    let outline: Vec<SheetLine> = outline
        .map(|(&from_mm, &to_mm)| SheetLine {
            kind: LineKind::Align,
            from_mm,
            to_mm,
            width_mm: 0.15,
        })
        .collect();
    let of = match (board.boards, panel.id) {
        (1, 0) => String::new(),
        (_, id) => format!("board {id} · "),
    };
    let tiles = vec![field.to_vec()];
    poster.add_pages(&mut sheet, tiles, &outline, label, &of, |_, _| Vec::new());
    Ok(sheet)
}

/// Returns the default edge length of a board's tiles, mm. Without a fixed paper size, that is the edge of the
/// published board, which fits A4 with 10 × 11 corners. With a fixed size, it is the largest whole number of
/// millimetres that fits. If nothing fits, building the board reports the error.
pub fn usual_edge_mm(spec: &BoardSpec, paper: &PaperSpec) -> f64 {
    let fitting = paper.size.as_ref().and_then(|_| largest_edge_mm(spec, paper));
    fitting.unwrap_or(BoardSpec::DEFAULT_EDGE_MM)
}

/// Returns the default edge of a solid, mm. Without a fixed paper size, that is the edge of the published icosahedron.
/// With a fixed size, that of a regular solid is the largest whole number of millimetres with which the net fits on the
/// allowed number of pages (one by default), or each face on its page. If nothing fits, building the solid reports the
/// error.
pub fn usual_solid_edge_mm(spec: &SolidSpec, paper: &PaperSpec) -> f64 {
    let usual = SolidSpec::new(spec.shape.clone()).edge_mm;
    // Cuboids and meshes have a size of their own. Nets with seams are for solids larger than the paper.
    let is_regular = !matches!(spec.shape, SolidShape::Cuboid(_) | SolidShape::Mesh(_));
    let is_fitted = is_regular
        && paper.size.is_some()
        && (paper.solids != SolidSheets::SeamedNet || paper.pages.is_some());
    if !is_fitted {
        return usual;
    }
    let on_page = PaperSpec {
        pages: paper.pages.or((paper.solids == SolidSheets::Net).then_some(1)),
        tag_ids: false,
        guide_page: false,
        ..paper.clone()
    };
    let fits = |mm: u32| {
        let untagged =
            SolidSpec { edge_mm: f64::from(mm), tags: None, square_tags: None, ..spec.clone() };
        let printing = Printing::build("net", &TargetSpec::Solid(untagged), None, Some(&on_page));
        let most = on_page.pages.map_or(usize::MAX, |pages| pages as usize);
        printing.is_ok_and(|printing| printing.page_count() <= most)
    };
    // The smallest edges leave no room for tiles.
    let least = (SolidSpec::MIN_EDGE_MM as u32..200).step_by(5).find(|&mm| fits(mm));
    let Some(mut fitting) = least else { return usual };
    let mut step = 1024;
    while step > 0 {
        if fits(fitting + step) {
            fitting += step;
        }
        step /= 2;
    }
    f64::from(fitting)
}

/// Returns the largest edge in whole millimetres with which a board fits on paper, or `None` if 5 mm does not fit.
pub fn largest_edge_mm(spec: &BoardSpec, paper: &PaperSpec) -> Option<f64> {
    // Almost no paper fits an edge of 1 m, and the resulting error proposes an edge that fits.
    let probe = BoardSpec { edge_mm: 1000.0, ..spec.clone() };
    if paper.packed {
        let of_edge = |mm: u32| BoardSpec { edge_mm: f64::from(mm), ..spec.clone() };
        return (5..=1000).rev().find(|&mm| packed::fits(&of_edge(mm), paper)).map(f64::from);
    }
    match arrange(&probe, paper) {
        Ok(_) => Some(probe.edge_mm),
        Err(TargetError::DoesNotFit { fitting_edge_mm, .. }) => fitting_edge_mm.map(f64::from),
        Err(_) => None,
    }
}
