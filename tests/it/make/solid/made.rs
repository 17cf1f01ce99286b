//! Solids from the command to verification, and to synthetic photographs in which they are detected.

use std::path::Path;

use crate::common::command::deltille;
use crate::common::folder::names;
use crate::common::page::Page;
use crate::common::solids::{cuboctahedron, rhombic_dodecahedron, truncated_tetrahedron};
use deltille::export::dsc;
use deltille::lattice::GridKind;
use deltille::layout::{LineKind, Printing};
use deltille::targets::{Target, TargetSpec};

#[test]
fn an_icosahedron_needs_no_option() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "icosahedron").success();
    assert_eq!(names(folder.path()), ["icosahedron.glb", "icosahedron.json", "icosahedron.pdf"]);
}

/// The description of the reference programs agrees: corners, tags, positions in space.
#[test]
fn every_format_is_written_and_the_dsc_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let args = "tetrahedron --edge 8cm --tiles 7 --face-margin 4mm --obj --stl --gltf --svg --dsc \
                --per-face --name t -o new --first-id 9";
    deltille(folder.path(), args).success();
    let out = folder.path().join("new");
    let expected = [
        "t-1.svg",
        "t-2.svg",
        "t-3.svg",
        "t-4.svg",
        "t-texture.png",
        "t.dsc",
        "t.glb",
        "t.json",
        "t.mtl",
        "t.obj",
        "t.stl",
    ];
    assert_eq!(names(&out), expected);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let (target, listed) =
        (Printing::from_json(&read("t.json")).unwrap(), dsc::read(&read("t.dsc"), "t").unwrap());
    for (a, b) in target.target.panels.iter().zip(&listed.panels) {
        assert_eq!((&a.corners, &a.tags), (&b.corners, &b.tags));
        let turned = a.pose.rotation.iter().zip(&b.pose.rotation).map(|(a, b)| (a - b).abs());
        assert!(turned.fold(0.0, f64::max) < 1e-9);
    }
    // A header of eighty bytes, a count, fifty bytes per triangle.
    assert_eq!(std::fs::metadata(out.join("t.stl")).unwrap().len(), 84 + 4 * 50);
}

/// A gyroelongated square bipyramid with 16 equilateral triangles: two pyramids on an antiprism.
pub(super) fn bipyramid(edge: f64) -> String {
    let radius = edge / 2f64.sqrt();
    let across = 2.0 * radius * (std::f64::consts::FRAC_PI_8).sin();
    let half = (edge * edge - across * across).sqrt() / 2.0;
    let mut text = String::new();
    for k in 0..8 {
        let (ring, turn) = (k / 4, f64::from(k % 4) + f64::from(k / 4) / 2.0);
        let (sin, cos) = (turn * std::f64::consts::FRAC_PI_2).sin_cos();
        let z = if ring == 0 { half } else { -half };
        text += &format!("v {} {} {z}\n", radius * cos, radius * sin);
    }
    let top = half + (edge * edge - radius * radius).sqrt();
    text += &format!("v 0 0 {top}\nv 0 0 {}\n", -top);
    for k in 0..4 {
        let (u, u1, l, l1) = (k + 1, (k + 1) % 4 + 1, k + 5, (k + 1) % 4 + 5);
        text += &format!("f {u} {u1} 9\nf {u1} {u} {l}\nf {l} {l1} {u1}\nf {l1} {l} 10\n");
    }
    text
}

/// All outputs of a solid from a mesh that is inside out and in metres, from the file to verification.
#[test]
fn any_closed_mesh_becomes_a_target() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let inside_out: String = bipyramid(0.12)
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["f", a, b, c] => format!("f {a} {c} {b}\n"),
            _ => format!("{line}\n"),
        })
        .collect();
    std::fs::write(path.join("gyro.obj"), inside_out).unwrap();
    let args = "solid --mesh gyro.obj --scale 1000 --gltf --obj --stl --skeleton --dxf --svg --dsc \
                -o new --first-id 5";
    let mut page = Page::default();
    assert!(page.run(path, &format!("deltille {args}")).status.success());
    page.is("solid-of-a-mesh");
    // The description is enough to generate the target again.
    let target = std::fs::read_to_string(path.join("new/gyro.json")).unwrap();
    let target = Printing::from_json(&target).unwrap();
    let family = deltille::family::Family::shipped("delTag25h7").unwrap();
    let again = Target::build("gyro", &target.target.spec, Some(&family)).unwrap();
    for (made, read) in again.panels.iter().zip(&target.target.panels) {
        assert_eq!((made.id, &made.corners, &made.tags), (read.id, &read.corners, &read.tags));
    }
    assert_eq!(again.panels.len(), 16);
}

/// Faces in one plane do not see each other's print, and edges between them are not folded.
#[test]
fn a_tetrahedron_with_each_face_cut_in_four_is_sixteen_faces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let corners = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]].map(|v| v.map(|x| 60 * x));
    let middle = |i: usize, j: usize| [0, 1, 2].map(|k| (corners[i][k] + corners[j][k]) / 2);
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let vertices = corners.into_iter().chain(pairs.map(|(i, j)| middle(i, j)));
    let mut text: String = vertices.map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let number = |i: usize, j: usize| {
        5 + pairs.iter().position(|&pair| pair == (i.min(j), i.max(j))).unwrap()
    };
    for [a, b, c] in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] {
        let [ab, bc, ca] = [number(a, b), number(b, c), number(c, a)];
        let [a, b, c] = [a + 1, b + 1, c + 1];
        text += &format!("f {a} {ab} {ca}\nf {ab} {b} {bc}\nf {ca} {bc} {c}\nf {ab} {bc} {ca}\n");
    }
    std::fs::write(path.join("cut.obj"), text).unwrap();
    deltille(path, "solid --mesh cut.obj --gltf --obj --pdf --dxf --tiles 6 --name flat").success();
    let json = std::fs::read_to_string(path.join("flat.json")).unwrap();
    let Printing { target, sheets, .. } = Printing::from_json(&json).unwrap();
    assert_eq!(target.panels.len(), 16);
    // The faces of a quarter lie in one plane, so its three inner edges are not folded.
    let lines = || sheets.iter().flat_map(|sheet| &sheet.lines);
    let count = |kind| lines().filter(|line| line.kind == kind).count();
    assert_eq!((count(LineKind::Flat), count(LineKind::Fold)), (12, 12));
    let dxf = std::fs::read_to_string(path.join("flat-net.dxf")).unwrap();
    assert_eq!(dxf.matches("LINE\n  8\nFOLD\n").count(), 12);
}

#[test]
/// An octahedron from the command to verification, and to an image in which it is detected.
fn an_octahedron_is_generated_rendered_and_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let args = "octahedron --gltf --obj --stl --dxf --skeleton --face-margin 7mm";
    let mut page = Page::default();
    assert!(page.run(path, &format!("deltille {args}")).status.success());
    let camera = "width: 1600\nheight: 1200\nmodel: pinhole\nfocal_px: [1800, 1800]\n\
                  centre_px: [799.5, 599.5]\n";
    std::fs::write(path.join("camera.yaml"), camera).unwrap();
    let args = "render octahedron.json --camera camera.yaml --eye 250,180,220 --bits 16 --seed 3";
    assert!(page.run(path, &format!("deltille {args}")).status.success());
    page.is("octahedron");
    assert!(corners_found(path, "octahedron") >= 36);
    let picture = image::ImageReader::open(path.join("octahedron-view.png")).unwrap();
    assert_eq!(picture.decode().unwrap().color(), image::ColorType::L16);
}

/// Counts the corners of a target detected in its rendered view, each within 0.2 px of its true position.
fn corners_found(path: &Path, name: &str) -> usize {
    deltille(path, &format!("detect --target {name}.json {name}-view.png -o found")).success();
    let read = |file: String| -> serde_json::Value {
        serde_json::from_str(&std::fs::read_to_string(path.join(file)).unwrap()).unwrap()
    };
    let (truth, found) =
        (read(format!("{name}-view.json")), read(format!("found/{name}-view.json")));
    let truth: std::collections::BTreeMap<u64, [f64; 2]> = truth["corners"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| (c["id"].as_u64().unwrap(), ["x", "y"].map(|key| c[key].as_f64().unwrap())))
        .collect();
    let grids = found["grids"].as_array().unwrap();
    let corners = grids.iter().flat_map(|grid| grid["corners"].as_array().unwrap());
    let mut near = 0;
    for corner in corners {
        let [x, y] = truth[&corner["id"].as_u64().unwrap()];
        let at = ["x", "y"].map(|key| corner[key].as_f64().unwrap());
        assert!((at[0] - x).hypot(at[1] - y) < 0.2, "{corner}");
        near += 1;
    }
    near
}

const CAMERA: &str = "width: 1600\nheight: 1200\nmodel: pinhole\nfocal_px: [1800, 1800]\n\
                      centre_px: [799.5, 599.5]\n";

/// A cube from the command to verification in every format, and to an image in which three faces are detected.
#[test]
fn a_cube_is_generated_rendered_and_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut page = Page::default();
    let args = "cube --edge 80mm --pdf --svg --png --gltf --obj --usd --mjcf --stl --dxf --skeleton --texture 4096";
    assert!(page.run(path, &format!("deltille {args}")).status.success());
    let per_face = "cube --edge 80mm --per-face --pdf --dxf --name faces";
    assert!(page.run(path, &format!("deltille {per_face}")).status.success());
    for refused in [
        "cube --family delTag25h7",
        "cube --tag-border 0.8",
        "cube --tiles 5",
        "cube --first-id 560",
        "cube --edge 12mm",
        "cube --pdf --face-margin 1mm",
    ] {
        page.refused(path, &format!("deltille {refused} -o out"));
    }
    page.is("cube");
    std::fs::write(path.join("camera.yaml"), CAMERA).unwrap();
    deltille(path, "render cube.json --camera camera.yaml --eye 210,-230,190").success();
    assert_eq!(corners_found(path, "cube"), 3 * 49);
}

/// Solids with squares beside triangles, hexagons and rhombs, each with its board: from the mesh to verification, and
/// detected in an image.
#[test]
fn meshes_of_other_faces_become_targets() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("camera.yaml"), CAMERA).unwrap();
    let mut page = Page::default();
    let bodies = "--pdf --gltf --stl --skeleton --dxf --panel-thickness 1mm --wall 1.5mm";
    // The minimum number of detected corners.
    for (name, obj, options, least) in [
        ("cubocta", cuboctahedron(70.0), "--tiles 6", 2 * 25 + 10),
        ("truncated", truncated_tetrahedron(60.0), "--tiles 6 --first-id 7", 91),
        ("rhombic", rhombic_dodecahedron(70.0), "--tiles 7", 3 * 20),
    ] {
        std::fs::write(path.join(format!("{name}-mesh.obj")), obj).unwrap();
        let args = format!("solid --mesh {name}-mesh.obj {options} --name {name} {bodies}");
        assert!(page.run(path, &format!("deltille {args}")).status.success());
        deltille(path, &format!("render {name}.json --camera camera.yaml --eye 230,-260,200"))
            .success();
        let found = corners_found(path, name);
        assert!(found >= least, "{name}: {found}");
    }
    // With two families, the tags of each family have their own ids.
    let target = std::fs::read_to_string(path.join("cubocta.json")).unwrap();
    let target = Printing::from_json(&target).unwrap();
    let kinds = |kind| target.target.panels.iter().filter(move |panel| panel.kind == kind);
    for (kind, faces) in [(GridKind::Deltille, 8), (GridKind::Checker, 6)] {
        let ids: Vec<u32> = kinds(kind).flat_map(|panel| &panel.tags).map(|tag| tag.id).collect();
        assert!(kinds(kind).count() == faces && ids == (0..ids.len() as u32).collect::<Vec<_>>());
    }
    let beside = "solid --mesh cubocta-mesh.obj --tiles 6 --name second --with cubocta.json -o out";
    let own_ids = "--board-id 14 --first-id 8";
    for refused in [
        format!("{beside} {own_ids}"),
        "solid --mesh cubocta-mesh.obj --dsc -o out".to_owned(),
        "solid --mesh cubocta-mesh.obj --first-square-id 580 -o out".to_owned(),
        "solid --mesh cubocta-mesh.obj --square-family delTag25h7 -o out".to_owned(),
        "solid --mesh rhombic-mesh.obj --square-family aprilTag36h11 -o out".to_owned(),
        "solid --mesh rhombic-mesh.obj --face-margin 30mm -o out".to_owned(),
    ] {
        page.refused(path, &format!("deltille {refused}"));
    }
    page.is("solids-of-other-faces");
    deltille(path, &format!("{beside} {own_ids} --first-square-id 24")).success();
}

/// All faces of a cuboid have squares of one size, with the requested number along its shortest side.
#[test]
fn a_cuboid_is_generated_rendered_and_detected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut page = Page::default();
    let args = "cuboid --size 160x120x80mm --pdf --gltf --stl --skeleton --dxf --name box";
    assert!(page.run(path, &format!("deltille {args}")).status.success());
    let pieces = "cuboid --size 160x120x80mm --paper A4 --pdf --name pieces";
    assert!(page.run(path, &format!("deltille {pieces}")).status.success());
    for refused in [
        "--size 160x120mm",
        "--size 160x120x8mm",
        "--size 4000x30x30mm --edge 1m --tiles 6 --tag-spacing 60",
        "--size 160x-120x80mm",
    ] {
        page.refused(path, &format!("deltille cuboid {refused} -o out"));
    }
    page.is("cuboid");
    let target = std::fs::read_to_string(path.join("box.json")).unwrap();
    let target = Printing::from_json(&target).unwrap();
    assert!(
        target.target.panels.iter().all(|panel| panel.edge_mm == target.target.panels[0].edge_mm)
    );
    // Squares of 8.25 mm within margins of 7 mm: 17 along 146 mm, 12 along 106 mm, 8 along 66 mm.
    let boards: Vec<_> = target.target.panels.iter().map(|panel| panel.matrix).collect();
    assert_eq!(boards, [[16, 7], [11, 7], [16, 7], [11, 7], [11, 16], [11, 16]]);
    std::fs::write(path.join("camera.yaml"), CAMERA).unwrap();
    deltille(path, "render box.json --camera camera.yaml --eye 260,-260,240").success();
    assert_eq!(corners_found(path, "box"), 7 * 16 + 7 * 11 + 11 * 16);
}

/// Bare tilings, white tiles on black, and both: pages, meshes, bodies and drawings are verified like all others.
#[test]
fn solids_may_be_untagged_and_inverted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let formats = "--pdf --gltf --obj --3mf --laser dxf,svg";
    for (solid, variants) in [
        ("tetrahedron", &[("--untagged", 5.0), ("--invert", 8.0)][..]),
        ("cube", &[("--untagged --invert", 8.0)]),
    ] {
        for (how, face_margin) in variants {
            let solid = format!("{solid} --edge 90mm --tiles 6");
            deltille(path, &format!("{solid} {how} {formats} --name s --force")).success();
            let target = std::fs::read_to_string(path.join("s.json")).unwrap();
            let target = Printing::from_json(&target).unwrap();
            let TargetSpec::Solid(spec) = &target.target.spec else { panic!("{solid} is a solid") };
            assert_eq!(spec.margin_mm, *face_margin, "{solid} {how}");
            assert_eq!(target.target.family.is_none(), how.contains("untagged"));
            assert!(
                target.target.panels.iter().all(|panel| panel.inverted == how.contains("invert"))
            );
        }
    }
    // On the panels of a skeleton the black field is whole, with the usual margin and with the smallest.
    for margin in ["", "--face-margin 8.7mm"] {
        let skeleton = "--skeleton --per-face --pdf --laser dxf,svg --name s --force";
        deltille(path, &format!("tetrahedron --invert {margin} {skeleton}")).success();
    }
}
