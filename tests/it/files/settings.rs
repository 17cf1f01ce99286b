//! Messages of the library about settings name options, and outputs that cannot be written are refused before the work.

use std::fs;

use crate::common::command::deltille;
use crate::common::page::Page;

#[test]
fn library_messages_name_the_options_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 8 --cols 9 --name board").success();
    fs::write(at.join("flat.json"), r#"{"schema": "deltille/calibration/1"}"#).unwrap();
    fs::write(at.join("none.json"), "{").unwrap();
    let mut page = Page::default();
    for args in [
        "board --rows 2 --cols 2 --untagged",
        "board --rows 30 --cols 30 --edge 20mm --paper A4",
        "board --rows 9 --cols 9 --boards 99 --first-id 9",
        "board --rows 9 --cols 9 --family t36h11",
        "board --rows 9 --cols 9 --dsc --family d25h9",
        "checkerboard --rows 9 --cols 9 --tags t36h11 --first-id 999",
        "checkerboard --rows 9 --cols 9 --tags t36h11 --tags-in white --dsc",
        "board --rows 9 --cols 9 --logo ''",
        "icosahedron --edge 20mm",
        "icosahedron --skeleton --wall 99mm",
        "icosahedron --texture-dpi 9",
        "icosahedron --pdf --edge 3m",
        "pose nowhere --target board.json --camera none.json --shape flat.json",
        "calibrate none.json --target none.json --model radtan",
        "calibrate none.json --target board.json --model radtan",
        "detect board.pdf --target board.json --max-bytes 9",
    ] {
        page.refused(at, &format!("deltille {args}"));
    }
    page.is("settings");
}

#[test]
fn foreign_outputs_are_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 8 --cols 9 --name board").success();
    let calibrate = "calibrate nowhere --target board.json --model radtan -o";
    let rig =
        "rig --camera left=here --camera right=there --target board.json --format kalibr -o out";
    fs::create_dir(at.join("out")).unwrap();
    let mut page = Page::default();
    for (file, text, args) in [
        ("notes.yaml", "milk: 1\n", format!("{calibrate} notes.yaml")),
        ("own.json", "{\"milk\": 1}", format!("{calibrate} own.yaml")),
        ("out/right.yaml", "milk: 1\n", rig.to_owned()),
        ("out/rig.json", "[1, 2]", rig.to_owned()),
        ("out/camchain.yaml", "milk: 1\n", rig.to_owned()),
        ("out/board-refined.json", "{\"milk\": 1}", format!("{rig} --refine-target")),
    ] {
        fs::write(at.join(file), text).unwrap();
        page.refused(at, &format!("deltille {args}"));
        // Now the folder is missing.
        page.refused(at, &format!("deltille {args} --force"));
        fs::remove_file(at.join(file)).unwrap();
    }
    page.is("foreign-files");
}

#[test]
fn cameras_with_the_same_file_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::default();
    for second in ["LEFT", "left", "Rig"] {
        let cameras = format!("--camera left=a --camera {second}=b");
        page.refused(folder.path(), &format!("deltille rig {cameras} --target board.json"));
    }
    page.is("names-of-cameras");
}
