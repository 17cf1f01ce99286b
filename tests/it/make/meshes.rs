//! Boards as plates, and models for simulators: made, proved, and refused where they were changed.
//! `tests/independent/simulators.py` opens them with simulators.

use crate::common::command::deltille;
use crate::common::page::Page;

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
