//! The nets of solids: printed, read back, folded; and nets broken on purpose, each of which must
//! fail for the right reason.

use std::f64::consts::TAU;

use crate::common::command::{deltille, refused};
use deltille::artwork::{self, Artwork, Part};
use deltille::export::{pdf, png, sheet_file_name, svg};
use deltille::family::Family;
use deltille::targets::{
    Label, LineKind, PaperSpec, SheetText, SolidShape, SolidSpec, Target, TargetSpec,
};
use deltille::verify::{Finding, Verdict, Verifier};
use glam::DVec2;
use kurbo::Affine;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

fn family() -> Family {
    Family::shipped("delTag25h7").unwrap()
}

/// A tetrahedron that is small enough for every test.
fn net(paper: &PaperSpec) -> Target {
    let spec = SolidSpec {
        edge_mm: 70.0,
        tiles: 7,
        margin_mm: 4.0,
        ..SolidSpec::new(SolidShape::Tetrahedron)
    };
    Target::build("t", &TargetSpec::Solid(spec), Some(&family()), Some(paper)).unwrap()
}

fn tiled() -> Target {
    net(&PaperSpec { size: Some("100x150mm".parse().unwrap()), ..PaperSpec::default() })
}

fn draw(target: &Target) -> Artwork {
    artwork::draw(target, Some(&family())).unwrap()
}

/// Writes an artwork and compares it with a target.
fn verify(target: &Target, artwork: &Artwork, extension: &str) -> Verdict {
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
    Verifier::new(target, Some(&family())).unwrap().verify_path(&first).unwrap()
}

#[track_caller]
fn assert_fails(verdict: &Verdict, reasons: &[&str]) {
    let all = verdict.findings.iter().chain(verdict.sheets.iter().flat_map(|s| &s.findings));
    let all: Vec<String> = all.map(Finding::to_string).collect();
    assert!(!verdict.passed && verdict.to_string().contains("FAILED"), "{verdict}");
    for reason in reasons {
        assert!(all.iter().any(|finding| finding.contains(reason)), "no {reason:?} in {all:#?}");
    }
}

#[test]
fn a_net_is_proved_in_every_format_on_one_page_and_on_several() {
    for (target, pages) in [(net(&PaperSpec::default()), 1), (tiled(), 4)] {
        assert_eq!(target.page_count(), pages);
        assert_eq!(Target::from_json(&target.to_json()).unwrap(), target);
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

/// The panel of another placement in the place of this one, as if the layout were wrong.
fn swap(target: &mut Target, a: usize, b: usize) {
    let placements = &mut target.sheets[0].placements;
    (placements[a].panel, placements[b].panel) = (placements[b].panel, placements[a].panel);
}

/// A placement turned about the middle of its face.
fn turn(target: &mut Target, at: usize) {
    let TargetSpec::Solid(spec) = &target.spec else { panic!("a solid") };
    let placement = &mut target.sheets[0].placements[at];
    let panel = target.panels.iter().position(|panel| panel.id == placement.panel).unwrap();
    let outline = spec.faces().unwrap()[panel].outline_mm;
    let middle = outline.iter().sum::<DVec2>() / 3.0;
    let kept = placement.page_from_panel(middle);
    placement.angle_rad += TAU / 3.0;
    let moved = placement.page_from_panel(middle);
    placement.origin_mm += kept - moved;
}

/// Whether a text is the number of an edge.
fn is_of_edge(text: &SheetText) -> bool {
    matches!(text.text, Label::Edge(_) | Label::Tab { .. })
}

/// Description and print agree, and are both wrong: only the fold tells.
#[test]
fn a_wrong_layout_does_not_fold_into_the_solid() {
    let whole = net(&PaperSpec::default());
    let mut swapped = whole.clone();
    swap(&mut swapped, 0, 2);
    assert_fails(&verify(&swapped, &draw(&swapped), "svg"), &["is printed where board"]);
    let mut turned = whole.clone();
    turn(&mut turned, 1);
    let board = turned.sheets[0].placements[1].panel;
    let reason = format!("board {board} is turned by 120° in its place");
    assert_fails(&verify(&turned, &draw(&turned), "pdf"), &[&reason]);

    let mut renumbered = whole.clone();
    let texts = &mut renumbered.sheets[0].texts;
    let text = texts.iter_mut().find(|text| is_of_edge(text)).unwrap();
    text.text = Label::Edge(9);
    assert_fails(&verify(&renumbered, &draw(&renumbered), "pdf"), &["9 on the "]);

    type Rename = fn(&Label) -> Option<Label>;
    let cases: [(Rename, &str); 2] = [
        (
            |label| (*label == Label::Face(1)).then_some(Label::Face(2)),
            "carries 2 instead of face 1",
        ),
        (
            |label| match *label {
                Label::Tab { edge, under: 2 } => Some(Label::Tab { edge, under: 0 }),
                _ => None,
            },
            "names face 0 instead of 2",
        ),
    ];
    for (rename, said) in cases {
        let mut misnamed = whole.clone();
        let texts = &mut misnamed.sheets[0].texts;
        let (label, text) =
            texts.iter_mut().find_map(|text| Some((rename(&text.text)?, text))).unwrap();
        text.text = label;
        assert_fails(&verify(&misnamed, &draw(&misnamed), "pdf"), &[said]);
    }
    let folds = whole.sheets[0].lines.iter().enumerate();
    let folds: Vec<usize> =
        folds.filter(|(_, line)| line.kind == LineKind::Fold).map(|(index, _)| index).collect();
    assert_eq!(folds.len(), 6, "three between faces, three of tabs");
    for fold in folds {
        let mut unhinged = whole.clone();
        unhinged.sheets[0].lines[fold].kind = LineKind::Cut;
        let verdict = verify(&unhinged, &draw(&unhinged), "pdf");
        let said = verdict.to_string();
        assert!(!verdict.passed, "{verdict}");
        assert!(said.contains("hangs on no other") || said.contains("0 tabs"), "{verdict}");
    }
}

/// The print differs from a right description.
#[test]
fn a_wrong_print_is_told_from_its_description() {
    let whole = net(&PaperSpec::default());
    let mut swapped = whole.clone();
    swap(&mut swapped, 0, 2);
    let [a, b] = [0, 2].map(|at| whole.sheets[0].placements[at].panel);
    let reasons = [
        format!("board {a} is printed where board {b} belongs"),
        format!("board {b} is printed where board {a} belongs"),
    ];
    assert_fails(&verify(&whole, &draw(&swapped), "svg"), &[&reasons[0], &reasons[1]]);
    let mut turned = whole.clone();
    turn(&mut turned, 1);
    assert_fails(&verify(&whole, &draw(&turned), "png"), &["turned by 120° in its place"]);

    let mut renumbered = whole.clone();
    let texts = &mut renumbered.sheets[0].texts;
    let text = texts.iter().position(is_of_edge).unwrap();
    texts[text].text = Label::Edge(19);
    let reason = format!("label {} differs", text + 1);
    assert_fails(&verify(&whole, &draw(&renumbered), "pdf"), &[&reason]);

    let kinds = [("to fold", LineKind::Fold), ("to cut", LineKind::Cut)];
    for (reason, kind) in kinds {
        let mut erased = draw(&whole);
        let shapes = &mut erased.sheets[0].shapes;
        let is_it = |part: Part| matches!(part, Part::Line { kind: k, .. } if k == kind);
        let first = shapes.iter().position(|shape| is_it(shape.part)).unwrap();
        shapes.remove(first);
        assert_fails(&verify(&whole, &erased, "pdf"), &[reason]);
    }
    // A fold drawn through would be cut.
    let mut through = whole.clone();
    let lines = &mut through.sheets[0].lines;
    lines.iter_mut().find(|line| line.kind == LineKind::Fold).unwrap().kind = LineKind::Cut;
    assert_fails(&verify(&whole, &draw(&through), "pdf"), &["to fold, differs"]);
}

#[test]
fn pages_that_do_not_join_are_found() {
    let target = tiled();
    let mut shifted = draw(&target);
    for shape in &mut shifted.sheets[1].shapes {
        shape.path = Affine::translate((0.4, 0.0)) * &shape.path;
    }
    assert_fails(&verify(&target, &shifted, "pdf"), &["differ where they overlap"]);
    let mut unnamed = draw(&target);
    let texts = target.sheets[0].texts.len();
    let own = |part: Part| matches!(part, Part::Label { index } if index >= texts);
    unnamed.sheets[2].shapes.retain(|shape| !own(shape.part));
    assert_fails(&verify(&target, &unnamed, "svg"), &["page B1: label 1 differs"]);
}

#[test]
fn every_solid_prints_as_a_net() {
    for (solid, edges, corners) in
        [("tetrahedron", 6, 60), ("octahedron", 12, 120), ("icosahedron", 30, 300)]
    {
        let folder = tempfile::tempdir().unwrap();
        let args = format!("{solid} --edge 60mm --tiles 7 --face-margin 4mm --pdf --svg");
        let said = format!("{edges} edges matched");
        let found = format!("{corners} corners within");
        deltille(folder.path(), &args)
            .success()
            .stdout(contains("verified: 2 files").and(contains(found)).and(contains(said)));
    }
}

#[test]
fn a_net_larger_than_the_paper_takes_several_pages() {
    let folder = tempfile::tempdir().unwrap();
    let args = "octahedron --edge 130mm --tiles 7 --pdf --svg --paper A4";
    deltille(folder.path(), args)
        .success()
        .stdout(contains("octahedron-1.svg to octahedron-3.svg: verified, 3 pages, 120 corners"));
    // Any of the files stands for all; one that is missing is named.
    deltille(folder.path(), "verify octahedron.json octahedron-3.svg").success();
    std::fs::remove_file(folder.path().join("octahedron-2.svg")).unwrap();
    deltille(folder.path(), "verify octahedron.json octahedron-3.svg")
        .code(1)
        .stdout(contains("octahedron-2.svg is missing"));
}

#[test]
fn nets_that_cannot_be_made_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for (args, said) in [
        ("icosahedron --pdf --edge 3m", "an --edge of at most "),
        ("icosahedron --pdf --paper A5 --edge 440mm", "or larger --paper"),
        ("icosahedron --pdf --face-margin 1mm", "--per-face"),
        ("icosahedron --pdf --paper 50x60mm", "--paper"),
    ] {
        let stderr = refused(folder.path(), args);
        assert!(stderr.contains(said), "{args}: {stderr}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// An octahedron of unit edges with a tetrahedron on each face, as OBJ: 24 equilateral triangles,
/// concave along the edges of the octahedron.
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

/// A concave mesh: its net folds both ways, on paper and for a cutter.
#[test]
fn a_concave_mesh_prints_as_a_net_and_as_single_faces() {
    let folder = tempfile::tempdir().unwrap();
    // A name that is no name of a shape.
    std::fs::write(folder.path().join("icosahedron.obj"), spikes()).unwrap();
    let mesh = "solid --mesh icosahedron.obj --edge 60mm --tiles 7 --face-margin 4mm";
    let said = "folds into the solid within";
    deltille(folder.path(), &format!("{mesh} --pdf --dxf"))
        .success()
        .stdout(contains("360 corners within"))
        .stdout(contains(said).and(contains("36 edges matched")));
    let json = std::fs::read_to_string(folder.path().join("icosahedron.json")).unwrap();
    let target = Target::from_json(&json).unwrap();
    let count = |kind| {
        let lines = target.sheets.iter().flat_map(|sheet| &sheet.lines);
        lines.filter(|line| line.kind == kind).count()
    };
    let (folds, valleys) = (count(LineKind::Fold), count(LineKind::Valley));
    // The 12 edges of the octahedron are valleys, whether they join faces or tabs.
    assert_eq!((folds, valleys), (24, 12));
    let dxf = std::fs::read_to_string(folder.path().join("icosahedron-net.dxf")).unwrap();
    let lines = |layer: &str| dxf.matches(&format!("\nLINE\n  8\n{layer}\n")).count();
    assert_eq!((lines("FOLD"), lines("VALLEY")), (folds, valleys));

    deltille(folder.path(), &format!("{mesh} --pdf --per-face --name faces"))
        .success()
        .stdout(contains("faces.pdf: verified, 24 pages"));
}
