//! Boards and solids with a hole in the centre of each tag, where no code uses the cells.

use assert_cmd::Command;
use deltille::artwork::{CutLayer, CutPath, to_laser};
use deltille::camera::Camera;
use deltille::export::svg;
use deltille::family::Family;
use deltille::lattice::Vertex;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{BoardSpec, TagSpec, TargetSpec};
use deltille::verify::{Artifact, verify};

use crate::common::command::deltille;
use crate::common::folder::names;

/// Writes a family of 16 bits with a free central cell to `families/holed.json` in a folder.
pub fn holed(folder: &std::path::Path) -> Family {
    let search = "gen-family d16h5 --free centre --method lexicode --name holed";
    let mut deltag = Command::cargo_bin("deltag").unwrap();
    deltag.current_dir(folder).args(search.split(' ')).assert().success();
    let text = std::fs::read_to_string(folder.join("families/holed.json")).unwrap();
    Family::from_json(&text).unwrap()
}

#[test]
fn every_format_with_holes_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    holed(folder.path());
    for (command, file_count) in [
        (
            "board --rows 4 --cols 5 --edge 40mm --paper A3 --pdf --svg --png --laser dxf,svg --kerf 0.1mm --gltf --3mf",
            7,
        ),
        (
            "board --rows 4 --cols 5 --edge 40mm --paper A3 --name black --invert --pdf --laser dxf --3mf --mirrored --no-verify",
            0,
        ),
        ("tetrahedron --edge 300mm --tiles 8 --paper 1200x1400mm --pdf --gltf --laser svg", 3),
        (
            "tetrahedron --edge 300mm --tiles 8 --name black-faces --invert --paper 1200x1400mm --pdf --3mf",
            2,
        ),
    ] {
        let made = deltille(
            folder.path(),
            &format!("{command} --family families/holed.json --hole 1.8mm"),
        );
        let said = made.success().get_output().stdout.clone();
        let said = String::from_utf8(said).unwrap();
        assert_eq!(said.matches(": verified, ").count(), file_count, "{said}");
    }
}

/// Creates a board with a family that is not shipped.
fn board(hole_mm: Option<f64>) -> Printing {
    let folder = tempfile::tempdir().unwrap();
    let family = holed(folder.path());
    let tags = TagSpec { family: "holed".to_owned(), hole_mm, ..TagSpec::default() };
    let spec = BoardSpec { tags: Some(tags), ..BoardSpec::deltille(4, 5, 30.0) };
    let spec = TargetSpec::Board(spec);
    Printing::build("desk", &spec, Some(&family), Some(&PaperSpec::default())).unwrap()
}

#[test]
fn missing_holes_and_holes_of_the_wrong_size_are_found() {
    let stated = board(Some(1.5));
    for (hole_mm, passes) in
        [(Some(1.5), true), (Some(1.6), false), (Some(1.0), false), (None, false)]
    {
        let printed = board(hole_mm);
        let page = svg::to_string(&printed.draw().unwrap(), 0);
        let file = [Artifact::new("desk.svg", page.into_bytes())];
        let proof = verify(&stated, "desk.svg", &file).unwrap();
        assert_eq!(proof.passed, passes, "{hole_mm:?}: {proof}");
    }
}

/// Returns the area to the left of a path, mm².
fn area(path: &CutPath) -> f64 {
    let next = path.points_mm.iter().cycle().skip(1);
    path.points_mm.iter().zip(next).map(|(from, to)| from.perp_dot(*to) / 2.0).sum()
}

#[test]
fn a_laser_cuts_the_holes_first() {
    let target = board(Some(1.5));
    let panel = &target.target.panels[0];
    let drawing = to_laser(&target, 0.1).unwrap();
    let cut: Vec<_> = drawing.paths.iter().filter(|path| path.layer == CutLayer::Cut).collect();
    let (plate, holes) = cut.split_last().unwrap();
    assert_eq!(holes.len(), panel.tags.len());
    assert!(area(plate) > 1e4);
    // The beam removes 0.05 mm beside its path, so the holes are as wide as stated.
    for hole in holes {
        let area = -area(hole);
        assert!((area / (0.7f64.powi(2) * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{area}");
    }
    let middle =
        |hole: &CutPath| hole.points_mm.iter().sum::<glam::DVec2>() / hole.points_mm.len() as f64;
    let [first, second] =
        [0, 1].map(|n| panel.lattice_mm(Vertex::new(panel.tags[n].row, panel.tags[n].col)));
    let apart = middle(holes[1]) - middle(holes[0]);
    assert!(apart.distance(second - first) < 1e-9, "{apart}");
}

#[test]
fn holes_without_room_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    holed(folder.path());
    for (arguments, problem) in [
        (
            "board --rows 4 --cols 5 --hole 2mm",
            "--hole: the codes of delTag25h7 use the central cells",
        ),
        (
            "board --rows 4 --cols 5 --edge 40mm --family families/holed.json --hole 5mm",
            "fit a hole of at most 2.44 mm",
        ),
        (
            "board --rows 4 --cols 5 --edge 40mm --family families/holed.json --hole 0.1mm",
            "--hole: 0.1 mm is less than the minimum of 0.5 mm",
        ),
        ("board --rows 4 --cols 5 --untagged --hole 2mm", "--hole"),
        ("board --rows 4 --cols 5 --dense --hole 2mm", "--hole"),
        (
            "board --rows 4 --cols 5 --edge 40mm --family families/holed.json --hole 2mm --two-sided 3mm",
            "--two-sided: a hole through a tag of one side would cut into a tile of the other",
        ),
        ("cube --hole 2mm", "--hole: square tags have no free cells"),
    ] {
        let refused = deltille(folder.path(), arguments).code(2);
        let said = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        assert!(said.contains(problem), "{arguments}: {said}");
    }
    assert_eq!(names(folder.path()), ["families"]);
}

/// Every reader of a description checks whether its family has room for the holes.
#[test]
fn a_hole_added_to_a_description_by_hand_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path(), "board --rows 4 --cols 5 --edge 30mm --svg").success();
    let path = folder.path().join("board.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut target: serde_json::Value = serde_json::from_str(&text).unwrap();
    target["spec"]["tags"]["hole_mm"] = 1.0.into();
    target["panels"][0]["hole_mm"] = 1.0.into();
    std::fs::write(&path, target.to_string()).unwrap();
    for command in ["verify board.json", "detect board.svg --target board.json"] {
        let refused = deltille(folder.path(), command).code(2);
        let said = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
        assert!(
            said.contains("has holes of 1 mm in its tags, but the codes of delTag25h7"),
            "{said}"
        );
    }
}

#[test]
fn a_family_may_have_the_name_of_a_shipped_one() {
    let folder = tempfile::tempdir().unwrap();
    let search = "gen-family d16h5 --free centre --method lexicode -o own";
    let mut deltag = Command::cargo_bin("deltag").unwrap();
    deltag.current_dir(folder.path()).args(search.split(' ')).assert().success();
    let board = "board --rows 6 --cols 7 --edge 20mm --family own/d16h5.json --hole 1mm --svg";
    deltille(folder.path(), board).success();
    deltille(folder.path(), "verify board.json").success();
}

/// A description names the family file relative to the folder in which the board was made.
#[test]
fn own_families_are_found_from_every_folder() {
    let made = tempfile::tempdir().unwrap();
    let at = made.path();
    holed(at);
    let board = "board --rows 6 --cols 7 --edge 20mm --name desk --family families/holed.json";
    deltille(at, &format!("{board} --no-verify -o desk")).success();
    std::fs::write(at.join("lens.yaml"), Camera::pinhole(640, 480, 1.0).to_yaml()).unwrap();
    for (i, eye) in ["20,-150,250", "250,60,250", "120,60,330", "-50,150,200"].iter().enumerate() {
        let view = format!("render desk/desk.json --camera lens.yaml --eye {eye}");
        deltille(at, &format!("{view} -o photos/{i}.png")).success();
    }
    let elsewhere = tempfile::tempdir().unwrap();
    let from = elsewhere.path();
    let input = format!("{0}/photos --target {0}/desk", at.display());
    deltille(from, &format!("detect {input} -o corners")).success();
    let calibrate = format!("calibrate {input} --model radtan -o camera.yaml --force");
    deltille(from, &calibrate).success();
    std::fs::rename(at.join("families/holed.json"), from.join("renamed.json")).unwrap();
    let refused = deltille(from, &calibrate).failure();
    let said = String::from_utf8(refused.get_output().stderr.clone()).unwrap();
    assert!(said.contains("set the family with --family"), "{said}");
    deltille(from, &format!("{calibrate} --family renamed.json")).success();
}
