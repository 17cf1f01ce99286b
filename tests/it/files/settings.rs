//! What the library says of its settings reaches the user as options, and what cannot be written is refused before the
//! work.

use std::fs;

use crate::common::command::{deltille, refused};

#[test]
fn messages_of_the_library_name_options_of_the_command_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 8 --cols 9 --name board").success();
    fs::write(at.join("flat.json"), r#"{"schema": "deltille/calibration/1"}"#).unwrap();
    fs::write(at.join("none.json"), "{").unwrap();
    for (args, option) in [
        ("board --rows 2 --cols 2 --untagged", "--untagged: "),
        ("board --rows 30 --cols 30 --edge 20mm --paper A4", "fewer --rows or --cols, or --edge"),
        ("board --rows 9 --cols 9 --boards 99 --first-id 9", "raise --tag-spacing to at least "),
        ("board --rows 9 --cols 9 --boards 99 --first-id 9", "take --family d25h7 with its "),
        ("board --rows 9 --cols 9 --family t36h11", "take one of `deltag list`"),
        ("board --rows 9 --cols 9 --dsc --family d25h9", "choose one of them with --family"),
        ("checkerboard --rows 9 --cols 9 --tags t36h11 --first-id 999", "--first-id: tags "),
        ("checkerboard --rows 9 --cols 9 --tags t36h11 --tags-in white --dsc", "--tags-in black"),
        ("icosahedron --edge 20mm", "fewer --tiles, or a smaller --face-margin"),
        ("icosahedron --skeleton --wall 99mm", "--wall: "),
        ("icosahedron --texture-dpi 9", "--texture-dpi: "),
        ("icosahedron --pdf --edge 3m", "take --per-face, or --edge of at most "),
        (
            "pose nowhere --target board.json --camera none.json --shape flat.json",
            "by a calibration with `deltille calibrate --board-shape`",
        ),
        ("calibrate none.json --target none.json --model radtan", "with `deltille board`"),
        ("calibrate none.json --target board.json --model radtan", "with `deltille detect`"),
        ("detect board.pdf --target board.json --max-bytes 9", "--max-bytes sets how many"),
    ] {
        let said = refused(at, args);
        assert!(said.contains(option) && !said.contains("::"), "{args}: {said}");
    }
}

#[test]
fn what_would_be_written_over_a_foreign_file_is_refused_before_anything_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 8 --cols 9 --name board").success();
    let calibrate = "calibrate nowhere --target board.json --model radtan -o";
    let rig =
        "rig --camera left=here --camera right=there --target board.json --format kalibr -o out";
    fs::create_dir(at.join("out")).unwrap();
    for (file, text, args) in [
        ("notes.yaml", "milk: 1\n", format!("{calibrate} notes.yaml")),
        ("own.json", "{\"milk\": 1}", format!("{calibrate} own.yaml")),
        ("out/right.yaml", "milk: 1\n", rig.to_owned()),
        ("out/rig.json", "[1, 2]", rig.to_owned()),
        ("out/camchain.yaml", "milk: 1\n", rig.to_owned()),
        ("out/board-refined.json", "{\"milk\": 1}", format!("{rig} --refine-target")),
    ] {
        fs::write(at.join(file), text).unwrap();
        let said = refused(at, &args);
        assert!(said.contains(file) && said.contains("which would be lost"), "{args}: {said}");
        assert_eq!(fs::read_to_string(at.join(file)).unwrap(), text);
        assert!(!refused(at, &format!("{args} --force")).contains("lost"), "{args}");
        fs::remove_file(at.join(file)).unwrap();
    }
}

#[test]
fn cameras_whose_files_would_be_one_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (cameras, problem) in [
        ("--camera left=a --camera LEFT=b", "--camera: left and LEFT differ in case only"),
        ("--camera left=a --camera left=b", "--camera: left is named twice"),
        ("--camera left=a --camera Rig=b", "--camera: Rig cannot be the name of a file"),
    ] {
        let said = refused(folder.path(), &format!("rig {cameras} --target board.json"));
        assert!(said.contains(problem), "{said}");
    }
}
