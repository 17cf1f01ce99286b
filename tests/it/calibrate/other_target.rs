//! Results with one board are not used with the description of another.

use std::fs;
use std::path::Path;

use crate::common::command::deltille;
use assert_cmd::assert::Assert;
use deltille::camera::Camera;
use deltille::export::detection;
use deltille::layout::Printing;
use deltille::targets::Target;

const SMALL: &str = "--target small/desk.json";
const LARGE: &str = "--target large/desk.json";
const BOTH_SIZES: [&str; 2] = ["20 mm", "25 mm"];

/// Two boards with the same tags and edges of 20 and 25 mm, and detections of the smaller one.
fn scene() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (name, edge) in [("small", 20), ("large", 25)] {
        let command = format!(
            "board --rows 7 --cols 8 --edge {edge}mm --name desk -o {name} --dsc --no-verify"
        );
        deltille(at, &command).success();
    }
    fs::write(at.join("lens.yaml"), Camera::pinhole(640, 480, 1.0).to_yaml()).unwrap();
    let eyes =
        ["60,-100,320", "260,120,280", "-120,160,300", "220,250,290", "-70,-90,310", "130,280,300"];
    for (i, eye) in eyes.into_iter().enumerate() {
        deltille(
            at,
            &format!("render small/desk.json --camera lens.yaml --eye {eye} -o view-{i}.png"),
        )
        .success();
    }
    deltille(at, &format!("detect {SMALL} view-*.png -o seen")).success();
    deltille(at, &format!("detect {SMALL} view-*.png --format parquet -o tables")).success();
    folder
}

/// Expects one line that names both sizes, exit code 2, and no output.
fn is_refused(at: &Path, command: &str) {
    let before = files(at);
    let said = refused(deltille(at, command));
    assert_eq!(said.lines().count(), 1, "{command}: {said}");
    assert!(BOTH_SIZES.iter().all(|size| said.contains(size)), "{command}: {said}");
    assert_eq!(files(at), before, "{command}");
}

fn refused(command: Assert) -> String {
    let output = command.code(2).get_output().clone();
    String::from_utf8(output.stderr).unwrap()
}

fn files(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    entries.map(|path| if path.is_dir() { files(&path) } else { 1 }).sum()
}

#[test]
fn every_command_refuses_a_description_of_another_size() {
    let folder = scene();
    let at = folder.path();
    deltille(at, &format!("calibrate seen {SMALL} --model radtan -o right --board-shape"))
        .success();

    // A board without a description is identified by its rows, columns and edge.
    deltille(
        at,
        "calibrate seen --grid deltille --rows 7 --cols 8 --edge 20mm --model radtan -o plain.yaml",
    )
    .success();

    for command in [
        format!("calibrate seen {LARGE} --model radtan -o wrong"),
        "calibrate seen --grid deltille --edge 25mm --model radtan -o wrong".to_owned(),
        "pose view-0.png --grid deltille --rows 7 --cols 8 --edge 25mm --camera plain.yaml"
            .to_owned(),
        format!("calibrate tables {LARGE} --model radtan -o wrong"),
        "calibrate seen --target large/desk.dsc --model radtan -o wrong".to_owned(),
        format!("calibrate seen {LARGE} --fixed-intrinsics right/camera.yaml -o wrong"),
        format!("rig --camera a=seen --refine-target {LARGE} -o wrong"),
        format!("pose view-0.png {LARGE} --camera right/camera.yaml"),
        format!("pose view-0.png {LARGE} --camera right/camera.yaml --shape right/camera.json"),
        format!("guide . {LARGE} --camera right/camera.yaml --once"),
    ] {
        is_refused(at, &command);
    }
    // The shape of a sheet belongs to its board, also without a description.
    let grid = "calibrate seen --grid deltille --rows 7 --cols 8 --model radtan";
    deltille(at, &format!("{grid} --edge 20mm --board-shape -o bent.yaml")).success();
    is_refused(at, &format!("{grid} --edge 25mm --assume-target --shape bent.json -o wrong"));
    let said = refused(deltille(
        at,
        &format!(
            "calibrate seen {LARGE} --assume-target --shape right/camera.json --model radtan -o wrong"
        ),
    ));
    assert!(BOTH_SIZES.iter().all(|size| said.contains(size)), "{said}");

    // The user may override the check; then the cameras no longer compare as equal.
    let assumed =
        deltille(at, &format!("calibrate seen {LARGE} --model radtan --assume-target -o wrong"))
            .success();
    let said = String::from_utf8(assumed.get_output().stderr.clone()).unwrap();
    assert!(said.contains("note: --assume-target: 6 detections of desk ("), "{said}");
    is_refused(at, "compare right/camera.json wrong/camera.json");
    is_refused(at, "compare right/camera.yaml wrong/camera.json");
    deltille(at, "compare right/camera.json wrong/camera.json --assume-target").success();
    deltille(at, &format!("pose view-0.png {SMALL} --camera right/camera.yaml")).success();
}

/// A description in another format, under another name, or with measured corners still describes the same board.
#[test]
fn the_same_board_is_accepted_by_any_name_and_format() {
    let folder = scene();
    let at = folder.path();
    let renamed =
        fs::read_to_string(at.join("small/desk.json")).unwrap().replacen("\"desk\"", "\"wall\"", 1);
    fs::write(at.join("wall.json"), renamed).unwrap();
    for (target, output) in [("wall.json", "of-name"), ("small/desk.dsc", "of-format")] {
        let command = format!("calibrate seen --target {target} --model radtan -o {output}");
        let output = deltille(at, &command).success().get_output().clone();
        assert!(!String::from_utf8_lossy(&output.stderr).contains("note:"), "{target}");
    }
    deltille(at, &format!("calibrate seen {SMALL} --measure-target --model radtan -o measured"))
        .success();
    let measured = fs::read_to_string(at.join("measured/camera-measured.json")).unwrap();
    let measured = Target::from_json(&measured).unwrap();
    let printed =
        Target::from_json(&fs::read_to_string(at.join("small/desk.json")).unwrap()).unwrap();
    assert_eq!(measured.plan, Some(printed.identity()));
    deltille(at, "calibrate seen --target measured/camera-measured.json --model radtan -o again")
        .success();
    is_refused(at, &format!("pose view-0.png {LARGE} --camera again/camera.yaml"));
    deltille(at, "compare measured/camera.json again/camera.json --tolerance 1").success();
}

/// A refined description also verifies the files of its target, which carry the name of the
/// original description.
#[test]
fn prints_are_verified_by_a_refined_description() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 4 --cols 5 --name desk --svg --pdf --dsc --gltf").success();
    let text = fs::read_to_string(at.join("desk.json")).unwrap();
    let mut refined = Printing::from_json(&text).unwrap();
    refined.target.plan = Some(refined.target.identity());
    refined.target.name = deltille::Name::new("desk-refined").unwrap();
    fs::write(at.join("desk-refined.json"), refined.to_json()).unwrap();
    for files in ["desk.svg desk.pdf desk.dsc desk.glb", ""] {
        deltille(at, &format!("verify desk-refined.json {files}")).success();
    }
}

/// Detections of earlier versions and other programs do not name their target: a note says which one is assumed.
#[test]
fn detections_without_a_target_are_noted_once() {
    let folder = scene();
    let at = folder.path();
    for entry in fs::read_dir(at.join("seen")).unwrap().flatten() {
        let text = fs::read_to_string(entry.path()).unwrap();
        let mut found = detection::read(&text).unwrap();
        found.targets.clear();
        fs::write(entry.path(), detection::write(&found)).unwrap();
    }
    let command =
        deltille(at, &format!("calibrate seen {SMALL} --model radtan -o right")).success();
    let said = String::from_utf8(command.get_output().stderr.clone()).unwrap();
    let note = "note: 6 of 6 detections do not name a target; assumed to be desk (";
    assert_eq!(said.matches(note).count(), 1, "{said}");
}

/// A description with edited corners or tags no longer matches the print.
#[test]
fn an_edited_description_is_refused() {
    let folder = scene();
    let at = folder.path();
    let text = fs::read_to_string(at.join("small/desk.json")).unwrap();
    let other = fs::read_to_string(at.join("large/desk.json")).unwrap();
    let fingerprint = |text: &str| {
        let from = text.find("\"fingerprint\": \"").unwrap() + 16;
        text[from..from + 16].to_owned()
    };
    let mixed = text.replacen(&fingerprint(&text), &fingerprint(&other), 1);
    fs::write(at.join("mixed.json"), mixed).unwrap();
    let said = refused(deltille(at, "calibrate seen --target mixed.json --model radtan -o wrong"));
    assert!(said.contains("field `fingerprint`: it is"), "{said}");
}

/// Boards given by tiling and edge are the boards that the detections name.
#[test]
fn untagged_boards_keep_the_name_of_detections() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for edge in [20, 25] {
        let made = format!(
            "board --rows 7 --cols 8 --edge {edge}mm --untagged --name u{edge} --no-verify"
        );
        deltille(at, &made).success();
    }
    fs::write(at.join("lens.yaml"), Camera::pinhole(640, 480, 1.0).to_yaml()).unwrap();
    for (i, eye) in ["60,-100,320", "260,120,280", "-120,160,300", "130,280,300"].iter().enumerate()
    {
        deltille(at, &format!("render u20.json --camera lens.yaml --eye {eye} -o view-{i}.png"))
            .success();
    }
    deltille(at, "detect --target u20.json view-0.png view-1.png view-2.png view-3.png -o seen")
        .success();
    deltille(at, "calibrate seen --grid deltille --edge 20mm --model radtan -o camera.yaml");
    is_refused(at, "pose view-0.png --target u25.json --camera camera.yaml");
    let said = refused(deltille(
        at,
        "calibrate seen --grid deltille --edge 20mm --rows 7 --cols 9 --model radtan -o other.yaml",
    ));
    assert!(said.contains("56 corners") && said.contains("63 corners"), "{said}");
}
