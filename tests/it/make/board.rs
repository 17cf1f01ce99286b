//! `deltille board`: what it writes, its templates, and what it refuses.

use std::path::Path;

use crate::common::folder::names;
use assert_cmd::Command;
use deltille::export::dsc;
use deltille::targets::{Target, TargetSpec};
use proptest::prelude::*;

fn deltille(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("deltille").unwrap();
    command.current_dir(folder);
    command
}

fn read(path: &Path) -> Target {
    Target::from_json(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Runs a command that must be refused, and returns its one line.
fn refusal(folder: &Path, args: &[&str]) -> String {
    let output = deltille(folder).args(args).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
    assert!(output.stdout.is_empty(), "{args:?}");
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{args:?}: {said}");
    said
}

#[test]
fn rows_and_columns_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path()).args(["board", "--rows", "10", "--cols", "11"]).assert().success();
    assert_eq!(names(folder.path()), ["board.json", "board.pdf"]);
    let target = read(&folder.path().join("board.json"));
    assert_eq!(target.panels[0].corners.len(), 110);
    assert_eq!(target.panels[0].edge_mm, 20.0);
    assert_eq!((target.sheets[0].width_mm, target.sheets[0].height_mm), (297.0, 210.0));
}

#[test]
fn every_file_asked_for_is_written_under_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let args = "board --rows 4 --cols 5 --edge 2cm --paper letter --orientation portrait --svg \
                --png --dsc --dpi 200 --name two --boards 2 --first-id 7 --board-id 3 -o new/sub";
    deltille(folder.path()).args(args.split(' ')).assert().success();
    let out = folder.path().join("new/sub");
    let expected = ["two-1.png", "two-1.svg", "two-2.png", "two-2.svg", "two.dsc", "two.json"];
    assert_eq!(names(&out), expected);
    let target = read(&out.join("two.json"));
    let ids: Vec<u32> = target.panels.iter().flat_map(|p| &p.tags).map(|tag| tag.id).collect();
    assert_eq!(ids, (7..7 + ids.len() as u32).collect::<Vec<_>>());
    let listed = dsc::read(&std::fs::read_to_string(out.join("two.dsc")).unwrap(), "two").unwrap();
    let panels = target.panels.iter().zip(&listed.panels);
    panels.for_each(|(a, b)| assert_eq!((&a.corners, &a.tags), (&b.corners, &b.tags)));
}

#[test]
fn a_paper_alone_is_filled() {
    let folder = tempfile::tempdir().unwrap();
    let args = "board --rows 10 --cols 11 --paper a3";
    deltille(folder.path()).args(args.split(' ')).assert().success();
    assert_eq!(read(&folder.path().join("board.json")).panels[0].edge_mm, 28.0);
}

#[test]
fn a_saved_template_makes_the_same_board_and_options_win_over_it() {
    let folder = tempfile::tempdir().unwrap();
    let args = "board --rows 5 --cols 6 --paper A5 --tag-spacing 2 --invert --save-template t.toml";
    deltille(folder.path()).args(args.split(' ')).assert().success();
    let first = read(&folder.path().join("board.json"));
    let again = "board --template t.toml -o again";
    deltille(folder.path()).args(again.split(' ')).assert().success();
    assert_eq!(first, read(&folder.path().join("again/board.json")));
    let other = "board --template t.toml --rows 4 --untagged --svg -o other";
    deltille(folder.path()).args(other.split(' ')).assert().success();
    assert_eq!(names(&folder.path().join("other")), ["board.json", "board.svg"]);
    let TargetSpec::Board(spec) = read(&folder.path().join("other/board.json")).spec else {
        panic!("a board")
    };
    assert_eq!((spec.rows, spec.cols, spec.tags), (4, 6, None));
}

#[test]
fn every_sample_template_makes_a_board() {
    let templates = Path::new(env!("CARGO_MANIFEST_DIR")).join("templates");
    let folder = tempfile::tempdir().unwrap();
    for name in names(&templates).iter().filter(|name| name.ends_with(".toml")) {
        let mut command = deltille(folder.path());
        let text = std::fs::read_to_string(templates.join(name)).unwrap();
        let of_squares = text.contains("deltille checkerboard --template");
        command
            .arg(if of_squares { "checkerboard" } else { "board" })
            .arg("--template")
            .arg(templates.join(name))
            .args(["--svg"]);
        command.assert().success();
        let json = Path::new(name).with_extension("json");
        assert!(!read(&folder.path().join(json)).sheets.is_empty(), "{name}");
    }
}

#[test]
fn what_cannot_be_made_is_refused_with_the_option_to_change_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let board = ["board", "--rows", "10", "--cols", "11", "-o", "out"];
    let cases: [(&[&str], &[&str]); 22] = [
        (&["--edge", "0mm"], &["--edge"]),
        (&["--edge", "-20mm"], &["--edge"]),
        (&["--edge", "NaN"], &["--edge"]),
        (&["--edge", "1e300m"], &["--edge"]),
        (&["--edge", "30mm", "--paper", "A4"], &["--paper", "--edge of at most 20 mm"]),
        (&["--edge", "500mm"], &["even A0"]),
        (&["--margin", "-1mm"], &["--margin"]),
        (&["--margin", "60mm", "--paper", "A4", "--edge", "20mm"], &["--paper"]),
        (&["--paper", "A9"], &["--paper", "letter"]),
        (&["--paper", "NaNxNaN"], &["--paper"]),
        (&["--orientation", "sideways"], &["--orientation"]),
        (&["--first-id", "340"], &["--first-id", "at most 332", "--family"]),
        (&["--first-id", "4294967295"], &["--first-id"]),
        (&["--first-id", "-1"], &["--first-id"]),
        (&["--boards", "0"], &["--boards"]),
        (&["--boards", "2", "--untagged"], &["--boards"]),
        (&["--board-id", "4294967295"], &["--board-id"]),
        (&["--tag-spacing", "0"], &["--tag-spacing"]),
        (&["--tag-border", "NaN"], &["--tag-border"]),
        (&["--family", "nobody"], &["--family", "delTag25h7"]),
        (&["--dpi", "0"], &["--dpi"]),
        (&["--name", "../up"], &["--name"]),
    ];
    for (extra, words) in cases {
        let said = refusal(folder.path(), &[&board, extra].concat());
        assert!(words.iter().all(|word| said.contains(word)), "{extra:?}: {said}");
    }
    for sizes in [["0", "11"], ["10", "1"], ["-3", "4"], ["501", "4"], ["1e3", "4"], ["NaN", "4"]] {
        refusal(folder.path(), &["board", "--rows", sizes[0], "--cols", sizes[1], "-o", "out"]);
    }
    for (extra, word) in [
        (&["--dsc", "--untagged"][..], "tags"),
        (&["--dsc", "--invert"], "inverted"),
        (&["--dsc", "--dsc-dialect", "original"], "--dsc-dialect fork"),
        (&["--dsc", "--dsc-dialect", "klingon"], "--dsc-dialect"),
        (&["--dsc-dialect", "fork"], "--dsc-dialect: there is no .dsc to write: add --dsc"),
        (&["--pdf", "--dpi", "300"], "--dpi: there is no PNG to write: add --png"),
        (&["--tag-spacing", "99999999999"], "not a whole number from 1 to 500"),
        (&["--tag-border", "0.5"], "not a number from 0.6 to 10"),
        (&["--family", "delTag25h7", "--untagged"], "--untagged"),
    ] {
        let said = refusal(folder.path(), &[&board, extra].concat());
        assert!(said.contains(word), "{extra:?}: {said}");
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn bad_templates_are_refused_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    for (text, words) in [
        ("rows = 3\ncolumns = 4\n", "line 2: unknown field `columns`"),
        ("rows = \"three\"\n", "line 1"),
        ("rows = 3\ncols = \n", "line 2"),
        ("", "--rows and --cols"),
    ] {
        std::fs::write(folder.path().join("t.toml"), text).unwrap();
        let said = refusal(folder.path(), &["board", "--template", "t.toml"]);
        assert!(said.contains(words), "{text}: {said}");
    }
    let said = refusal(folder.path(), &["board", "--template", "missing.toml"]);
    assert!(said.contains("missing.toml"));
    assert_eq!(names(folder.path()), ["t.toml"]);
}

#[test]
fn boards_for_one_scene_must_not_share_ids() {
    let folder = tempfile::tempdir().unwrap();
    let first = "board --rows 4 --cols 4 --name first";
    deltille(folder.path()).args(first.split(' ')).assert().success();
    let second = "board --rows 4 --cols 4 --name second --with first.json";
    let said = refusal(folder.path(), &second.split(' ').collect::<Vec<_>>());
    assert!(said.contains("--first-id") && said.contains("`first`: start at "), "{said}");
    let free = said.trim().rsplit(' ').next().unwrap();
    let args: Vec<&str> = second.split(' ').chain(["--first-id", free]).collect();
    assert!(refusal(folder.path(), &args).contains("--board-id"));
    let args = [&args[..], &["--board-id", "1"]].concat();
    deltille(folder.path()).args(args).assert().success();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the numbers: a board, or one line, and never half of one.
    #[test]
    fn numbers_of_any_size_make_a_board_or_one_line(
        rows in prop_oneof!["[0-9]{1,2}", "-?[0-9]{1,12}", "NaN|inf|1e9|"],
        edge in prop_oneof!["[0-9]{1,2}mm", "-?[0-9]{1,9}(\\.[0-9])?(mm|cm|m|in|pt)", "NaN|inf|"],
        border in prop_oneof!["[1-3]", "-?[0-9]{1,9}", "NaN|inf|"],
    ) {
        let folder = tempfile::tempdir().unwrap();
        let options = [("--rows", &rows), ("--edge", &edge), ("--tag-border", &border)];
        let mut command = deltille(folder.path());
        command.args(["board", "--cols", "4", "--svg", "--no-verify", "-o", "out"]);
        command.args(options.iter().map(|(option, value)| format!("{option}={value}")));
        let output = command.output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        if output.status.success() {
            prop_assert_eq!(names(&folder.path().join("out")), ["board.json", "board.svg"]);
        } else {
            prop_assert_eq!(output.status.code(), Some(2), "{}", said);
            prop_assert!(said.starts_with("error: ") && said.lines().count() == 1, "{}", said);
            prop_assert!(names(folder.path()).is_empty());
        }
    }
}
