//! `deltille icosahedron` and its sisters: what they write, and what proves it.

use std::path::Path;

use crate::common::command::deltille;
use crate::common::folder::names;
use crate::common::page::Page;
use crate::common::solids::{cuboctahedron, rhombic_dodecahedron, truncated_tetrahedron};
use deltille::export::dsc;
use deltille::lattice::GridKind;
use deltille::layout::{LineKind, Printing};
use deltille::targets::{Target, TargetSpec};
use glam::DVec2;

#[test]
fn an_icosahedron_needs_no_option() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "icosahedron").success();
    assert_eq!(names(folder.path()), ["icosahedron.glb", "icosahedron.json"]);
}

/// The description of the reference programs says the same: corners, tags, places in space.
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
    // Eighty bytes of header, a count, fifty bytes a triangle.
    assert_eq!(std::fs::metadata(out.join("t.stl")).unwrap().len(), 84 + 4 * 50);
}

/// Changes of an OBJ that an eye would not notice, and what is said of them.
#[test]
fn wrong_meshes_are_refused_with_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --edge 80mm --tiles 7 --face-margin 4mm --obj --name t").success();
    let text = std::fs::read_to_string(path.join("t.obj")).unwrap();
    let change = |edit: &dyn Fn(&str) -> String| -> String {
        text.lines().map(|line| edit(line) + "\n").collect()
    };
    let numbers = |line: &str| -> Vec<f64> {
        line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect()
    };
    let scaled = change(&|line| match line.strip_prefix("v ") {
        Some(_) => format!(
            "v {}",
            numbers(line).iter().map(|v| (v * 1.01).to_string()).collect::<Vec<_>>().join(" ")
        ),
        None => line.to_owned(),
    });
    let mirrored = change(&|line| match line.strip_prefix("v ") {
        Some(_) => {
            let v = numbers(line);
            format!("v {} {} {}", -v[0], v[1], v[2])
        }
        None => line.to_owned(),
    });
    let inside_out = change(&|line| {
        let words: Vec<&str> = line.split(' ').collect();
        if words[0] == "f" {
            format!("f {} {} {}", words[1], words[3], words[2])
        } else {
            line.to_owned()
        }
    });
    let first = text.lines().find(|line| line.starts_with("v ")).unwrap();
    let v = numbers(first);
    let dented = text.replacen(first, &format!("v {} {} {}", v[0] + 0.5, v[1], v[2]), 1);
    let untextured = text.replace("usemtl print\n", "");
    let mut page = Page::default();
    for (name, changed) in [
        ("scaled", scaled),
        ("mirrored", mirrored),
        ("inside-out", inside_out),
        ("dented", dented),
        ("untextured", untextured),
    ] {
        assert_ne!(changed, text);
        std::fs::write(path.join(format!("{name}.obj")), changed).unwrap();
        let verified = page.run(path, &format!("deltille verify t.json {name}.obj"));
        assert_eq!(verified.status.code(), Some(1), "{name}");
    }
    std::fs::write(path.join("t.obj"), text).unwrap();
    let material = std::fs::read_to_string(path.join("t.mtl")).unwrap();
    std::fs::write(path.join("t.mtl"), material.replace("Kd 1 1 1", "Kd 0 0 0")).unwrap();
    assert_eq!(page.run(path, "deltille verify t.json t.obj").status.code(), Some(1));
    page.is("verify-meshes");
}

/// The 16 equilateral triangles of a gyroelongated square bipyramid: two pyramids on an antiprism.
fn bipyramid(edge: f64) -> String {
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

/// Every output of a solid from a mesh, inside out and in metres, from the file to the proof.
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
    // The description is enough to make the target again.
    let target = std::fs::read_to_string(path.join("new/gyro.json")).unwrap();
    let target = Printing::from_json(&target).unwrap();
    let family = deltille::family::Family::shipped("delTag25h7").unwrap();
    let again = Target::build("gyro", &target.target.spec, Some(&family)).unwrap();
    for (made, read) in again.panels.iter().zip(&target.target.panels) {
        assert_eq!((made.id, &made.corners, &made.tags), (read.id, &read.corners, &read.tags));
    }
    assert_eq!(again.panels.len(), 16);
}

/// Faces that lie in one plane do not see each other's print, and edges between them are not folded.
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
    // The faces of a quarter lie in one plane: its three inner edges are not folded.
    let lines = || sheets.iter().flat_map(|sheet| &sheet.lines);
    let count = |kind| lines().filter(|line| line.kind == kind).count();
    assert_eq!((count(LineKind::Flat), count(LineKind::Fold)), (12, 12));
    let dxf = std::fs::read_to_string(path.join("flat-net.dxf")).unwrap();
    assert_eq!(dxf.matches("LINE\n  8\nFOLD\n").count(), 12);
}

#[test]
fn meshes_that_are_no_solids_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let good = bipyramid(120.0);
    let without_last = good.trim_end().rsplit_once('\n').unwrap().0.to_owned();
    let flattened = good.replace("f 1 2 9\n", "f 1 1 9\n");
    // A face of four corners that is bent along a diagonal.
    let bent = good.replace("f 1 2 9\nf 2 1 5\n", "f 1 5 2 9\n");
    let wound = good.replace("f 1 2 9\n", "f 2 1 9\n");
    let twice = good.clone() + &good.replace("v 0 0 ", "v 999 0 ");
    let skewed: String = good
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {x} {y} {}\n", 1.6 * z.parse::<f64>().unwrap()),
            _ => format!("{line}\n"),
        })
        .collect();
    let shifted: String = good
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["v", x, y, z] => format!("v {} {y} {z}\n", 1e8 + x.parse::<f64>().unwrap()),
            _ => format!("{line}\n"),
        })
        .collect();
    let mut page = Page::default();
    for (name, text, options) in [
        ("open", without_last, ""),
        ("flat", flattened, ""),
        ("bent", bent, ""),
        ("wound", wound, ""),
        ("crowd", twice, ""),
        ("nan", good.replacen("v ", "v nan ", 1), ""),
        ("far", shifted, "--tiles 7"),
        ("text", "hello".to_owned(), ""),
        ("index", good.clone() + "f 1 2 99\n", ""),
        ("skew", skewed.clone(), ""),
        ("good", good, "--scale 0.001"),
        ("good", String::new(), "--scale 0"),
        ("good", String::new(), "--scale 2 --edge 100mm"),
        ("good", String::new(), "--tag-spacing 1"),
        ("nowhere", String::new(), ""),
    ] {
        if !text.is_empty() {
            std::fs::write(path.join(format!("{name}.obj")), text).unwrap();
        }
        page.refused(path, &format!("deltille solid --mesh {name}.obj -o out {options}"));
    }
    page.refused(path, "deltille solid --mesh good.obj --obj");
    page.is("solid");
    // What is skewed on purpose is made.
    std::fs::write(path.join("skew.obj"), skewed).unwrap();
    deltille(path, "solid --mesh skew.obj --allow-skew --tiles 7").success();
}

/// An octahedron from the command to its proof, and to a photograph in which it is found.
#[test]
fn an_octahedron_is_made_photographed_and_found() {
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

/// How many corners of a target are found in its rendered view, each within 0.2 px of its true place.
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

/// A cube from the command to its proof in every format, and to a photograph in which three faces are found.
#[test]
fn a_cube_is_made_photographed_and_found() {
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

/// Squares beside triangles, hexagons and rhombs, each with its board: from the mesh to the proof, and found in a
/// photograph.
#[test]
fn meshes_of_other_faces_become_targets() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("camera.yaml"), CAMERA).unwrap();
    let mut page = Page::default();
    let bodies = "--pdf --gltf --stl --skeleton --dxf --panel-thickness 1mm --wall 1.5mm";
    // How many corners at least are found.
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
    // Of two families the tags of either kind have their own ids.
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

/// All faces of a cuboid have squares of one size, as many along its shortest side as are asked for.
#[test]
fn a_cuboid_is_made_photographed_and_found() {
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

/// What is printed wrong on a mesh is named, also where the detector would not mind.
#[test]
fn wrong_marks_on_a_mesh_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --edge 80mm --tiles 7 --face-margin 4mm --obj --name t").success();
    let target =
        Printing::from_json(&std::fs::read_to_string(path.join("t.json")).unwrap()).unwrap();
    let written = std::fs::read(path.join("t-texture.png")).unwrap();
    let good = image::open(path.join("t-texture.png")).unwrap().into_luma8();
    let obj = std::fs::read_to_string(path.join("t.obj")).unwrap();
    let uv: Vec<[f64; 2]> = obj
        .lines()
        .filter_map(|line| line.strip_prefix("vt "))
        .map(|line| {
            let (u, v) = line.split_once(' ').unwrap();
            [u.parse().unwrap(), v.parse().unwrap()]
        })
        .collect();
    // Texels of the first face from millimetres of its panel: its lower edge is horizontal.
    let (w, h) = (f64::from(good.width()), f64::from(good.height()));
    let texels_per_mm = (uv[1][0] - uv[0][0]) * w / 80.0;
    let panel = &target.target.panels[0];
    let margin = 4.0;
    let left = -1.5 * panel.edge_mm - 3f64.sqrt() * margin;
    let lower = -0.75f64.sqrt() * panel.edge_mm - margin;
    let texel = |[x, y]: [f64; 2]| {
        let u = uv[0][0] * w + (x - left) * texels_per_mm;
        let v = (1.0 - uv[0][1]) * h - (y - lower) * texels_per_mm;
        [u as i64, v as i64]
    };
    let e = panel.edge_mm;
    let tag = panel.tags[0];
    let centre = |row: i32, col: i32, third: f64| {
        let (row, col) = (f64::from(row) + third, f64::from(col) + third);
        [(col + row / 2.0) * e, row * 0.75f64.sqrt() * e]
    };
    // Where the changed square is, and how wide, mm.
    let mut page = Page::default();
    let cell = e / 9.5;
    for (name, at, side) in [
        ("cell", centre(tag.row, tag.col, 1.0 / 3.0), cell * 0.8),
        ("tile", centre(-1, 0, 1.0 / 3.0), e),
        ("white", centre(0, 0, 2.0 / 3.0), e / 4.0),
        ("margin", [0.0, lower + 1.2], 1.0),
    ] {
        let mut changed = good.clone();
        let [u, v] = texel(at);
        let half = (side * texels_per_mm / 2.0) as i64;
        for (x, y) in (v - half..=v + half).flat_map(|y| (u - half..=u + half).map(move |x| (x, y)))
        {
            let pixel = changed.get_pixel_mut(x as u32, y as u32);
            pixel.0[0] = if name == "cell" || name == "tile" { 255 - pixel.0[0] } else { 0 };
        }
        changed.save(path.join("t-texture.png")).unwrap();
        page.title(name);
        assert_eq!(page.run(path, "deltille verify t.json t.obj").status.code(), Some(1));
    }
    page.is("verify-textures");
    std::fs::write(path.join("t-texture.png"), written).unwrap();
    deltille(path, "verify t.json t.obj").success();
}

/// Bodies to print that are open, turned or of another size are refused.
#[test]
fn wrong_bodies_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "icosahedron --stl --skeleton --name i").success();
    let read = |name: &str| std::fs::read(path.join(name)).unwrap();
    let numbers = |bytes: &mut Vec<u8>, change: &dyn Fn(usize, [f32; 3]) -> [f32; 3]| {
        for at in (84..bytes.len()).step_by(50).flat_map(|t| (0..4).map(move |i| t + 12 * i)) {
            let number =
                |i: usize| f32::from_le_bytes(bytes[at + 4 * i..][..4].try_into().unwrap());
            let vector = change((at - 84) % 50 / 12, [0, 1, 2].map(number));
            bytes.splice(at..at + 12, vector.into_iter().flat_map(f32::to_le_bytes));
        }
    };
    let bare = read("i.stl");
    let mut open = bare[..bare.len() - 50].to_vec();
    open[80] -= 1;
    let mut mirrored = bare.clone();
    numbers(&mut mirrored, &|_, [x, y, z]| [-x, y, z]);
    let mut scaled = bare.clone();
    numbers(&mut scaled, &|i, v| if i == 0 { v } else { v.map(|x| x * 1.01) });
    let mut turned = bare.clone();
    numbers(&mut turned, &|_, [x, y, z]| [-y, x, z]);
    let mut thick = read("i-skeleton.stl");
    numbers(&mut thick, &|i, v| if i == 0 { v } else { v.map(|x| x * 1.002) });
    // A wall that is thinner deep inside, where no seat is felt.
    let mut thin = read("i-skeleton.stl");
    let far = |v: [f32; 3]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
    let nearest_mm = std::cell::Cell::new(f32::INFINITY);
    numbers(&mut thin, &|i, v| {
        nearest_mm.set(nearest_mm.get().min(if i > 0 { far(v) } else { f32::INFINITY }));
        v
    });
    let is_deep = |v: [f32; 3]| far(v) < 1.001 * nearest_mm.get();
    numbers(&mut thin, &|i, v| if i > 0 && is_deep(v) { v.map(|x| x * 1.02) } else { v });
    for at in (84..thin.len()).step_by(50) {
        let number = |i: usize| f32::from_le_bytes(thin[at + 4 * i..][..4].try_into().unwrap());
        let [a, b, c] = [1, 2, 3].map(|k| glam::Vec3::from([0, 1, 2].map(|i| number(3 * k + i))));
        let normal = (b - a).cross(c - a).normalize().to_array();
        thin.splice(at..at + 12, normal.into_iter().flat_map(f32::to_le_bytes));
    }
    let mut page = Page::default();
    for (name, bytes, code) in [
        ("open.stl", open, 1),
        ("mirrored.stl", mirrored, 1),
        ("scaled.stl", scaled, 1),
        ("turned.stl", turned, 1),
        ("cut.stl", bare[..300].to_vec(), 2),
        ("i-skeleton.stl", thick, 1),
        ("i-skeleton.stl", thin, 1),
    ] {
        std::fs::write(path.join(name), bytes).unwrap();
        let verified = page.run(path, &format!("deltille verify i.json {name}"));
        assert_eq!(verified.status.code(), Some(code), "{name}");
    }
    page.is("verify-bodies");
}

/// Outlines to cut have the size of the faces, or of what the seats take.
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
            // Ribs of icosahedra: 3 mm below, faces meet at 138.19°; 0.8 mm of foot, 0.15 of play.
            let inset = 3.0 / (138.1897f64 / 2.0).to_radians().tan() + 0.8 + 0.15;
            let stated = if edge_mm.is_nan() { 150.0 - 12f64.sqrt() * inset } else { edge_mm };
            assert!(sides.iter().all(|side| (side - stated).abs() < 1e-4), "{sides:?} {stated}");
        }
        assert!(closed_polylines(&text, "ENGRAVE").len() >= 80);
    }
}

/// The sheets of single faces are cut to what the seats take, by default with room around the tiles.
#[test]
fn single_faces_are_cut_to_the_seats_of_the_skeleton() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    deltille(path, "tetrahedron --skeleton --per-face --svg --dxf").success();
    let json = std::fs::read_to_string(path.join("tetrahedron.json")).unwrap();
    let sheet = &Printing::from_json(&json).unwrap().sheets[0];
    // Two marks at each vertex; the lines through those along an edge make the outline.
    let cuts: Vec<_> = sheet.lines.iter().filter(|line| line.kind == LineKind::Cut).collect();
    let between = cuts[0].from_mm.distance(cuts[1].from_mm);
    let text = std::fs::read_to_string(path.join("tetrahedron-panels.dxf")).unwrap();
    let outline = &closed_polylines(&text, "CUT")[0];
    let edge = outline[0].distance(outline[1]);
    // Marks begin 3 mm beyond the vertices.
    assert!((between - edge - 6.0).abs() < 1e-4, "{between} {edge}");
    assert!(sheet.texts.iter().any(|text| text.text.to_string() == "edge 0 · face 3"));
}

/// A piece of a net is one outline around its faces and tabs, with a line to fold for each edge between two
/// faces and for each tab.
#[test]
fn the_net_to_cut_holds_all_faces_and_tabs() {
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
        // Edges that join faces, and the others, which have tabs.
        let folds = text.matches("LINE\n  8\nFOLD\n").count();
        assert_eq!(folds, 20 - pieces + tabs);
        let texts = closed_polylines(&text, "ENGRAVE").len();
        assert!((100..800).contains(&texts), "{texts}");
    }
    deltille(path, "tetrahedron --dxf --per-face --pdf --no-verify").success();
    assert!(path.join("tetrahedron-panels.dxf").exists());
    assert!(!path.join("tetrahedron-net.dxf").exists());
}

/// The closed polylines of a layer of a DXF of release 12.
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

#[test]
fn what_cannot_be_made_is_refused_in_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "dodecahedron",
        "solid",
        "icosahedron --edge 20mm",
        "icosahedron --edge NaN",
        "icosahedron --edge -150mm",
        "icosahedron --tiles 3",
        "icosahedron --face-margin -1mm",
        "icosahedron --first-id 300",
        "icosahedron --family delTag16h5",
        "icosahedron --texture-dpi 50",
        "icosahedron --texture-dpi 9000",
        "icosahedron --pdf --edge 3m",
        "icosahedron --pdf --paper A5 --edge 440mm",
        "icosahedron --pdf --face-margin 1mm",
        "icosahedron --pdf --paper 50x60mm",
        "icosahedron --pdf --per-face --edge 3m",
        "icosahedron --pdf --per-face --paper A5",
        "icosahedron --untagged --texture 64",
        "icosahedron --skeleton --rib 1mm",
        "tetrahedron --invert --skeleton --face-margin 6mm --laser svg",
        "icosahedron --skeleton --panel-thickness 12mm --face-margin 5mm",
        "tetrahedron --skeleton --edge 60mm --tiles 6 --face-margin 6mm --wall 6mm",
        "icosahedron --wall 4mm",
        "icosahedron --stl --paper A4",
        "icosahedron --stl --texture-dpi 300",
        "icosahedron -o /proc/nowhere",
    ] {
        page.refused(at, &format!("deltille {args}"));
    }
    page.title("A file that cannot be replaced keeps the others from being written");
    std::fs::create_dir(at.join("octahedron.stl")).unwrap();
    page.refused(at, "deltille octahedron --stl");
    page.is("icosahedron");
}

/// Bare tilings, white tiles on black, and both: pages, meshes, bodies and drawings are proved like all others.
#[test]
fn solids_are_untagged_and_inverted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let formats = "--pdf --gltf --obj --3mf --laser dxf,svg";
    for solid in ["tetrahedron --edge 90mm --tiles 6", "cube --edge 90mm --tiles 6"] {
        for (how, face_margin) in
            [("--untagged", 5.0), ("--invert", 8.0), ("--untagged --invert", 8.0)]
        {
            deltille(path, &format!("{solid} {how} {formats} --name s --force")).success();
            let target = std::fs::read_to_string(path.join("s.json")).unwrap();
            let target = Printing::from_json(&target).unwrap();
            let TargetSpec::Solid(spec) = &target.target.spec else { panic!("{solid} is a solid") };
            assert_eq!(spec.margin_mm, face_margin, "{solid} {how}");
            assert_eq!(target.target.family.is_none(), how.contains("untagged"));
            assert!(
                target.target.panels.iter().all(|panel| panel.inverted == how.contains("invert"))
            );
        }
    }
    // On panels of a skeleton the black lies whole, with the margin that is usual and with the least.
    for margin in ["", "--face-margin 8.7mm"] {
        let skeleton = "--skeleton --per-face --pdf --laser dxf,svg --name s --force";
        deltille(path, &format!("tetrahedron --invert {margin} {skeleton}")).success();
    }
}
