use super::angles::turn_of;
use super::capacity::Setting;
use super::layout::{arrange, label};
use super::paper::{PaperSpec, SolidSheets};
use super::poster::Poster;
use super::{
    BoardSpec, FamilyRef, Finish, LineKind, Name, Panel, Placement, SheetLayout, SheetLine, Target,
    TargetError, TargetSpec, aprilgrid, board, charuco, circles, face_sheet, guide, identity, logo,
    net, packed, solid, tag_ids, tag_sheet,
};
use crate::family::{Family, FamilyError, places};
use crate::polygon::rectangle;

impl Target {
    /// Makes what `spec` asks for with a family that is shipped, laid out on the smallest paper that takes it.
    ///
    /// # Errors
    /// Where the name is no file name, a number is out of its range, the family is not shipped or has too
    /// few codes, or nothing up to A0 takes the target.
    ///
    /// ```
    /// use deltille_core::targets::{BoardSpec, Target};
    ///
    /// let board = Target::new("desk", BoardSpec::deltille(10, 11, 20.0))?;
    /// assert_eq!(board.panels[0].corners.len(), 110);
    /// assert_eq!([board.sheets[0].width_mm, board.sheets[0].height_mm], [297.0, 210.0]);
    /// # Ok::<(), deltille_core::targets::TargetError>(())
    /// ```
    pub fn new(name: &str, spec: impl Into<TargetSpec>) -> Result<Target, TargetError> {
        let spec = spec.into();
        let shipped = |name: Option<&str>| name.map(Family::shipped).transpose();
        let family = shipped(spec.family())
            .and_then(|family| Ok(Family::paired(family, shipped(spec.square_family())?)));
        let family = family.map_err(|error| TargetError::UnknownFamily(error.to_string()))?;
        Self::build(name, &spec, family.as_ref(), Some(&PaperSpec::default()))
    }

    /// The family of its tags, where it has tags.
    ///
    /// # Errors
    /// Where that is not a family that is shipped.
    pub fn family(&self) -> Result<Option<Family>, FamilyError> {
        let shipped = |family: &FamilyRef| Family::shipped(&family.name);
        let Some(family) = &self.family else { return Ok(None) };
        let squares = family.squares.as_deref().map(shipped).transpose()?;
        Ok(Family::paired(Some(shipped(family)?), squares))
    }

    /// Makes what `spec` asks for, laid out on `layout`; without a layout there are no sheets.
    ///
    /// `family` holds the codes of the tags; an untagged target needs none.
    ///
    /// # Errors
    /// Where a number is out of its range, the family is another one or has too few codes, or the layout has no room for
    /// the target.
    pub fn build(
        name: &str,
        spec: &TargetSpec,
        family: Option<&Family>,
        layout: Option<&PaperSpec>,
    ) -> Result<Target, TargetError> {
        let name =
            Name::new(name).map_err(|problem| TargetError::invalid("Target::name", problem))?;
        let title = match layout.and_then(|paper| paper.note.as_deref()) {
            Some(note) => format!("{name} · {}", checked_note(note)?),
            None => name.to_string(),
        };
        layout.map_or(Ok(()), logo::check)?;
        let (panels, family, sheets) = match spec {
            TargetSpec::Board(board) => board_parts(&title, board, family, layout)?,
            TargetSpec::Solid(spec) => {
                let (panels, family) = solid::panels(spec, family)?;
                let sheets = layout.map(|paper| match paper.solids {
                    SolidSheets::Net | SolidSheets::SeamedNet => {
                        net::sheets(&title, spec, &panels, family.as_ref(), paper)
                    }
                    SolidSheets::PerFace => {
                        face_sheet::sheets(&title, spec, &panels, family.as_ref(), paper)
                    }
                });
                (panels, family, sheets.transpose()?.unwrap_or_default())
            }
            TargetSpec::Tags(spec) => {
                let family = needed(family, &spec.family)?;
                let (panels, family, sheets) = tag_sheet::parts(&title, spec, family, layout)?;
                (panels, Some(family), sheets)
            }
            TargetSpec::Charuco(spec) => {
                let (panels, family, sheets) = charuco::parts(&title, spec, family, layout)?;
                (panels, Some(family), sheets)
            }
            TargetSpec::AprilGrid(spec) => {
                let (panels, family, sheets) = aprilgrid::parts(&title, spec, family, layout)?;
                (panels, Some(family), sheets)
            }
            TargetSpec::Circles(spec) => {
                let (panels, sheets) = circles::parts(&title, spec, layout)?;
                (panels, None, sheets)
            }
            TargetSpec::Listed(_) => {
                return Err(TargetError::Listed);
            }
        };
        layout.map_or(Ok(()), |paper| logo::check_sheets(&sheets, paper))?;
        let logo = layout.and_then(|paper| paper.logo.clone());
        let (spec, finish) = (spec.clone(), Finish::default());
        let mut target = Target { name, spec, family, panels, sheets, finish, logo, plan: None };
        if layout.is_some_and(|paper| paper.tag_ids) {
            tag_ids::add(&mut target)?;
        }
        if let Some(paper) = layout.filter(|paper| paper.guide_page) {
            let guide = guide::sheet(&title, &target, paper)?;
            target.sheets.push(guide);
        }
        Ok(target)
    }

    /// Checks that this target can be used together with another one: no tag of the same family
    /// and no board has the same id.
    ///
    /// # Errors
    /// The ids that both have, and the first that is free.
    pub fn check_beside(&self, other: &Target) -> Result<(), TargetError> {
        let overlap = |setting, what, own: &[u32], others: &[u32]| {
            let (Some([first, last]), Some([_, high])) = (range(own), range(others)) else {
                return Ok(());
            };
            if !own.iter().any(|id| others.contains(id)) {
                return Ok(());
            }
            let (other, free) = (other.name.to_string(), u64::from(high) + 1);
            Err(TargetError::Overlap { setting, what, first, last, other, free })
        };
        let boards = |target: &Target| target.panels.iter().map(|p| p.id).collect::<Vec<_>>();
        for kind in self.tilings() {
            if let (Some((family, ids)), Some((same, others))) =
                (self.tags_of_tiling(kind), other.tags_of_tiling(kind))
                && family.name == same.name
                // Place codes follow from the ids of boards.
                && family.name != places::NAME
            {
                let setting = Setting::of(kind, self.tilings().count() > 1);
                overlap(setting.first_id(), "tag ids", &ids, &others)?;
            }
        }
        let board_id = match self.spec {
            TargetSpec::Solid(_) => "SolidSpec::board_id",
            _ => "BoardSpec::board_id",
        };
        overlap(board_id, "board ids", &boards(self), &boards(other))
    }
}

/// Most characters of a note: with more the label that it stands in could not be read any more.
const LONGEST_NOTE: usize = 80;

/// A note that can be printed.
fn checked_note(note: &str) -> Result<&str, TargetError> {
    let refused = |problem: String| Err(TargetError::invalid("PaperSpec::note", problem));
    let is_printed = |c: char| (' '..='~').contains(&c) || "°±·×–−".contains(c);
    let count = note.chars().count();
    match note.chars().find(|&c| !is_printed(c)) {
        Some(other) => {
            refused(format!("the built-in font has no {other:?}: use ASCII and ° ± · × – −"))
        }
        None if count > LONGEST_NOTE => {
            refused(format!("{count} characters are more than {LONGEST_NOTE}: take fewer"))
        }
        None if note.trim().is_empty() => {
            refused("there is nothing in it: leave it out".to_owned())
        }
        None => Ok(note.trim()),
    }
}

/// The family of tags that are asked for.
pub(super) fn needed<'a>(
    family: Option<&'a Family>,
    wanted: &str,
) -> Result<&'a Family, TargetError> {
    let none =
        || TargetError::Family { wanted: wanted.to_owned(), given: "none is given".to_owned() };
    family.ok_or_else(none)
}

/// What a target consists of.
type Parts = (Vec<Panel>, Option<FamilyRef>, Vec<SheetLayout>);

fn board_parts(
    name: &str,
    board: &BoardSpec,
    family: Option<&Family>,
    layout: Option<&PaperSpec>,
) -> Result<Parts, TargetError> {
    board.check()?;
    let packed = layout.filter(|paper| paper.packed);
    if packed.is_some() && board.two_sided_mm.is_some() {
        let problem = "each side of a board has a sheet of its own: leave it out";
        return Err(TargetError::invalid("PaperSpec::packed", problem));
    }
    let arrangement =
        layout.filter(|_| packed.is_none()).map(|paper| (arrange(board, paper), paper));
    let (panels, family) = board::panels(board, family)?;
    if let Some(paper) = packed {
        let sheets = packed::sheets(name, board, &panels, family.as_ref(), paper)?;
        return Ok((panels, family, sheets));
    }
    let target = identity::fingerprint(&panels, family.as_ref());
    let words =
        |panel: &Panel| label(name, board, std::slice::from_ref(panel), family.as_ref(), target);
    let sheets = match arrangement {
        None => Vec::new(),
        Some((Ok(arrangement), _)) => {
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
            panels.iter().map(sheet).collect()
        }
        Some((Err(TargetError::DoesNotFit { .. }), paper)) if paper.poster => {
            let sheet = |panel: &Panel| poster(board, panel, paper, &words(panel));
            panels.iter().map(sheet).collect::<Result<_, _>>()?
        }
        Some((Err(error), _)) => return Err(error),
    };
    Ok((panels, family, sheets))
}

/// A board that is larger than the paper, over several pages.
fn poster(
    board: &BoardSpec,
    panel: &Panel,
    paper: &PaperSpec,
    label: &str,
) -> Result<SheetLayout, TargetError> {
    let corners = rectangle(panel.field_mm());
    let poster = Poster::new(&corners, paper)?;
    poster.check("the board", ("BoardSpec::edge_mm", board.edge_mm), "", paper)?;
    let mut sheet = poster.sheet();
    let motion = poster.sheet_from_points();
    sheet.placements.push(Placement {
        panel: panel.id,
        angle_rad: turn_of(motion.turn),
        origin_mm: motion.shift,
    });
    // Crosses keep out of the board and its quiet zone.
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
    poster.add_pages(&mut sheet, tiles, &outline, (label, &of), |_, _| Vec::new());
    Ok(sheet)
}

/// Lowest and highest of some ids.
fn range(ids: &[u32]) -> Option<[u32; 2]> {
    Some([*ids.iter().min()?, *ids.iter().max()?])
}

/// The edge of a board's tiles where none is asked for, mm: that of the published board, which fits A4 with 10 × 11 corners;
/// on a certain paper the largest in whole millimetres that fits. Where nothing fits, making the board says so.
pub fn usual_edge_mm(spec: &BoardSpec, paper: &PaperSpec) -> f64 {
    const USUAL_MM: f64 = 20.0;
    let fitting = paper.size.as_ref().and_then(|_| largest_edge_mm(spec, paper));
    fitting.unwrap_or(USUAL_MM)
}

/// The largest edge in whole millimetres with which a board fits on paper, if one of 5 mm does.
pub fn largest_edge_mm(spec: &BoardSpec, paper: &PaperSpec) -> Option<f64> {
    // A metre fits next to nothing, and the refusal proposes an edge that does.
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
