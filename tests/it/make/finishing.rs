//! Boards for glass, print shops and lasers: mirrored, with spot colours, and as outlines to engrave. They are
//! generated, verified, and rejected after changes. `tests/independent/finishes.py` reads them with other programs.

use crate::common::page::Page;
use deltille::artwork::{CutDrawing, CutLayer, to_laser};
use deltille::export::{dxf, laser_svg, pdf, svg};
use deltille::layout::{Finish, Printing};
use deltille::targets::BoardSpec;
use deltille::verify::{Artifact, verify};

#[test]
fn boards_are_made_for_glass_print_shops_and_lasers() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "board --rows 5 --cols 6 --edge 20mm --name pane --mirrored --pdf --svg --png --dpi 200",
        "board --rows 5 --cols 6 --edge 20mm --name plate --white RDG_WHITE --contour CutContour",
        "board --rows 4 --cols 5 --edge 12mm --name cards --boards 4 --pack --contour Thru-cut --white White",
        "checkerboard --rows 4 --cols 5 --edge 30mm --name squares --tags t25h9 --tags-in white --invert --laser dxf,svg --kerf 0.2mm",
        "board --rows 5 --cols 6 --edge 20mm --name etched --mirrored --invert --laser dxf,svg --kerf 0.006in",
        "charuco --squares 5x4 --mirrored --laser dxf --pdf",
        "circles --circles 5x4 --laser svg --kerf 0.1mm",
        "octahedron --edge 100mm --tiles 6 --name eight --skeleton --laser dxf,svg --kerf 0.1mm",
    ] {
        page.run(at, &format!("deltille {arguments}"));
    }
    page.run(at, "deltille verify pane.json");
    page.run(at, "deltille verify squares.json squares-laser.svg");
    page.title("Rejected");
    let board = "deltille board --rows 5 --cols 6 --edge 20mm --name no";
    for arguments in [
        "--laser dxf --kerf 0.6mm",
        "--laser dxf --kerf -1mm",
        "--laser png",
        "--kerf 0.1mm",
        "--white White --svg",
        "--contour CutContour --laser dxf",
        "--white Black",
        "--contour a/b",
        "--white White --contour White",
        "--mirrored --gltf",
        "--mirrored --paper 100x120mm --poster",
    ] {
        page.run(at, &format!("{board} {arguments}"));
    }
    page.run(at, "deltille octahedron --kerf 0.1mm");
    page.is("finishes");
}

/// Creates a board with a finish.
fn board(mirrored: bool, white: bool, contour: bool) -> Printing {
    let finish = Finish {
        mirrored,
        white: white.then(|| "White".to_owned()),
        contour: contour.then(|| "CutContour".to_owned()),
    };
    let board = Printing::new("desk", BoardSpec::deltille(3, 4, 20.0)).unwrap();
    board.finished(finish, 5.0).unwrap()
}

/// Returns the verdict on a file.
fn said(target: &Printing, name: &str, bytes: impl Into<Vec<u8>>) -> String {
    let file = [Artifact::new(name, bytes.into())];
    verify(target, name, &file).unwrap().to_string()
}

#[test]
fn pages_are_mirrored_exactly_where_the_description_says_so() {
    let [plain, pane] = [false, true].map(|mirrored| board(mirrored, false, false));
    let page = |target: &Printing| svg::to_string(&target.draw().unwrap(), 0);
    assert!(said(&pane, "desk.svg", page(&pane)).contains("verified, 12 corners"));
    let wrong = said(&pane, "desk.svg", page(&plain));
    assert!(wrong.contains("board 0 is not mirrored, but should be"), "{wrong}");
    let wrong = said(&plain, "desk.svg", page(&pane));
    assert!(wrong.contains("board 0 is mirrored"), "{wrong}");
}

#[test]
fn spot_colours_are_those_of_the_description() {
    let stated = board(true, true, true);
    let bytes = |target: &Printing| pdf::to_bytes(&target.draw().unwrap());
    assert!(said(&stated, "desk.pdf", bytes(&stated)).contains("verified, 12 corners"));
    let mut renamed = stated.clone();
    renamed.finish.white = Some("Varnish".to_owned());
    for (described, printed, problem) in [
        (&stated, &board(true, false, true), "resources of ColorSpace"),
        (&stated, &board(true, false, false), "no ColorSpace for its spot colours"),
        (&board(false, false, false), &board(false, true, false), "resources of ColorSpace"),
        (&renamed, &stated, "resources of ColorSpace"),
    ] {
        let wrong = said(described, "desk.pdf", bytes(printed));
        assert!(wrong.contains("FAILED") && wrong.contains(problem), "{problem}: {wrong}");
    }
    // The right colour spaces, but white is unused, or lines are black.
    for (change, problem) in [
        (("/White cs\n1 scn\n", ""), "a mark before any operator k"),
        (("/Overprint gs\n", ""), "a mark that does not overprint"),
        (("/Contour CS\n1 SCN\n", ""), "a line that is not in the contour colour"),
        (("1 scn", "0.5 scn"), "operator scn with [0.5]"),
        (
            ("/Contour CS\n1 SCN\n", "/Contour CS\n1 SCN\n0.3 w\n9 9 m\n9 60 l\nS\n"),
            "cut lines that are not",
        ),
    ] {
        let wrong = said(&stated, "desk.pdf", with_content(&bytes(&stated), change));
        assert!(wrong.contains(problem), "{problem}: {wrong}");
    }
}

/// Returns a one-page PDF with some of its content replaced.
fn with_content(bytes: &[u8], (from, to): (&str, &str)) -> Vec<u8> {
    let mut document = lopdf::Document::load_mem(bytes).unwrap();
    for object in document.objects.values_mut() {
        if let lopdf::Object::Stream(stream) = object {
            let content = String::from_utf8(stream.decompressed_content().unwrap()).unwrap();
            assert!(content.contains(from), "{from}: {content:.200}");
            stream.set_plain_content(content.replacen(from, to, 1).into_bytes());
            stream.compress().unwrap();
        }
    }
    let mut changed = Vec::new();
    document.save_to(&mut changed).unwrap();
    changed
}

#[test]
fn errors_in_a_laser_drawing_are_named() {
    let target = board(false, false, false);
    let good = to_laser(&target, 0.2).unwrap();
    let file = |drawing: &CutDrawing, name: &str| match name {
        "desk-laser.dxf" => dxf::text(drawing),
        _ => laser_svg::text(drawing, "desk", &deltille::artwork::subject(&target.target)),
    };
    type Change = fn(&mut CutDrawing);
    let changes: [(Change, &str); 6] = [
        (|_| {}, "for a kerf of 0.200 mm, within"),
        (|d| drop(d.paths.remove(3)), "the path on ENGRAVE from"),
        (|d| d.paths[3].points_mm.iter_mut().for_each(|p| p.x += 0.05), "is off by 0.050 mm"),
        (|d| d.paths.retain(|path| path.layer == CutLayer::Engrave), "the path on CUT from"),
        (|d| d.paths[3].layer = CutLayer::Cut, "which is impossible for this target"),
        (
            |d| {
                let cut = d.paths.iter_mut().find(|path| path.layer == CutLayer::Cut).unwrap();
                cut.points_mm.iter_mut().for_each(|p| *p *= 0.9);
            },
            "which is impossible for this target",
        ),
    ];
    for (change, problem) in changes {
        for name in ["desk-laser.dxf", "desk-laser.svg"] {
            let mut drawing = good.clone();
            change(&mut drawing);
            let told = said(&target, name, file(&drawing, name));
            assert!(told.contains(problem), "{name}, {problem}: {told}");
        }
    }
}
