//! A net on paper: which of its unfoldings, how it lies, and what is drawn of it.

use std::f64::consts::PI;

use glam::DVec2;

use super::nest::{self, Outline, Place};
use super::plane::{Motion, bounds};
use super::tabs::{self, Tab};
use super::unfold::{self, Piece, Side, Sides};
use crate::paper::{PaperSpec, SolidSheets};
use crate::placing::arrangement::{
    ADVANCE_CAPS, Arrangement, Footprint, fit_upright, imprint, tag_range,
};
use crate::placing::face_sheet::edge_numbers;
use crate::placing::poster::{MOST_PAGES, Poster};
use crate::{Label, LineKind, Placement, SheetLayout, SheetLine, SheetText};
use deltille_core::angles::turn_of;
use deltille_core::lattice::{GridKind, Vertex};
use deltille_core::polygon;
use deltille_core::setting::Setting::{
    PaperSize, SolidEdgeMm, SolidMarginMm, SolidSheetsPerFace, SolidSheetsSeamedNet,
};
use deltille_core::targets::format_mm;
use deltille_core::targets::{
    Face, FamilyRef, Panel, Polyhedron, SolidSpec, TargetError, fingerprint,
};

/// Faces that rise or fall from one plane by less than this are not folded, radians (a tenth of a
/// degree): no hand makes so slight a fold, and the neighbours hold the paper in its place.
const FLAT_RAD: f64 = 0.1 / 180.0 * PI;

/// Width of lines to cut and to fold along, mm: a hairline that every printer holds.
pub(super) const LINE_WIDTH_MM: f64 = 0.15;

/// Least margin of a face that takes its numbers, mm.
const LEAST_MARGIN_MM: f64 = 2.5;

/// Capital height of the numbers in the margin of a face, in widths of the margin, and the most of
/// it, mm.
const NUMBER_CAP: (f64, f64) = (0.35, 2.0);

/// Capital height of the words on a tab, in depths of the tab, and the most of it, mm.
const TAB_CAP: (f64, f64) = (0.35, 2.2);

/// Blank on either side of the words on a tab, mm.
const TAB_INDENT_MM: f64 = 1.0;

/// Smallest capital height of words on a tab before they are cut short, mm.
const LEGIBLE_CAP_MM: f64 = 1.2;

/// Capital height and line spacing of the instructions, mm.
const WORDS_CAP_MM: f64 = 2.2;
const WORDS_STEP_MM: f64 = 3.6;

/// Smallest room for pieces of a net, mm.
const LEAST_ROOM_MM: f64 = 40.0;

/// Largest pieces that are tried, in parts of the room of a page: large ones are less work to glue, small ones leave less
/// of the paper unused.
const PARTS_OF_ROOM: [f64; 6] = [1.0, 0.7, 0.5, 0.35, 0.25, 0.18];

/// Orders of growth that are tried for each of them.
const ORDERS: u64 = 4;

/// Capital height of the number of a page, mm.
const PAGE_CAP_MM: f64 = 5.0;

/// Blank between the net, the instructions and the marks along the margins, mm.
const BLANK_MM: f64 = 2.5;

/// A net in its own frame: faces, and the tabs of each piece.
struct Net {
    pieces: Vec<Piece>,
    tabs: Vec<Vec<Tab>>,
}

/// A net whose pieces lie on pages.
struct Nested {
    net: Net,
    /// Of each piece.
    places: Vec<Place>,
    pages: usize,
}

impl Nested {
    /// Pages to print, then pieces to glue.
    fn work(&self) -> [usize; 2] {
        [self.pages, self.net.pieces.len()]
    }
}

/// A piece of a net on a sheet.
struct Laid<'a> {
    piece: &'a Piece,
    tabs: &'a [Tab],
    arrangement: Arrangement,
    page_from_net: Motion,
}

/// The sheets of a solid's net.
pub(crate) fn sheets(
    name: &str,
    spec: &SolidSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    if spec.margin_mm < LEAST_MARGIN_MM {
        let problem = format!(
            "a net has its numbers in the margins of the faces: take at least {} instead of {}, \
             or {SolidSheetsPerFace}",
            format_mm(LEAST_MARGIN_MM),
            format_mm(spec.margin_mm)
        );
        return Err(TargetError::invalid(SolidMarginMm, problem));
    }
    let (solid, faces) = (spec.polyhedron(), spec.faces()?);
    let sides = Sides::new(&solid);
    let nets = nets(&solid, spec, &faces, &sides);
    let drawing = Drawing::new(name, spec, &solid, &faces, panels, family, &sides);

    let mut best: Option<(f64, SheetLayout)> = None;
    for net in &nets {
        let ([piece], [tabs]) = (&net.pieces[..], &net.tabs[..]) else { continue };
        let Some(laid) = lay(piece, tabs, paper)? else { continue };
        let area = laid.arrangement.page_mm().element_product();
        if best.as_ref().is_none_or(|(least, _)| area < *least) {
            best = Some((area, drawing.sheet(&laid)));
        }
    }
    match best {
        Some((_, sheet)) => Ok(vec![sheet]),
        None if paper.solids == SolidSheets::SeamedNet => seamed(&nets, spec, &drawing, paper),
        None => nested(spec, &drawing, paper),
    }
}

/// A net that is larger than the paper, over pages that are joined along seams.
fn seamed(
    nets: &[Net],
    spec: &SolidSpec,
    drawing: &Drawing,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let [net, ..] = nets else {
        let problem = format!("the faces leave no room for glue tabs: take {SolidSheetsPerFace}");
        return Err(TargetError::invalid(SolidEdgeMm, problem));
    };
    let what = format!("the net of a solid with {} edges", format_mm(spec.edge_mm));
    let count = net.pieces.len();
    let pieces = net.pieces.iter().zip(&net.tabs).enumerate();
    pieces
        .map(|(index, (piece, tabs))| {
            let poster = Poster::new(&points(piece, tabs), paper)?;
            poster.check(&what, SolidEdgeMm, spec.edge_mm, Some(SolidSheetsPerFace), paper)?;
            let mut sheet = poster.sheet();
            drawing.draw(&mut sheet, piece, tabs, &poster.sheet_from_points());
            let of = match count {
                1 => "net".to_owned(),
                _ => format!("net, piece {} of {count}", index + 1),
            };
            let tiles = sheet.placements.iter().filter_map(|placement| {
                let panel = drawing.panels.iter().find(|panel| panel.id == placement.panel)?;
                Some(on_page(placement, &tiles_outline(panel)))
            });
            let (tiles, lines) = (tiles.collect(), sheet.lines.clone());
            let words = |at: DVec2, room: f64| instructions(&lines, at, room).to_vec();
            poster.add_pages(&mut sheet, tiles, &lines, &drawing.label(&of), "", words);
            Ok(sheet)
        })
        .collect()
}

/// Pieces of whole faces, nested on pages: on the smallest paper that takes them all, or on as few pages as will do of the
/// size that is asked for, or of the largest.
fn nested(
    spec: &SolidSpec,
    drawing: &Drawing,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let sizes = paper.sizes();
    let flat = outlines(drawing.faces);
    let area: f64 = flat.iter().map(|face| polygon::area(face)).sum();
    for (index, size) in sizes.iter().enumerate() {
        let paper = PaperSpec { size: Some(size.clone()), ..paper.clone() };
        let least = Footprint {
            width: LEAST_ROOM_MM,
            height: LEAST_ROOM_MM + WORDS_MM,
            edge_blank: paper.margin_mm,
            mark_blank: BLANK_MM,
            is_centred: false,
        };
        let is_last = index + 1 == sizes.len();
        let Some(page) = fit_upright(&least, &paper)? else { continue };
        let [left, lower, right, upper] = page.clear_mm();
        let room = DVec2::new(right - left - BLANK_MM, upper - lower - WORDS_MM - BLANK_MM);
        if !is_last && area > room.element_product() {
            continue;
        }
        let Some(Nested { net, places, pages: count }) = nest_on(&flat, drawing.sides, room) else {
            continue;
        };
        if count > 1 && !is_last {
            continue;
        }
        if count > MOST_PAGES {
            let problem = format!(
                "the net of a solid with {} edges takes {count} pages of {size}, more than can be assembled: take \
                 {SolidSheetsPerFace}, a shorter {SolidEdgeMm}, or larger {PaperSize}",
                format_mm(spec.edge_mm),
            );
            return Err(TargetError::invalid(SolidEdgeMm, problem));
        }
        let corner = DVec2::new(left, lower + WORDS_MM + BLANK_MM);
        let sheet = |number: usize| {
            let of = match count {
                1 => format!("net in {} pieces", net.pieces.len()),
                _ => format!("net, page {} of {count}", number + 1),
            };
            let mut sheet = page.sheet(0, [0.0; 4], drawing.label(&of));
            sheet.placements.clear();
            let pieces = net.pieces.iter().zip(&net.tabs).zip(&places);
            for ((piece, tabs), place) in pieces.filter(|(_, place)| place.page == number) {
                let motion = place.room_from_piece;
                let page_from_net = Motion { shift: motion.shift + corner, ..motion };
                drawing.draw(&mut sheet, piece, tabs, &page_from_net);
            }
            let at = DVec2::new(left, lower + BLANK_MM);
            drawing.explain(
                &mut sheet,
                at,
                right - BLANK_MM,
                (count > 1).then_some([number, count]),
            );
            sheet
        };
        return Ok((0..count).map(sheet).collect());
    }
    let size = sizes.last().map(ToString::to_string).unwrap_or_default();
    let seams = if paper.size.is_some() { format!(", larger {PaperSize}") } else { String::new() };
    let problem = format!(
        "a face with {} edges and its tabs is larger than {size}: take {SolidSheetsSeamedNet}{seams}, or a shorter \
         {SolidEdgeMm}",
        format_mm(spec.edge_mm),
    );
    Err(TargetError::invalid(SolidEdgeMm, problem))
}

/// The net whose pieces take the fewest pages with a room of this size, then that with the fewest pieces.
fn nest_on(flat: &[Vec<DVec2>], sides: &Sides, room: DVec2) -> Option<Nested> {
    let mut best: Option<Nested> = None;
    for part in PARTS_OF_ROOM {
        let mut fewest = usize::MAX;
        for seed in 0..ORDERS {
            let most = room * part;
            let fit = |points: &[DVec2]| nest::fits(points, tabs::MOST_DEPTH_MM, most);
            let pieces = unfold::in_pieces_that_fit(flat, sides, seed, fit);
            fewest = fewest.min(pieces.len());
            let Some(net) = with_tabs(pieces, sides) else { continue };
            let outline = |(piece, tabs): (&Piece, &Vec<Tab>)| -> Outline {
                let faces = piece.iter().map(|face| face.corners.clone());
                faces.chain(tabs.iter().map(|tab| tab.corners.to_vec())).collect()
            };
            let outlines: Vec<Outline> = net.pieces.iter().zip(&net.tabs).map(outline).collect();
            let Some(places) = nest::nest(&outlines, room) else { continue };
            let pages = 1 + places.iter().map(|place| place.page).max().unwrap_or_default();
            let nested = Nested { net, places, pages };
            if best.as_ref().is_none_or(|best| nested.work() < best.work()) {
                best = Some(nested);
            }
        }
        // There are no smaller pieces than single faces.
        if fewest == flat.len() {
            break;
        }
    }
    best
}

/// The unfoldings that have room for tabs, best liked first.
fn nets(solid: &Polyhedron, spec: &SolidSpec, faces: &[Face], sides: &Sides) -> Vec<Net> {
    let flat = outlines(faces);
    let with_tabs = |pieces: Vec<Piece>| with_tabs(pieces, sides);
    let unfoldings = unfold::unfoldings(solid, &spec.shape, &flat);
    let nets: Vec<Net> = unfoldings.into_iter().filter_map(with_tabs).collect();
    if !nets.is_empty() {
        return nets;
    }
    // A single face has room for all of its tabs.
    let sizes = std::iter::successors(Some(flat.len()), |most| Some(most * 3 / 4));
    let mut fewest = sizes.take_while(|&most| most > 0).filter_map(|most| {
        let small = unfold::in_small_pieces(solid, &flat, most).filter_map(with_tabs);
        small.min_by_key(|net| net.pieces.len())
    });
    fewest.next().into_iter().collect()
}

fn outlines(faces: &[Face]) -> Vec<Vec<DVec2>> {
    faces.iter().map(|face| face.outline_mm.clone()).collect()
}

fn with_tabs(pieces: Vec<Piece>, sides: &Sides) -> Option<Net> {
    let tabs = tabs::place(&pieces, sides)?;
    Some(Net { pieces, tabs })
}

/// The convex shape that the tiles of a face fill, in the panel frame, mm.
fn tiles_outline(panel: &Panel) -> Vec<DVec2> {
    if panel.outline != deltille_core::targets::Outline::Triangle {
        let tiles = panel.dark_tiles();
        let vertices = tiles.iter().flat_map(|tile| tile.vertices());
        return polygon::hull(vertices.map(|vertex| panel.lattice_mm(vertex)).collect());
    }
    let top = panel.corners.iter().map(|corner| corner.row).max().unwrap_or_default();
    let ends = [(-1, -1), (-1, top + 2), (top + 2, -1)];
    ends.map(|(row, col)| panel.lattice_mm(Vertex::new(row, col))).to_vec()
}

/// Points of a panel on a page, mm.
fn on_page(placement: &Placement, points: &[DVec2]) -> Vec<DVec2> {
    points.iter().map(|&p| placement.page_from_panel(p)).collect()
}

/// All corners of a piece and its tabs.
fn points(piece: &Piece, tabs: &[Tab]) -> Vec<DVec2> {
    let faces = piece.iter().flat_map(|face| face.corners.iter().copied());
    faces.chain(tabs.iter().flat_map(|tab| tab.corners)).collect()
}

/// Height of the instructions with the blank above them, mm.
const WORDS_MM: f64 = 2.0 * WORDS_STEP_MM + BLANK_MM;

/// Lays a piece on the smallest paper that takes it, turned no more than that needs.
fn lay<'a>(
    piece: &'a Piece,
    tabs: &'a [Tab],
    paper: &PaperSpec,
) -> Result<Option<Laid<'a>>, TargetError> {
    let sizes = paper.sizes();
    let points = points(piece, tabs);
    // As the net stands, upright, then slanted as little as will do.
    let slanted = (1..18).flat_map(|n| [5 * n, -5 * n]).filter(|n| n % 90 != 0);
    let turns: Vec<f64> =
        [0, 90].into_iter().chain(slanted).map(|n| f64::from(n).to_radians()).collect();
    for size in sizes {
        let paper = PaperSpec { size: Some(size), ..paper.clone() };
        for &angle in &turns {
            let turn = Motion::turning(angle);
            let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
            let [left, lower, right, upper] = bounds(&turned);
            let footprint = Footprint {
                width: right - left,
                height: upper - lower + WORDS_MM,
                edge_blank: paper.margin_mm,
                mark_blank: BLANK_MM,
                is_centred: false,
            };
            if let Some(arrangement) = fit_upright(&footprint, &paper)? {
                let DVec2 { x, y } = arrangement.footprint_at_mm();
                let shift = DVec2::new(x - left, y + WORDS_MM - lower);
                let page_from_net = Motion { shift, ..turn };
                return Ok(Some(Laid { piece, tabs, arrangement, page_from_net }));
            }
        }
    }
    Ok(None)
}

/// What it takes to draw any piece of a solid's net.
struct Drawing<'a> {
    name: &'a str,
    spec: &'a SolidSpec,
    faces: &'a [Face],
    panels: &'a [Panel],
    family: Option<&'a FamilyRef>,
    sides: &'a Sides,
    /// Numbers of the edges of each face.
    numbers: Vec<Vec<usize>>,
    /// Which way each side of each face is folded.
    folds: Vec<Vec<LineKind>>,
}

impl<'a> Drawing<'a> {
    fn new(
        name: &'a str,
        spec: &'a SolidSpec,
        solid: &Polyhedron,
        faces: &'a [Face],
        panels: &'a [Panel],
        family: Option<&'a FamilyRef>,
        sides: &'a Sides,
    ) -> Self {
        let edges = solid.edges();
        let numbers: Vec<Vec<usize>> =
            (0..faces.len()).map(|face| edge_numbers(solid, &edges, face)).collect();
        let angles_rad = solid.dihedral_angles_rad();
        let fold = |edge: usize| match angles_rad[edge] - PI {
            angle if angle.abs() < FLAT_RAD => LineKind::Flat,
            // The next face rises out of this one's plane.
            angle if angle > 0.0 => LineKind::Valley,
            _ => LineKind::Fold,
        };
        let folds =
            numbers.iter().map(|edges| edges.iter().map(|&edge| fold(edge)).collect()).collect();
        Self { name, spec, faces, panels, family, sides, numbers, folds }
    }

    /// The sheet of a net in one piece that fits its paper.
    fn sheet(&self, laid: &Laid) -> SheetLayout {
        let mut sheet = laid.arrangement.sheet(0, [0.0; 4], self.label("net"));
        sheet.placements.clear();
        self.draw(&mut sheet, laid.piece, laid.tabs, &laid.page_from_net);
        let [left, lower, right, _] = laid.arrangement.clear_mm();
        self.explain(&mut sheet, DVec2::new(left, lower + BLANK_MM), right - BLANK_MM, None);
        sheet
    }

    /// Adds the instructions from `at` to the right end, and before them which page of how many it is.
    fn explain(&self, sheet: &mut SheetLayout, at: DVec2, right: f64, page: Option<[usize; 2]>) {
        let mut start = at;
        if let Some([number, count]) = page {
            let text = Label::Words(format!("{} of {count}", number + 1));
            let max_width_mm = width(&text, PAGE_CAP_MM);
            start.x += max_width_mm + BLANK_MM;
            sheet.texts.push(SheetText {
                text,
                at_mm: at + DVec2::Y * (WORDS_MM - BLANK_MM - PAGE_CAP_MM) / 2.0,
                angle_rad: 0.0,
                cap_height_mm: PAGE_CAP_MM,
                max_width_mm,
            });
        }
        let words = instructions(&sheet.lines, start, right - start.x);
        sheet.texts.extend(words);
    }

    /// Adds the panels, lines and numbers of a piece to a sheet.
    fn draw(&self, sheet: &mut SheetLayout, piece: &Piece, tabs: &[Tab], sheet_from_net: &Motion) {
        let hinges: Vec<(Side, Side)> = piece.iter().filter_map(|face| face.hinge).collect();
        for flat in piece {
            let (face, index) = (&self.faces[flat.face], flat.face);
            let corners: Vec<DVec2> =
                flat.corners.iter().map(|&corner| sheet_from_net.apply(corner)).collect();
            let lower = [face.outline_mm[0], face.outline_mm[1]];
            let motion = Motion::carrying(lower, [corners[0], corners[1]]);
            let placement = Placement {
                panel: self.panels[index].id,
                angle_rad: turn_of(motion.turn),
                origin_mm: motion.shift,
            };
            sheet.placements.push(placement);
            let mut named = false;
            for at in self.sides.of(index) {
                let side = at.side;
                let ends = [corners[side], corners[(side + 1) % corners.len()]];
                let hinge = hinges.iter().find(|(on, own)| *on == at || *own == at);
                let tab = tabs.iter().find(|tab| tab.side == at);
                let number = self.numbers[index][side];
                match (hinge, tab) {
                    // A fold is drawn once, with the face that hangs on the other.
                    (Some((_, own)), _) => {
                        if *own == at {
                            sheet.lines.push(line(self.folds[index][side], ends));
                        }
                    }
                    (None, Some(tab)) => {
                        sheet.lines.extend(self.tab_lines(tab, ends, sheet_from_net));
                        sheet.texts.extend(self.tab_words(tab, number, sheet_from_net));
                    }
                    (None, None) => {
                        sheet.lines.push(line(LineKind::Cut, ends));
                        sheet.texts.push(self.margin_words(ends, Label::Edge(number), 0.5));
                    }
                }
                // The name of the face stands where no number of an edge does.
                if !named && (hinge.is_some() || tab.is_some()) {
                    named = true;
                    sheet.texts.push(self.margin_words(ends, Label::Face(index), 0.5));
                }
            }
            if !named {
                let ends = [corners[0], corners[1]];
                sheet.texts.push(self.margin_words(ends, Label::Face(index), 0.25));
            }
        }
    }

    fn tab_lines(&self, tab: &Tab, [from, to]: [DVec2; 2], motion: &Motion) -> Vec<SheetLine> {
        let [b, a, far_a, far_b] = tab.corners.map(|corner| motion.apply(corner));
        let fold = self.folds[tab.side.face][tab.side.side];
        let mut lines = vec![line(fold, [a, b])];
        lines.extend([[a, far_a], [far_a, far_b], [far_b, b]].map(|e| line(LineKind::Cut, e)));
        let free = [[from, a], [b, to]].into_iter().filter(|[p, q]| p.distance(*q) > LINE_WIDTH_MM);
        lines.extend(free.map(|ends| line(LineKind::Cut, ends)));
        lines
    }

    /// The words on a tab: its edge, and the face it goes under where there is room for that.
    fn tab_words(&self, tab: &Tab, number: usize, motion: &Motion) -> Option<SheetText> {
        let [_, _, far_a, far_b] = tab.corners.map(|corner| motion.apply(corner));
        let under = self.sides.partner(tab.side)?.face;
        let room = far_a.distance(far_b) - 2.0 * TAB_INDENT_MM;
        let cap = (TAB_CAP.0 * tab.depth_mm).min(TAB_CAP.1);
        let long = Label::Tab { edge: number, under };
        let text =
            if width(&long, LEGIBLE_CAP_MM.min(cap)) <= room { long } else { Label::Edge(number) };
        let cap = cap.min(cap * room / width(&text, cap));
        Some(words([far_a, far_b], text, cap, 0.5, (tab.depth_mm - cap) / 2.0, room))
    }

    /// Words in the margin of a face along one of its sides, centred at a part of its length.
    fn margin_words(&self, ends: [DVec2; 2], text: Label, part: f64) -> SheetText {
        let margin = self.spec.white_margin_mm();
        let cap = (NUMBER_CAP.0 * margin).min(NUMBER_CAP.1);
        let room = (ends[0].distance(ends[1]) - 4.0 * margin).max(cap);
        let cap = cap.min(cap * room / width(&text, cap));
        // Wide margins keep the words near the edge that they name.
        let inwards = ((margin - cap) / 2.0).min(2.0 * cap);
        words(ends, text, cap, part, inwards, room)
    }

    /// All that is needed to make the net again.
    fn label(&self, of: &str) -> String {
        let (spec, name) = (self.spec, self.name);
        let mut parts = vec![name.to_owned(), spec.size()];
        parts.push(of.to_owned());
        parts.push(format!("{} tiles, margin {}", spec.tiles, format_mm(spec.margin_mm)));
        for kind in [GridKind::Deltille, GridKind::Checker] {
            let own = || self.panels.iter().filter(|panel| panel.kind == kind);
            let tags = || own().flat_map(|panel| &panel.tags);
            if let (Some(family), Some(first), Some(last)) =
                (self.family, tags().next(), tags().last())
            {
                let family = family.of_tiling(kind);
                parts.push(tag_range(&family.name, first.id, last.id));
            }
        }
        let last = self.panels.last().map_or(0, |panel| panel.id);
        parts.push(format!("boards {}–{last}", spec.board_id));
        parts.push(imprint(fingerprint(self.panels, self.family)));
        parts.join(" · ")
    }
}

/// How to make the solid from a print of these lines, two lines of text; the lower one stands at
/// `at`.
fn instructions(lines: &[SheetLine], at: DVec2, room: f64) -> [SheetText; 2] {
    let has = |kind| lines.iter().any(|line| line.kind == kind);
    let mut folds = if has(LineKind::Valley) {
        "Cut along solid lines. Score and fold dashed lines away from the print, dash-dotted ones \
         towards it."
    } else {
        "Cut along solid lines. Score dashed lines and fold them away from the print."
    }
    .to_owned();
    if has(LineKind::Flat) {
        folds += " Do not fold dotted lines.";
    }
    let glue = "Glue each tab under the face that it names, where the face has the same number: \
                edge 1 to edge 1, and so on."
        .to_owned();
    let mut y = at.y + 2.0 * WORDS_STEP_MM;
    [folds, glue].map(|text| {
        y -= WORDS_STEP_MM;
        SheetText {
            text: Label::Words(text),
            at_mm: DVec2::new(at.x, y),
            angle_rad: 0.0,
            cap_height_mm: WORDS_CAP_MM,
            max_width_mm: room,
        }
    })
}

fn line(kind: LineKind, [from_mm, to_mm]: [DVec2; 2]) -> SheetLine {
    SheetLine { kind, from_mm, to_mm, width_mm: LINE_WIDTH_MM }
}

/// Estimated width of a text, mm.
fn width(text: &Label, cap: f64) -> f64 {
    text.characters() as f64 * ADVANCE_CAPS * cap
}

/// Words along the line between two points, centred at a part of it, their base line `inwards`
/// (to the left) of it.
fn words(
    [from, to]: [DVec2; 2],
    text: Label,
    cap: f64,
    part: f64,
    inwards: f64,
    room: f64,
) -> SheetText {
    let along = (to - from).normalize_or_zero();
    let start = from + (to - from) * part - along * width(&text, cap) / 2.0;
    SheetText {
        text,
        at_mm: start + along.perp() * inwards,
        angle_rad: turn_of(along),
        cap_height_mm: cap,
        max_width_mm: room,
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::super::plane::gap_mm;
    use super::*;
    use crate::Printing;
    use crate::placing::poster::TICK_MM;
    use deltille_core::family::Family;
    use deltille_core::targets::{SolidShape, TargetSpec};

    /// The rectangle that a text takes, by estimate.
    fn text_box(text: &SheetText) -> [DVec2; 4] {
        let width = width(&text.text, text.cap_height_mm).min(text.max_width_mm);
        let (at, along) = (text.at_mm, DVec2::from_angle(text.angle_rad));
        let up = along.perp() * text.cap_height_mm;
        [at, at + along * width, at + along * width + up, at + up]
    }

    /// Page positions of a placed panel's outline.
    fn outline(target: &Printing, placement: &Placement) -> Vec<DVec2> {
        let TargetSpec::Solid(spec) = &target.target.spec else { panic!("a solid") };
        let index =
            target.target.panels.iter().position(|panel| panel.id == placement.panel).unwrap();
        on_page(placement, &spec.faces().unwrap()[index].outline_mm)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Every face once, none on another, all on its sheet; no words on lines, tiles or words;
        /// on several pages of one sheet every line is shown, and every cross on two.
        #[test]
        fn nothing_on_a_net_meets_anything_else(
            shape in 0usize..5, edge_mm in 60.0f64..200.0, tiles in 6u32..12, margin_mm in 2.5f64..7.0,
            paper in 0usize..3, seams in any::<bool>(),
        ) {
            use SolidShape::{Cube, Cuboid, Icosahedron, Octahedron, Tetrahedron};
            let box_of = Cuboid(DVec3::new(2.0, 1.6, 1.2));
            let has_squares = shape > 2;
            // The largest whose faces fit A4.
            let edge_mm = if has_squares { 0.8 * edge_mm } else { edge_mm };
            let shape = [Tetrahedron, Octahedron, Icosahedron, Cube, box_of][shape].clone();
            let mut spec = SolidSpec { edge_mm, tiles, margin_mm, ..SolidSpec::new(shape) };
            let name = if has_squares { "aprilTag36h11" } else { "delTag36h11" };
            spec.tags.as_mut().unwrap().family = name.to_owned();
            let family = Family::shipped(name).unwrap();
            let size = [None, Some("A4".parse().unwrap()), Some("A2".parse().unwrap())];
            let solids = if seams { SolidSheets::SeamedNet } else { SolidSheets::Net };
            let paper = PaperSpec { size: size[paper].clone(), solids, ..PaperSpec::default() };
            let target =
                Printing::build("net", &TargetSpec::Solid(spec), Some(&family), Some(&paper)).unwrap();
            prop_assert_eq!(&Printing::from_json(&target.to_json()).unwrap(), &target);
            prop_assert!(!seams || target.sheets.len() == 1);
            let placements = target.sheets.iter().flat_map(|sheet| &sheet.placements);
            let mut faces: Vec<u32> = placements.map(|p| p.panel).collect();
            faces.sort_unstable();
            prop_assert_eq!(faces, target.target.panels.iter().map(|p| p.id).collect::<Vec<_>>());
            for sheet in &target.sheets {
                check_sheet(&target, sheet)?;
            }
        }
    }

    fn check_sheet(target: &Printing, sheet: &SheetLayout) -> Result<(), TestCaseError> {
        let outlines: Vec<_> = sheet.placements.iter().map(|p| outline(target, p)).collect();
        for (n, a) in outlines.iter().enumerate() {
            prop_assert!(a.iter().all(|p| p.x > 0.0 && p.y > 0.0));
            prop_assert!(a.iter().all(|p| p.x < sheet.width_mm && p.y < sheet.height_mm));
            prop_assert!(outlines[n + 1..].iter().all(|b| gap_mm(a, b) > -1e-6));
        }
        let tiles = sheet.placements.iter().map(|placement| {
            let panel = target.target.panels.iter().find(|p| p.id == placement.panel).unwrap();
            on_page(placement, &tiles_outline(panel))
        });
        let lines = sheet.lines.iter().map(|l| vec![l.from_mm, l.to_mm]);
        let marks: Vec<Vec<DVec2>> = tiles.chain(lines).collect();
        let boxes: Vec<_> = sheet.texts.iter().map(text_box).collect();
        for (n, text) in boxes.iter().enumerate() {
            let words = &sheet.texts[n].text;
            prop_assert!(marks.iter().all(|mark| gap_mm(text, mark) > 0.2), "{}", words);
            prop_assert!(boxes[n + 1..].iter().all(|other| gap_mm(text, other) > 0.2), "{}", words);
        }
        for line in sheet.lines.iter().filter(|_| !sheet.pages.is_empty()) {
            let shown = |at: DVec2| {
                let on = |page: &&crate::SheetPage| {
                    let [left, lower, right, upper] = page.window_mm;
                    let DVec2 { x, y } = at + page.sheet_at_mm;
                    left <= x && x <= right && lower <= y && y <= upper
                };
                sheet.pages.iter().filter(on).count()
            };
            // Ticks are beside the edge of the other page.
            let is_tick = (line.from_mm.distance(line.to_mm) - TICK_MM).abs() < 1e-9;
            let least = if line.kind == LineKind::Align && !is_tick { 2 } else { 1 };
            for part in 0..=10 {
                let part = f64::from(part) / 10.0;
                let at = line.from_mm.lerp(line.to_mm, part);
                prop_assert!(shown(at) >= least, "{:?}", line);
            }
        }
        Ok(())
    }

    /// Sheets of a target, and the part of their area that faces take.
    fn used(target: &Printing) -> (usize, f64) {
        let area = |placement: &Placement| polygon::area(&outline(target, placement));
        let faces: f64 = target.sheets.iter().flat_map(|s| &s.placements).map(area).sum();
        let paper: f64 = target.sheets.iter().map(|s| s.width_mm * s.height_mm).sum();
        (target.sheets.len(), faces / paper)
    }

    #[test]
    fn a_net_that_is_larger_than_the_paper_has_whole_faces_on_every_page() {
        let spec = TargetSpec::Solid(SolidSpec::new(SolidShape::Icosahedron));
        let family = Family::shipped("delTag25h7").unwrap();
        let paper = PaperSpec { size: Some("A4".parse().unwrap()), ..PaperSpec::default() };
        let target = Printing::build("net", &spec, Some(&family), Some(&paper)).unwrap();
        let (sheets, _) = used(&target);
        assert!(sheets <= 10, "{sheets}");
        assert_eq!(target.page_count(), sheets);
    }

    /// A sphere of 320 faces.
    #[test]
    fn pieces_of_a_mesh_are_nested() {
        let ball = deltille_core::targets::Polyhedron::icosahedron(100.0);
        let (mut vertices, mut faces) = (ball.vertices_mm, ball.faces);
        for _ in 0..2 {
            let mut between = std::collections::BTreeMap::new();
            let mut middle = |a: usize, b: usize| {
                *between.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let radius = vertices[0].length();
                    vertices.push((vertices[a] + vertices[b]).normalize() * radius);
                    vertices.len() - 1
                })
            };
            faces = faces
                .iter()
                .flat_map(|face| {
                    let [a, b, c] = face[..] else { panic!("a triangle") };
                    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(Vec::from)
                })
                .collect();
        }
        let (mesh, _) = deltille_core::targets::ClosedMesh::new(&vertices, &faces).unwrap();
        let mut spec =
            SolidSpec { tiles: 6, edge_mm: 130.0, ..SolidSpec::new(SolidShape::Mesh(mesh)) };
        spec.tags.as_mut().unwrap().family = "d36h9".to_owned();
        let family = Family::shipped("d36h9").unwrap();
        let paper = PaperSpec::default();
        let target =
            Printing::build("ball", &TargetSpec::Solid(spec), Some(&family), Some(&paper)).unwrap();
        let (sheets, part) = used(&target);
        assert!(sheets <= 4 && part >= 0.55, "{sheets} sheets, {part:.2} of them used");
        for sheet in &target.sheets {
            check_sheet(&target, sheet).unwrap();
        }
    }

    #[test]
    fn the_paper_is_the_smallest_that_takes_the_net() {
        let family = Family::shipped("delTag25h7").unwrap();
        let size = |shape| {
            let spec = TargetSpec::Solid(SolidSpec::new(shape));
            let paper = PaperSpec::default();
            let target = Printing::build("net", &spec, Some(&family), Some(&paper)).unwrap();
            [target.sheets[0].width_mm, target.sheets[0].height_mm]
        };
        assert_eq!(size(SolidShape::Tetrahedron), [420.0, 297.0]);
        assert_eq!(size(SolidShape::Octahedron), [420.0, 594.0]);
        assert_eq!(size(SolidShape::Icosahedron), [841.0, 594.0]);
    }
}
