//! Outlines of faces and nets for cutting.

use crate::common::command::deltille;
use deltille::layout::{LineKind, Printing};
use glam::DVec2;

/// Outlines to cut have the size of the faces, or the size that fits into the seats.
#[test]
fn panels_to_cut_have_their_true_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (options, name, edge_mm) in [("", "whole", 150.0), ("--skeleton", "seats", f64::NAN)] {
        deltille(path, &format!("icosahedron --dxf --name {name} {options}")).success();
        let text = std::fs::read_to_string(path.join(format!("{name}-panels.dxf"))).unwrap();
        let outlines = closed_polylines(&text, "CUT");
        assert_eq!(outlines.len(), 20);
        for outline in &outlines {
            assert_eq!(outline.len(), 3);
            let sides: Vec<f64> = (0..3)
                .map(|i| {
                    let (a, b) = (outline[i], outline[(i + 1) % 3]);
                    a.distance(b)
                })
                .collect();
            // Ribs of icosahedra: 3 mm below, faces meet at 138.19°; 0.8 mm of foot, 0.15 mm of play.
            let inset = 3.0 / (138.1897f64 / 2.0).to_radians().tan() + 0.8 + 0.15;
            let stated = if edge_mm.is_nan() { 150.0 - 12f64.sqrt() * inset } else { edge_mm };
            assert!(sides.iter().all(|side| (side - stated).abs() < 1e-4), "{sides:?} {stated}");
        }
        assert!(closed_polylines(&text, "ENGRAVE").len() >= 80);
    }
}

/// The sheets of single faces are cut to the size of the seats, by default with room around the tiles.
#[test]
fn single_faces_are_cut_to_the_seats_of_the_skeleton() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --skeleton --per-face --svg --dxf").success();
    let json = std::fs::read_to_string(path.join("tetrahedron.json")).unwrap();
    let sheet = &Printing::from_json(&json).unwrap().sheets[0];
    // Two marks at each vertex; the lines through the marks along an edge form the outline.
    let cuts: Vec<_> = sheet.lines.iter().filter(|line| line.kind == LineKind::Cut).collect();
    let between = cuts[0].from_mm.distance(cuts[1].from_mm);
    let text = std::fs::read_to_string(path.join("tetrahedron-panels.dxf")).unwrap();
    let outline = &closed_polylines(&text, "CUT")[0];
    let edge = outline[0].distance(outline[1]);
    // Marks begin 3 mm beyond the vertices.
    assert!((between - edge - 6.0).abs() < 1e-4, "{between} {edge}");
    assert!(sheet.texts.iter().any(|text| text.text.to_string() == "edge 0 · face 3"));
}

/// A piece of a net is one outline around its faces and tabs, with a fold line for each edge between two faces and
/// for each tab.
#[test]
fn the_net_to_cut_contains_all_faces_and_tabs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let cases = [
        ("", "bare", 1, false),
        ("--paper A4 --svg --allow-seams", "seamed", 1, true),
        ("--paper A4 --svg", "in-pieces", 2, true),
    ];
    for (options, name, pieces, printed) in cases {
        let args = "icosahedron --edge 60mm --tiles 7 --face-margin 4mm --dxf --no-verify";
        deltille(path, &format!("{args} --name {name} {options}")).success();
        assert_eq!(path.join(format!("{name}-2.svg")).exists(), printed);
        let text = std::fs::read_to_string(path.join(format!("{name}-net.dxf"))).unwrap();
        let outlines = closed_polylines(&text, "CUT");
        assert_eq!(outlines.len(), pieces);
        let area = |outline: &Vec<DVec2>| -> f64 {
            let next = |i: usize| outline[(i + 1) % outline.len()];
            let corners = outline.iter().enumerate();
            0.5 * corners.map(|(i, a)| a.perp_dot(next(i))).sum::<f64>()
        };
        let faces_mm2 = 20.0 * 60.0 * 60.0 * 0.75f64.sqrt() / 2.0;
        let tabs = 10 + pieces;
        let tab_mm2 = (outlines.iter().map(area).sum::<f64>() - faces_mm2) / tabs as f64;
        assert!((60.0..900.0).contains(&tab_mm2), "{tab_mm2}");
        // Edges that join faces, and the other edges, which have tabs.
        let folds = text.matches("LINE\n  8\nFOLD\n").count();
        assert_eq!(folds, 20 - pieces + tabs);
        let texts = closed_polylines(&text, "ENGRAVE").len();
        assert!((100..800).contains(&texts), "{texts}");
    }
    deltille(path, "tetrahedron --dxf --per-face --pdf --no-verify").success();
    assert!(path.join("tetrahedron-panels.dxf").exists());
    assert!(!path.join("tetrahedron-net.dxf").exists());
}

/// Returns the closed polylines of a layer of a DXF of release 12.
fn closed_polylines(text: &str, layer: &str) -> Vec<Vec<DVec2>> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let (mut outlines, mut entity, mut on_layer) = (Vec::<Vec<DVec2>>::new(), "", false);
    for group in lines.chunks_exact(2) {
        match (group[0], group[1]) {
            ("0", name) => entity = name,
            ("8", name) => on_layer = name == layer,
            ("70", "1") if entity == "POLYLINE" && on_layer => outlines.push(Vec::new()),
            ("10", x) if entity == "VERTEX" && on_layer => {
                outlines.last_mut().unwrap().push(DVec2::X * x.parse::<f64>().unwrap());
            }
            ("20", y) if entity == "VERTEX" && on_layer => {
                outlines.last_mut().unwrap().last_mut().unwrap().y = y.parse().unwrap();
            }
            _ => {}
        }
    }
    outlines
}
