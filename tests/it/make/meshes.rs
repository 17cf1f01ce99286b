//! Boards as plates, and models for simulators: made, proved, and refused where they were changed.
//! `tests/independent/simulators.py` opens them with simulators.

use crate::common::command::deltille;
use crate::common::page::Page;
use glam::DVec3;

/// What a target is in all formats of meshes.
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
fn models_that_were_changed_are_refused() {
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
fn meshes_that_cannot_be_made_are_refused_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for arguments in [
        "board --rows 5 --cols 6 --gltf --boards 2",
        "board --rows 5 --cols 6 --gltf --texture 64",
        "board --rows 5 --cols 6 --gltf --texture-dpi 20",
        "board --rows 5 --cols 6 --gltf --texture 1000 --texture-dpi 200",
        "board --rows 5 --cols 6 --gltf --plate 0mm",
        "board --rows 5 --cols 6 --plate 3mm",
        "board --rows 5 --cols 6 --pdf --texture 1000",
        "board --rows 400 --cols 400 --edge 20mm --gltf",
        "icosahedron --stl --texture 1000",
    ] {
        page.refused(at, &format!("deltille {arguments}"));
    }
    page.is("no-meshes");
}

/// An OBJ whose vertices were moved, with the normals that follow.
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
fn bodies_of_another_shape_are_named_though_the_print_is_right() {
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
