//! The nets of solids, printed, read back and folded; and nets with deliberate faults, each of which must fail for
//! the right reason.

use std::f64::consts::TAU;
use std::path::Path;

use crate::common::command::deltille;
use crate::common::verdict::{assert_found, findings};
use deltille::artwork::{Artwork, Part};
use deltille::export::{pdf, png, sheet_file_name, svg};
use deltille::family::Family;
use deltille::layout::{Label, LineKind, PaperSpec, Printing, SheetText, SolidSheets};
use deltille::targets::{BoardSpec, SolidShape, SolidSpec, TargetSpec};
use deltille::verify::{Finding, FoldFinding, Verdict, Verifier};
use glam::DVec2;
use kurbo::Affine;
use serde_json::{Value, json};

fn family() -> Family {
    Family::shipped("delTag25h7").unwrap()
}

/// A tetrahedron small enough for every test.
fn net(paper: &PaperSpec) -> Printing {
    let spec = SolidSpec {
        edge_mm: 70.0,
        tiles: 7,
        margin_mm: 4.0,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    Printing::build("t", &TargetSpec::Solid(spec), Some(&family()), Some(paper)).unwrap()
}

/// On four pages that are joined.
fn tiled() -> Printing {
    let size = Some("100x150mm".parse().unwrap());
    net(&PaperSpec { size, solids: SolidSheets::SeamedNet, ..PaperSpec::default() })
}

/// In pieces of whole faces.
fn in_pieces() -> Printing {
    net(&PaperSpec { size: Some("100x150mm".parse().unwrap()), ..PaperSpec::default() })
}

fn draw(target: &Printing) -> Artwork {
    target.draw().unwrap()
}

/// Writes an artwork and compares it with a target.
fn verify(target: &Printing, artwork: &Artwork, extension: &str) -> Verdict {
    let folder = tempfile::tempdir().unwrap();
    let count = artwork.sheets.len();
    let path = |index| folder.path().join(sheet_file_name("t", index, count, extension));
    match extension {
        "pdf" => pdf::write(artwork, &folder.path().join("t.pdf")).unwrap(),
        "svg" => (0..count).for_each(|index| svg::write(artwork, index, &path(index)).unwrap()),
        _ => (0..count).for_each(|index| {
            png::write(&artwork.sheets[index], "t", &path(index), 300.0).unwrap()
        }),
    }
    let first = if extension == "pdf" { folder.path().join("t.pdf") } else { path(0) };
    Verifier::new(target).unwrap().verify_path(&first).unwrap()
}

#[test]
fn a_net_is_verified_in_every_format_on_one_page_and_on_several() {
    for (target, pages) in [(net(&PaperSpec::default()), 1), (tiled(), 4)] {
        assert_eq!(target.page_count(), pages);
        assert_eq!(Printing::from_json(&target.to_json()).unwrap(), target);
        for extension in ["pdf", "svg", "png"] {
            let verdict = verify(&target, &draw(&target), extension);
            assert!(verdict.passed, "{verdict}");
            let sheet = &verdict.sheets[0];
            assert_eq!((sheet.corners_found, sheet.pages), (60, pages));
            let fold = sheet.fold.unwrap();
            assert!(fold.edges == 6 && fold.max_deviation_mm < 0.02, "{fold:?}");
        }
    }
}

#[test]
fn a_net_in_pieces_is_verified_and_folded_across_its_sheets() {
    let target = in_pieces();
    assert!(target.sheets.len() > 1);
    assert!(target.sheets.iter().all(|sheet| sheet.pages.is_empty()));
    for extension in ["pdf", "svg", "png"] {
        let verdict = verify(&target, &draw(&target), extension);
        assert!(verdict.passed, "{verdict}");
    }
    let verdict = verify(&target, &draw(&target), "pdf");
    let edges: usize = verdict.sheets.iter().map(|sheet| sheet.fold.unwrap().edges).sum();
    assert_eq!(edges, 6);
    // A number that refers from one sheet to another.
    let mut renumbered = target.clone();
    let texts = &mut renumbered.sheets[0].texts;
    texts.iter_mut().find(|text| is_of_edge(text)).unwrap().text = Label::Edge(9);
    let verdict = verify(&renumbered, &draw(&renumbered), "pdf");
    assert!(!verdict.passed, "{verdict}");
}

#[test]
fn a_board_larger_than_the_paper_is_a_poster() {
    let size = Some("100x150mm".parse().unwrap());
    let paper = PaperSpec { size, poster: true, ..PaperSpec::default() };
    let spec = TargetSpec::Board(BoardSpec::deltille(5, 6, 25.0));
    let target = Printing::build("t", &spec, Some(&family()), Some(&paper)).unwrap();
    assert_eq!((target.sheets.len(), target.page_count()), (1, 4));
    assert_eq!(Printing::from_json(&target.to_json()).unwrap(), target);
    for extension in ["pdf", "svg", "png"] {
        let verdict = verify(&target, &draw(&target), extension);
        assert!(verdict.passed, "{verdict}");
        assert_eq!((verdict.sheets[0].corners_found, verdict.sheets[0].pages), (30, 4));
    }
    let mut shifted = draw(&target);
    for shape in &mut shifted.sheets[1].shapes {
        shape.path = Affine::translate((0.4, 0.0)) * &shape.path;
    }
    assert_found(&verify(&target, &shifted, "pdf"), [json!({ "kind": "pages_differ" })]);
    // Windows that cut tiles and cells into slivers ignore the slivers.
    for edge_mm in [18.0, 25.0] {
        let size = Some("A5".parse().unwrap());
        let paper = PaperSpec { size, poster: true, ..PaperSpec::default() };
        let spec = TargetSpec::Board(BoardSpec::deltille(10, 11, edge_mm));
        let target = Printing::build("t", &spec, Some(&family()), Some(&paper)).unwrap();
        let verdict = verify(&target, &draw(&target), "svg");
        assert!(verdict.passed, "{verdict}");
    }
    // A swapped page is also found in single files.
    let mut swapped = draw(&target);
    swapped.sheets.swap(0, 1);
    assert!(!verify(&target, &swapped, "svg").passed);
    // Without it, the board is rejected.
    let paper = PaperSpec { poster: false, ..paper };
    let error = Printing::build("t", &spec, Some(&family()), Some(&paper)).unwrap_err();
    assert!(error.to_string().contains("`PaperSpec::poster`"), "{error}");
}

/// Puts the panel of another placement at this one, as if the layout were wrong.
fn swap(target: &mut Printing, a: usize, b: usize) {
    let placements = &mut target.sheets[0].placements;
    (placements[a].panel, placements[b].panel) = (placements[b].panel, placements[a].panel);
}

/// Rotates a placement about the middle of its face.
fn turn(target: &mut Printing, at: usize) {
    let TargetSpec::Solid(spec) = &target.target.spec else { panic!("a solid") };
    let placement = &mut target.sheets[0].placements[at];
    let panel = target.target.panels.iter().position(|panel| panel.id == placement.panel).unwrap();
    let outline = spec.faces().unwrap().swap_remove(panel).outline_mm;
    let sides = outline.len() as f64;
    let middle = outline.iter().sum::<DVec2>() / sides;
    let kept = placement.page_from_panel(middle);
    placement.angle_rad += TAU / sides;
    let moved = placement.page_from_panel(middle);
    placement.origin_mm += kept - moved;
}

/// Whether a text is the number of an edge.
fn is_of_edge(text: &SheetText) -> bool {
    matches!(text.text, Label::Edge(_) | Label::Tab { .. })
}

/// Description and print agree and are both wrong: only folding reveals it.
#[test]
fn a_wrong_layout_does_not_fold_into_the_solid() {
    let whole = net(&PaperSpec::default());
    let mut swapped = whole.clone();
    swap(&mut swapped, 0, 2);
    let elsewhere = json!({ "kind": "face_elsewhere" });
    assert_found(&verify(&swapped, &draw(&swapped), "svg"), [elsewhere]);
    let mut turned = whole.clone();
    turn(&mut turned, 1);
    let board = turned.sheets[0].placements[1].panel;
    let in_its_place = json!({ "kind": "face_turned", "panel": board });
    assert_found(&verify(&turned, &draw(&turned), "pdf"), [in_its_place]);

    let mut renumbered = whole.clone();
    let texts = &mut renumbered.sheets[0].texts;
    let text = texts.iter_mut().find(|text| is_of_edge(text)).unwrap();
    text.text = Label::Edge(9);
    assert_found(
        &verify(&renumbered, &draw(&renumbered), "pdf"),
        [json!({ "kind": "edge_numbers" })],
    );

    type Rename = fn(&Label) -> Option<Label>;
    let cases: [(Rename, Value); 2] = [
        (
            |label| (*label == Label::Face(1)).then_some(Label::Face(2)),
            json!({ "kind": "face_number", "names": [2], "stated": 1 }),
        ),
        (
            |label| match *label {
                Label::Tab { edge, under: 2 } => Some(Label::Tab { edge, under: 0 }),
                _ => None,
            },
            json!({ "kind": "tab_names", "named": 0, "stated": 2 }),
        ),
    ];
    for (rename, finding) in cases {
        let mut misnamed = whole.clone();
        let texts = &mut misnamed.sheets[0].texts;
        let (label, text) =
            texts.iter_mut().find_map(|text| Some((rename(&text.text)?, text))).unwrap();
        text.text = label;
        assert_found(&verify(&misnamed, &draw(&misnamed), "pdf"), [finding]);
    }
    let folds = whole.sheets[0].lines.iter().enumerate();
    let folds: Vec<usize> =
        folds.filter(|(_, line)| line.kind == LineKind::Fold).map(|(index, _)| index).collect();
    assert_eq!(folds.len(), 6, "three between faces, three of tabs");
    for fold in folds {
        let mut unhinged = whole.clone();
        unhinged.sheets[0].lines[fold].kind = LineKind::Cut;
        let verdict = verify(&unhinged, &draw(&unhinged), "pdf");
        let is_it = |finding: &Finding| match finding {
            Finding::Fold(FoldFinding::FaceLoose { .. }) => true,
            Finding::Fold(FoldFinding::EdgeTabs { tabs, .. }) => *tabs == 0,
            _ => false,
        };
        assert!(!verdict.passed && findings(&verdict).any(is_it), "{verdict}");
    }
}

/// The same for a cube: the sides of a face rotated by 90° coincide with the original ones.
#[test]
fn a_rotated_square_does_not_fold_into_the_cube() {
    let spec = SolidSpec { edge_mm: 70.0, ..SolidSpec::new(SolidShape::Cube) };
    let family = Family::shipped("aprilTag36h11").unwrap();
    let paper = PaperSpec::default();
    let cube = Printing::build("t", &TargetSpec::Solid(spec), Some(&family), Some(&paper)).unwrap();
    let verdict = |target: &Printing| {
        let artwork = target.draw().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.svg");
        svg::write(&artwork, 0, &path).unwrap();
        Verifier::new(target).unwrap().verify_path(&path).unwrap()
    };
    let whole = verdict(&cube);
    assert!(whole.passed && whole.sheets[0].fold.unwrap().edges == 12, "{whole}");
    let mut turned = cube.clone();
    turn(&mut turned, 2);
    let board = turned.sheets[0].placements[2].panel;
    let quarter = json!({ "kind": "face_turned", "panel": board, "angle_deg": 90.0 });
    assert_found(&verdict(&turned), [quarter]);
    let mut swapped = cube.clone();
    swap(&mut swapped, 0, 4);
    let elsewhere = json!({ "kind": "face_elsewhere" });
    assert_found(&verdict(&swapped), [elsewhere]);
}

/// The print differs from a correct description.
#[test]
fn a_print_that_differs_from_its_description_fails() {
    let whole = net(&PaperSpec::default());
    let mut swapped = whole.clone();
    swap(&mut swapped, 0, 2);
    let [a, b] = [0, 2].map(|at| whole.sheets[0].placements[at].panel);
    let elsewhere = |a, b| json!({ "kind": "face_elsewhere", "panel": a, "instead": b });
    assert_found(&verify(&whole, &draw(&swapped), "svg"), [elsewhere(a, b), elsewhere(b, a)]);
    let mut turned = whole.clone();
    turn(&mut turned, 1);
    assert_found(&verify(&whole, &draw(&turned), "png"), [json!({ "kind": "face_turned" })]);

    let mut renumbered = whole.clone();
    let texts = &mut renumbered.sheets[0].texts;
    let text = texts.iter().position(is_of_edge).unwrap();
    texts[text].text = Label::Edge(19);
    let differs = json!({ "kind": "text_differs", "text": text + 1 });
    assert_found(&verify(&whole, &draw(&renumbered), "pdf"), [differs]);

    let line = |kind: LineKind| json!({ "kind": "line_differs", "purpose": kind });
    for kind in [LineKind::Fold, LineKind::Cut] {
        let mut erased = draw(&whole);
        let shapes = &mut erased.sheets[0].shapes;
        let is_it = |part: Part| matches!(part, Part::Line { kind: k, .. } if k == kind);
        let first = shapes.iter().position(|shape| is_it(shape.part)).unwrap();
        shapes.remove(first);
        assert_found(&verify(&whole, &erased, "pdf"), [line(kind)]);
    }
    // A fold line drawn through would be cut.
    let mut through = whole.clone();
    let lines = &mut through.sheets[0].lines;
    lines.iter_mut().find(|line| line.kind == LineKind::Fold).unwrap().kind = LineKind::Cut;
    assert_found(&verify(&whole, &draw(&through), "pdf"), [line(LineKind::Fold)]);
}

#[test]
fn pages_that_do_not_join_are_found() {
    let target = tiled();
    let mut shifted = draw(&target);
    for shape in &mut shifted.sheets[1].shapes {
        shape.path = Affine::translate((0.4, 0.0)) * &shape.path;
    }
    assert_found(&verify(&target, &shifted, "pdf"), [json!({ "kind": "pages_differ" })]);
    let mut unnamed = draw(&target);
    let texts = target.sheets[0].texts.len();
    let own = |part: Part| matches!(part, Part::Label { index } if index >= texts);
    unnamed.sheets[2].shapes.retain(|shape| !own(shape.part));
    let finding = json!({ "kind": "text_differs", "text": 1 });
    let on_page = json!({ "kind": "on_page", "page": "3", "finding": finding });
    assert_found(&verify(&target, &unnamed, "svg"), [on_page]);
}

/// Returns the report of `verify` on a file.
fn report(folder: &Path, args: &str, code: i32) -> Value {
    deltille(folder, &format!("verify {args} --report r.json")).code(code);
    serde_json::from_slice(&std::fs::read(folder.join("r.json")).unwrap()).unwrap()
}

#[test]
fn every_solid_prints_as_a_net() {
    for (solid, edges, corners) in
        [("tetrahedron", 6, 60), ("octahedron", 12, 120), ("icosahedron", 30, 300)]
    {
        let folder = tempfile::tempdir().unwrap();
        let args =
            format!("{solid} --edge 60mm --tiles 7 --face-margin 4mm --pdf --svg --no-verify");
        deltille(folder.path(), &args).success();
        let report = report(folder.path(), &format!("{solid}.json"), 0);
        let artifacts = report["artifacts"].as_array().unwrap();
        assert_eq!(artifacts.len(), 2);
        for artifact in artifacts {
            let sheet = &artifact["sheets"][0];
            assert_eq!(
                (&sheet["corners_found"], &sheet["fold"]["edges"]),
                (&corners.into(), &edges.into())
            );
        }
    }
}

#[test]
fn a_net_larger_than_the_paper_takes_several_pages() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "octahedron --edge 130mm --tiles 7 --pdf --svg --paper A4 --allow-seams")
        .success();
    // Any of the files stands for all; a missing file is named.
    let whole = report(at, "octahedron.json octahedron-3.svg", 0);
    let sheet = &whole["artifacts"][0]["sheets"][0];
    assert_eq!((&sheet["pages"], &sheet["corners_found"]), (&3.into(), &120.into()));
    std::fs::remove_file(at.join("octahedron-2.svg")).unwrap();
    let cut = report(at, "octahedron.json octahedron-3.svg", 1);
    let missing = serde_json::json!({ "kind": "page_missing", "page": "octahedron-2.svg" });
    assert_eq!(cut["artifacts"][0]["findings"], serde_json::json!([missing]));
}

/// Returns an octahedron of unit edges with a tetrahedron on each face, as OBJ: 24 equilateral triangles, concave
/// along the edges of the octahedron.
fn spikes() -> String {
    let reach = 0.5f64.sqrt();
    let mut text = String::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut vertex = [0.0; 3];
            vertex[axis] = sign * reach;
            text += &format!("v {} {} {}\n", vertex[0], vertex[1], vertex[2]);
        }
    }
    for octant in 0..8 {
        let signs = [0, 1, 2].map(|axis| (octant >> axis) & 1);
        let [x, y, z] = signs.map(|sign| if sign == 0 { reach } else { -reach });
        text += &format!("v {x} {y} {z}\n");
        let mut base = [0, 1, 2].map(|axis| 2 * axis + signs[axis] + 1);
        if signs.iter().sum::<usize>() % 2 == 1 {
            base.swap(1, 2);
        }
        for side in 0..3 {
            text += &format!("f {} {} {}\n", base[side], base[(side + 1) % 3], 7 + octant);
        }
    }
    text
}

/// A concave mesh: its net folds in both directions, on paper and for a cutter.
#[test]
fn a_concave_mesh_prints_as_a_net_and_as_single_faces() {
    let folder = tempfile::tempdir().unwrap();
    // A name that is not the name of a shape.
    std::fs::write(folder.path().join("icosahedron.obj"), spikes()).unwrap();
    let mesh = "solid --mesh icosahedron.obj --edge 60mm --tiles 7 --face-margin 4mm";
    deltille(folder.path(), &format!("{mesh} --pdf --dxf")).success();
    let report = report(folder.path(), "icosahedron.json icosahedron.pdf", 0);
    let sheet = &report["artifacts"][0]["sheets"][0];
    assert_eq!((&sheet["corners_found"], &sheet["fold"]["edges"]), (&360.into(), &36.into()));
    let json = std::fs::read_to_string(folder.path().join("icosahedron.json")).unwrap();
    let target = Printing::from_json(&json).unwrap();
    let count = |kind| {
        let lines = target.sheets.iter().flat_map(|sheet| &sheet.lines);
        lines.filter(|line| line.kind == kind).count()
    };
    let (folds, valleys) = (count(LineKind::Fold), count(LineKind::Valley));
    // The 12 edges of the octahedron are valley folds, whether they join faces or tabs.
    assert_eq!((folds, valleys), (24, 12));
    let dxf = std::fs::read_to_string(folder.path().join("icosahedron-net.dxf")).unwrap();
    let lines = |layer: &str| dxf.matches(&format!("\nLINE\n  8\n{layer}\n")).count();
    assert_eq!((lines("FOLD"), lines("VALLEY")), (folds, valleys));

    deltille(folder.path(), &format!("{mesh} --pdf --per-face --paper 110x130mm --name faces"))
        .success();
    let report = self::report(folder.path(), "faces.json faces.pdf", 0);
    assert_eq!(report["artifacts"][0]["sheets"].as_array().unwrap().len(), 24);
}
