//! Boards as plates and models for simulators: generated, verified, and rejected after changes.
//! `tests/independent/simulators.py` opens them with simulators.

use crate::common::command::deltille;
use crate::common::page::Page;
use deltille::export::inlay::{Body, InlaidBodies};
use deltille::export::mesh::Meshing;
use deltille::export::threemf;
use deltille::layout::Printing;
use deltille::targets::BoardSpec;
use deltille::verify::{Artifact, verify};
use glam::DVec3;

/// Options that write a target in all mesh formats.
const ALL: &str = "--gltf --obj --sdf --urdf --mjcf --usd --texture 1024";

#[test]
fn boards_and_solids_are_models_for_simulators() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "board --rows 5 --cols 6 --edge 30mm --name desk",
        "board --rows 5 --cols 6 --edge 30mm --name black --invert --plate 12mm",
        "board --rows 4 --cols 5 --edge 30mm --name plain --untagged",
        "checkerboard --rows 4 --cols 5 --edge 30mm --name squares --tags t25h9",
        "tetrahedron --edge 100mm --tiles 6 --name four.sided",
    ] {
        page.run(at, &format!("deltille {arguments} {ALL}"));
    }
    // Larger than any paper.
    page.run(at, "deltille board --rows 5 --cols 6 --edge 400mm --name wall --gltf --texture 900");
    page.run(at, "deltille verify desk.json desk.xml desk.urdf");
    page.is("meshes");
}

#[test]
fn faces_are_shared_among_textures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    let all = "--gltf --obj --sdf --urdf --mjcf --usd";
    // Two textures for four faces, one for each face, and as many as the error message suggests.
    page.run(
        at,
        &format!("deltille tetrahedron --edge 100mm --tiles 6 --name four {all} --textures 2"),
    );
    page.run(
        at,
        "deltille tetrahedron --edge 100mm --tiles 6 --name each --mjcf --texture 512 --textures 4",
    );
    page.refused(at, "deltille octahedron --edge 100mm --gltf --texture 700");
    page.run(at, "deltille octahedron --edge 100mm --gltf --texture 700 --textures 2");
    page.run(at, "deltille cube --edge 80mm --tiles 6 --usd --texture-dpi 300 --textures 5");
    page.run(at, &format!("deltille board --rows 5 --cols 6 --edge 30mm --two-sided 4mm --name door {all} --textures 2"));
    page.title("Parts are compared with the whole they belong to");
    for file in ["four.mtl", "four-texture-2.png", "four-2.obj"] {
        page.run(at, &format!("deltille verify four.json {file}"));
    }
    page.title("A mesh with a different number of textures than the MuJoCo model");
    deltille(at, "tetrahedron --edge 100mm --tiles 6 --name four --obj --textures 3 --no-verify")
        .success();
    page.run(at, "deltille verify four.json four.xml");
    page.run(at, "deltille verify four.json four.usda");
    page.is("several-textures");

    // Textures that no mesh shows any more are named. A missing texture is reported once, even if
    // several meshes use it.
    let again = "tetrahedron --edge 100mm --tiles 6 --name each --obj --textures 3 --no-verify";
    let said = deltille(at, again).success();
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(
        said.contains("each-texture-4.png, ")
            && said.contains("each.xml: these files use textures other")
    );
    let said = deltille(at, again).success();
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(said.contains("each-texture-4.png, "), "{said}");
    std::fs::remove_file(at.join("four-texture-1.png")).unwrap();
    let said = deltille(at, "verify four.json").code(2);
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(said.contains("four-texture-1.png") && said.lines().count() == 1, "{said}");
}

#[test]
fn boards_and_solids_are_two_bodies_to_print() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "board --rows 5 --cols 6 --edge 30mm --name desk",
        "board --rows 5 --cols 6 --edge 20mm --name black --invert --plate 5mm --inlay 0.6mm",
        "board --rows 7 --cols 8 --edge 20mm --name patches --dense",
        "checkerboard --rows 4 --cols 5 --edge 30mm --name squares --tags t25h9",
        "octahedron --edge 100mm --tiles 6 --name eight --skeleton",
    ] {
        page.run(at, &format!("deltille {arguments} --3mf"));
    }
    page.run(at, "deltille verify desk.json squares.3mf");
    page.is("inlays");
}

/// Returns the verdict on the bodies of a board after a change.
fn verdict_on(change: impl FnOnce(&mut InlaidBodies)) -> String {
    let board = Printing::new("desk", BoardSpec::deltille(3, 4, 20.0)).unwrap();
    let mut bodies = InlaidBodies::new(&board.target, Meshing::default()).unwrap();
    change(&mut bodies);
    let file = [Artifact::new("desk.3mf", threemf::to_bytes(&bodies))];
    verify(&board, "desk.3mf", &file).unwrap().to_string()
}

#[test]
fn changed_bodies_are_rejected() {
    assert!(verdict_on(|_| {}).contains("verified, two closed bodies"));
    let moved = |body: &mut Body, by: DVec3| body.vertices_mm.iter_mut().for_each(|v| *v += by);
    for (verdict, expected) in [
        (
            verdict_on(|bodies| {
                bodies.black.triangles.pop();
            }),
            "black body: the surface is open",
        ),
        (verdict_on(|bodies| bodies.white.triangles.push([0, 1, 2])), "white body: triangles that"),
        (verdict_on(|bodies| moved(&mut bodies.black, 0.03 * DVec3::X)), "overlap, or leave"),
        (
            verdict_on(|bodies| bodies.black.vertices_mm[0].x += 0.1),
            "not on a face, a wall or the floor",
        ),
        (verdict_on(|bodies| std::mem::swap(&mut bodies.white, &mut bodies.black)), "FAILED"),
        (
            verdict_on(|bodies| {
                bodies.subject = bodies.subject.replace("corners", "knots");
            }),
            "Description",
        ),
        (
            verdict_on(|bodies| {
                for body in [&mut bodies.white, &mut bodies.black] {
                    body.vertices_mm.iter_mut().for_each(|v| *v *= 1.001);
                }
            }),
            "not on a face",
        ),
    ] {
        assert!(verdict.contains("FAILED") && verdict.contains(expected), "{expected}: {verdict}");
    }
}

#[test]
fn a_small_file_with_a_very_large_content_is_not_unpacked() {
    let board = Printing::new("desk", BoardSpec::deltille(3, 4, 20.0)).unwrap();
    let bodies = InlaidBodies::new(&board.target, Meshing::default()).unwrap();
    let mut file = threemf::to_bytes(&bodies);
    // The length of the model, in its directory entry and before it.
    let name = b"3D/3dmodel.model";
    let names: Vec<usize> =
        (0..file.len() - name.len()).filter(|&at| file[at..].starts_with(name)).collect();
    for (at, before) in [(names[names.len() - 2], 8), (names[names.len() - 1], 22)] {
        file[at - before..at - before + 4].copy_from_slice(&900_000_000u32.to_le_bytes());
    }
    let verdict = verify(&board, "desk.3mf", &[Artifact::new("desk.3mf", file)]);
    let error = verdict.unwrap_err().to_string();
    assert!(error.contains("max_bytes"), "{error}");
}

#[test]
fn changed_models_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, &format!("board --rows 3 --cols 4 --edge 30mm --name desk {ALL}")).success();
    let mut page = Page::default();
    for (file, from, to) in [
        ("desk.sdf", "<scale>0.001", "<scale>0.002"),
        ("desk.sdf", "<uri>desk.obj", "<uri>other.obj"),
        ("desk.urdf", "scale=\"0.001 0.001", "scale=\"0.001 -0.001"),
        ("desk.xml", "<geom type", "<geom euler=\"90 0 0\" type"),
        ("desk.xml", "</worldbody>", "</worldbody><!-- more -->"),
        ("desk.usda", "metersPerUnit = 1", "metersPerUnit = 0.001"),
        ("desk.usda", "wrapS = \"clamp\"", "wrapS = \"mirror\""),
        ("desk.usda", "point3f[] points = [(", "point3f[] points = [(1e"),
        ("desk.usda", "point3f[] points = [(-", "point3f[] points = [("),
        ("desk.usda", "faceVertexIndices = [0, 1, 2, 3, 4", "faceVertexIndices = [0, 2, 1, 3, 4"),
        ("desk.usda", "faceVertexCounts = [3, 3", "faceVertexCounts = [3, 6"),
        ("desk.obj", "v -", "v 1"),
    ] {
        let good = std::fs::read_to_string(at.join(file)).unwrap();
        assert!(good.contains(from), "{file}: {from}");
        std::fs::write(at.join(file), good.replacen(from, to, 1)).unwrap();
        page.title(&format!("{file}: `{to}` for `{from}`"));
        let verified = if file == "desk.obj" { "desk.sdf" } else { file };
        page.run(at, &format!("deltille verify desk.json {verified}"));
        std::fs::write(at.join(file), good).unwrap();
    }
    std::fs::remove_file(at.join("desk-texture.png")).unwrap();
    for file in ["desk.usda", "desk.urdf"] {
        page.run(at, &format!("deltille verify desk.json {file}"));
    }
    page.is("changed-models");
}

#[test]
fn impossible_meshes_are_rejected_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "board --rows 5 --cols 6 --gltf --boards 2",
        "board --rows 5 --cols 6 --gltf --textures 2",
        "board --rows 5 --cols 6 --pdf --textures 2",
        "tetrahedron --gltf --textures 5",
        "icosahedron --gltf --textures 65",
        "icosahedron --gltf --texture 1024",
        "icosahedron --gltf --texture 300",
        "board --rows 5 --cols 6 --gltf --texture 64",
        "board --rows 5 --cols 6 --gltf --texture-dpi 20",
        "board --rows 5 --cols 6 --gltf --texture 1000 --texture-dpi 200",
        "board --rows 5 --cols 6 --gltf --plate 0mm",
        "board --rows 5 --cols 6 --plate 3mm",
        "board --rows 5 --cols 6 --pdf --texture 1000",
        "board --rows 400 --cols 400 --edge 20mm --gltf",
        "icosahedron --stl --texture 1000",
        "board --rows 5 --cols 6 --3mf --boards 2",
        "board --rows 5 --cols 6 --3mf --inlay 3mm",
        "board --rows 5 --cols 6 --3mf --inlay 0.01mm",
        "board --rows 5 --cols 6 --gltf --inlay 0.4mm",
        "board --rows 5 --cols 6 --3mf --texture 1000",
        "icosahedron --3mf --inlay 20mm",
    ] {
        page.refused(at, &format!("deltille {arguments}"));
    }
    page.is("no-meshes");
}

/// Returns an OBJ with moved vertices and matching normals.
fn moved(obj: &str, place: impl Fn(DVec3) -> DVec3) -> String {
    let numbers = |line: &str| {
        let mut words = line.split_whitespace().skip(1).map(|word| word.parse::<f64>().unwrap());
        DVec3::from_array(std::array::from_fn(|_| words.next().unwrap()))
    };
    let mut face = Vec::new();
    let lines = obj.lines().map(|line| match line.split_whitespace().next() {
        Some("v") => {
            let v = place(numbers(line));
            face.push(v);
            format!("v {:.6} {:.6} {:.6}", v.x, v.y, v.z)
        }
        Some("vn") => {
            let n = (face[1] - face[0]).cross(face[2] - face[0]).normalize();
            face.clear();
            format!("vn {:.9} {:.9} {:.9}", n.x, n.y, n.z)
        }
        _ => line.to_owned(),
    });
    lines.collect::<Vec<_>>().join("\n") + "\n"
}

#[test]
fn bodies_of_the_wrong_shape_are_named_even_if_the_print_is_right() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 3 --cols 4 --edge 30mm --name desk --obj --texture 1024").success();
    let good = std::fs::read_to_string(at.join("desk.obj")).unwrap();
    let mut page = Page::default();
    let write = |text: String| std::fs::write(at.join("desk.obj"), text).unwrap();
    write(moved(&good, |v| v));
    page.run(at, "deltille verify desk.json desk.obj");
    page.title("The back is sheared");
    write(moved(&good, |v| if v.z < -1.0 { v + DVec3::X * 20.0 } else { v }));
    page.run(at, "deltille verify desk.json desk.obj");
    page.title("A face of the back is open");
    let mut count = 0;
    let torn = good.lines().map(|line| {
        count += usize::from(line.starts_with("v ") && line.ends_with("-3.000000"));
        match line.starts_with("v ") && line.ends_with("-3.000000") && count == 3 {
            true => line.replace("-3.000000", "-9.000000"),
            false => line.to_owned(),
        }
    });
    let torn = torn.collect::<Vec<_>>().join("\n") + "\n";
    write(moved(&torn, |v| v));
    page.run(at, "deltille verify desk.json desk.obj");
    page.is("other-bodies");
}
