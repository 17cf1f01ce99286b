//! Sheets of a net: on one sheet, over several pages, or in pieces.

use glam::DVec2;

use super::choice::{Nested, Net, nest_on, nets, outlines};
use super::drawing::{BLANK_MM, Drawing, WORDS_MM, instructions};
use super::plane::Motion;
use super::tabs::Tab;
use super::unfold::{Piece, Sides};
use crate::Placement;
use crate::SheetLayout;
use crate::paper::{PaperSpec, SolidSheets};
use crate::placing::arrangement::{Arrangement, Footprint, fit_upright};
use crate::placing::poster::{MAX_PAGES, Poster};
use deltille_core::lattice::Vertex;
use deltille_core::polygon;
use deltille_core::setting::Setting::{
    PaperPages, PaperSize, SolidEdgeMm, SolidMarginMm, SolidSheetsPerFace, SolidSheetsSeamedNet,
};
use deltille_core::targets::format_mm;
use deltille_core::targets::{FamilyRef, Panel, SolidSpec, TargetError};
use deltille_core::words::counted;

/// Smallest face margin with room for numbers, mm.
const MIN_MARGIN_MM: f64 = 2.5;

/// Smallest usable area for pieces of a net, mm.
const MIN_ROOM_MM: f64 = 40.0;

/// A piece of a net placed on a sheet.
struct Laid<'a> {
    piece: &'a Piece,
    tabs: &'a [Tab],
    arrangement: Arrangement,
    page_from_net: Motion,
}

/// Lays out the sheets of a solid's net.
pub(crate) fn sheets(
    name: &str,
    spec: &SolidSpec,
    panels: &[Panel],
    family: Option<&FamilyRef>,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    if spec.margin_mm < MIN_MARGIN_MM {
        let problem = format!(
            "the numbers of a net are printed in the face margins: use at least {} instead of {}, or \
             {SolidSheetsPerFace}",
            format_mm(MIN_MARGIN_MM),
            format_mm(spec.margin_mm)
        );
        return Err(TargetError::invalid(SolidMarginMm, problem));
    }
    if let (Some(most), None) = (paper.pages.filter(|pages| *pages > 1), &paper.size) {
        for size in paper.sizes() {
            let paper = PaperSpec { size: Some(size), ..paper.clone() };
            let sheets = sheets(name, spec, panels, family, &paper);
            if let Ok(sheets) = sheets
                && sheets.iter().map(SheetLayout::page_count).sum::<usize>() <= most as usize
            {
                return Ok(sheets);
            }
        }
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
            best = Some((area, sheet_of_one(&drawing, &laid)));
        }
    }
    match best {
        Some((_, sheet)) => Ok(vec![sheet]),
        None if paper.solids == SolidSheets::SeamedNet => seamed(&nets, spec, &drawing, paper),
        None => nested(spec, &drawing, paper),
    }
}

/// Lays out a net in one piece that fits the paper.
fn sheet_of_one(drawing: &Drawing, laid: &Laid) -> SheetLayout {
    let mut sheet = laid.arrangement.sheet(0, [0.0; 4], drawing.label("net"));
    sheet.placements.clear();
    drawing.draw(&mut sheet, laid.piece, laid.tabs, &laid.page_from_net);
    let [left, lower, right, _] = laid.arrangement.clear_mm();
    drawing.explain(&mut sheet, DVec2::new(left, lower + BLANK_MM), right - BLANK_MM, None);
    sheet
}

/// Lays out a net larger than the paper over pages that are joined along seams.
fn seamed(
    nets: &[Net],
    spec: &SolidSpec,
    drawing: &Drawing,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let [net, ..] = nets else {
        let problem = format!("the faces leave no room for glue tabs: use {SolidSheetsPerFace}");
        return Err(TargetError::invalid(SolidEdgeMm, problem));
    };
    let what = format!("the net of a solid with {} edges", format_mm(spec.edge_mm));
    let count = net.pieces.len();
    let pieces = net.pieces.iter().zip(&net.tabs).enumerate();
    let sheets: Vec<SheetLayout> = pieces
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
            Ok::<_, TargetError>(sheet)
        })
        .collect::<Result<_, _>>()?;
    let pages: usize = sheets.iter().map(SheetLayout::page_count).sum();
    if let Some(allowed) = paper.pages.filter(|&allowed| pages > allowed as usize) {
        let problem = format!(
            "{what} takes {pages} pages, but {allowed} are allowed: allow more, or use a shorter {SolidEdgeMm} or a \
             larger {PaperSize}"
        );
        return Err(TargetError::invalid(PaperPages, problem));
    }
    Ok(sheets)
}

/// Nests pieces of whole faces on pages. They go on the smallest paper that fits all of them on one page, or on the allowed number
/// of pages. Otherwise they go on as few pages as possible of the requested size, or of the largest.
fn nested(
    spec: &SolidSpec,
    drawing: &Drawing,
    paper: &PaperSpec,
) -> Result<Vec<SheetLayout>, TargetError> {
    let sizes = paper.sizes();
    let flat = outlines(drawing.faces);
    let area: f64 = flat.iter().map(|face| polygon::area(face)).sum();
    let most = paper.pages.map_or(1, |pages| pages.max(1) as usize);
    for (index, size) in sizes.iter().enumerate() {
        let paper = PaperSpec { size: Some(size.clone()), ..paper.clone() };
        let least = Footprint {
            width: MIN_ROOM_MM,
            height: MIN_ROOM_MM + WORDS_MM,
            edge_blank: paper.margin_mm,
            mark_blank: BLANK_MM,
            is_centred: false,
        };
        let is_last = index + 1 == sizes.len();
        let Some(page) = fit_upright(&least, &paper)? else { continue };
        let [left, lower, right, upper] = page.clear_mm();
        let room = DVec2::new(right - left - BLANK_MM, upper - lower - WORDS_MM - BLANK_MM);
        let is_limited = !is_last || paper.pages.is_some();
        if is_limited && area > most as f64 * room.element_product() {
            if is_last {
                return Err(too_many_pages(spec, &size.to_string(), most));
            }
            continue;
        }
        let Some(Nested { net, places, pages: count }) = nest_on(&flat, drawing.sides, room) else {
            continue;
        };
        if count > most && !is_last {
            continue;
        }
        if paper.pages.is_some() && count > most {
            return Err(too_many_pages(spec, &size.to_string(), most));
        }
        if count > MAX_PAGES {
            let problem = format!(
                "the net of a solid with {} edges takes {count} pages of {size}, more than can be assembled: use \
                 {SolidSheetsPerFace}, a shorter {SolidEdgeMm}, or a larger {PaperSize}",
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
    Err(too_large_face(spec, paper))
}

/// Returns the error of a face that is larger than the largest paper.
fn too_large_face(spec: &SolidSpec, paper: &PaperSpec) -> TargetError {
    let size = paper.sizes().last().map(ToString::to_string).unwrap_or_default();
    let larger = paper.size.as_ref().map_or(String::new(), |_| format!(", a larger {PaperSize}"));
    let problem = format!(
        "a face with {} edges and its tabs is larger than {size}: use {SolidSheetsSeamedNet}{larger}, or a shorter \
         {SolidEdgeMm}",
        format_mm(spec.edge_mm),
    );
    TargetError::invalid(SolidEdgeMm, problem)
}

/// Returns the error of a net that does not fit on the allowed number of pages.
fn too_many_pages(spec: &SolidSpec, size: &str, most: usize) -> TargetError {
    let problem = format!(
        "the net of a solid with {} edges takes more than {} of {size}: allow more, or use a shorter {SolidEdgeMm} or a larger \
         {PaperSize}",
        format_mm(spec.edge_mm),
        counted(most, "page"),
    );
    TargetError::invalid(PaperPages, problem)
}

/// Returns the convex outline of the tiles of a face, in the panel frame, mm.
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

/// Converts points of a panel to page positions, mm.
fn on_page(placement: &Placement, points: &[DVec2]) -> Vec<DVec2> {
    points.iter().map(|&p| placement.page_from_panel(p)).collect()
}

/// Returns all corners of a piece and its tabs.
fn points(piece: &Piece, tabs: &[Tab]) -> Vec<DVec2> {
    let faces = piece.iter().flat_map(|face| face.corners.iter().copied());
    faces.chain(tabs.iter().flat_map(|tab| tab.corners)).collect()
}

/// Lays a piece on the smallest paper that fits it, rotated as little as possible.
fn lay<'a>(
    piece: &'a Piece,
    tabs: &'a [Tab],
    paper: &PaperSpec,
) -> Result<Option<Laid<'a>>, TargetError> {
    let sizes = paper.sizes();
    let points = points(piece, tabs);
    // Upright first, then with increasing slant.
    let slanted = (1..18).flat_map(|n| [5 * n, -5 * n]).filter(|n| n % 90 != 0);
    let rotations: Vec<f64> =
        [0, 90].into_iter().chain(slanted).map(|n| f64::from(n).to_radians()).collect();
    for size in sizes {
        let paper = PaperSpec { size: Some(size), ..paper.clone() };
        for &angle in &rotations {
            let turn = Motion::turning(angle);
            let turned: Vec<DVec2> = points.iter().map(|&p| turn.apply(p)).collect();
            let [left, lower, right, upper] = polygon::bounds(&turned);
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

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::super::drawing::width;
    use super::super::plane::gap_mm;
    use super::*;
    use crate::placing::poster::TICK_MM;
    use crate::{LineKind, Printing, SheetText};
    use deltille_core::family::Family;
    use deltille_core::targets::{SolidShape, TargetSpec};

    /// Estimated bounding rectangle of a line of text.
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

        /// Every face appears once, does not overlap another, and lies on its sheet. No text overlaps lines, tiles or
        /// other texts. On a sheet of several pages, every line is shown, and every cross appears on two pages.
        #[test]
        fn marks_of_a_net_do_not_overlap(
            shape in 0usize..5, edge_mm in 60.0f64..200.0, tiles in 6u32..12, margin_mm in 2.5f64..7.0,
            paper in 0usize..3, seams in any::<bool>(),
        ) {
            use SolidShape::{Cube, Cuboid, Icosahedron, Octahedron, Tetrahedron};
            let box_of = Cuboid(DVec3::new(2.0, 1.6, 1.2));
            let has_squares = shape > 2;
            // The largest edge whose faces fit A4.
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
            // Ticks lie beside the edge of the other page.
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

    /// Number of sheets of a target, and the fraction of their area that its faces cover.
    fn used(target: &Printing) -> (usize, f64) {
        let area = |placement: &Placement| polygon::area(&outline(target, placement));
        let faces: f64 = target.sheets.iter().flat_map(|s| &s.placements).map(area).sum();
        let paper: f64 = target.sheets.iter().map(|s| s.width_mm * s.height_mm).sum();
        (target.sheets.len(), faces / paper)
    }

    #[test]
    fn a_net_larger_than_the_paper_has_whole_faces_on_every_page() {
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
        assert!(sheets <= 4 && part >= 0.55, "{sheets} sheets, {part:.2} of their area used");
        for sheet in &target.sheets {
            check_sheet(&target, sheet).unwrap();
        }
    }

    #[test]
    fn the_usual_edge_is_the_largest_that_fits_the_pages() {
        use SolidShape::{Cube, Octahedron, Tetrahedron};
        for (shape, size, pages) in
            [(Tetrahedron, "A4", None), (Octahedron, "A4", Some(3)), (Cube, "A3", Some(2))]
        {
            let paper =
                PaperSpec { size: Some(size.parse().unwrap()), pages, ..PaperSpec::default() };
            let spec = SolidSpec { tags: None, ..SolidSpec::new(shape) };
            let edge_mm = crate::usual_solid_edge_mm(&spec, &paper);
            let count = |edge_mm: f64| {
                let spec = TargetSpec::Solid(SolidSpec { edge_mm, ..spec.clone() });
                let printing = Printing::build("net", &spec, None, Some(&paper));
                printing.map_or(usize::MAX, |printing| printing.page_count())
            };
            let most = pages.unwrap_or(1) as usize;
            assert!(count(edge_mm) <= most && count(edge_mm + 1.0) > most, "{edge_mm}");
        }
    }

    #[test]
    fn the_smallest_paper_that_fits_the_net_is_used() {
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
