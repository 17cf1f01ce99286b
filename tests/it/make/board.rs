//! `deltille board`: its output, its templates, and its errors.

use std::path::Path;

use crate::common::folder::names;
use crate::common::page::Page;
use assert_cmd::Command;
use deltille::export::dsc;
use deltille::layout::Printing;
use deltille::targets::TargetSpec;
use proptest::prelude::*;

fn deltille(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("deltille").unwrap();
    command.current_dir(folder);
    command
}

fn read(path: &Path) -> Printing {
    Printing::from_json(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn rows_and_columns_are_enough() {
    let folder = tempfile::tempdir().unwrap();
    deltille(folder.path()).args(["board", "--rows", "10", "--cols", "11"]).assert().success();
    assert_eq!(names(folder.path()), ["board.json", "board.pdf"]);
    let target = read(&folder.path().join("board.json"));
    assert_eq!(target.target.panels[0].corners.len(), 110);
    assert_eq!(target.target.panels[0].edge_mm, 20.0);
    assert_eq!((target.sheets[0].width_mm, target.sheets[0].height_mm), (297.0, 210.0));
}

#[test]
fn force_replaces_a_symbolic_link_and_reports_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let made = |args: &str| deltille(at).args(args.split(' ')).assert();
    made("board --rows 4 --cols 5 --name old").success();
    let before = std::fs::read(at.join("old.json")).unwrap();
    std::os::unix::fs::symlink("old.json", at.join("new.json")).unwrap();
    let output = made("board --rows 6 --cols 5 --name new --force").success();
    let said = String::from_utf8(output.get_output().stderr.clone()).unwrap();
    let told = "new.json: replaced the symbolic link to old.json; its destination is unchanged";
    assert!(said.contains(told), "{said}");
    assert_eq!(std::fs::read(at.join("old.json")).unwrap(), before);
    assert!(!at.join("new.json").is_symlink());
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
    let ids: Vec<u32> =
        target.target.panels.iter().flat_map(|p| &p.tags).map(|tag| tag.id).collect();
    assert_eq!(ids, (7..7 + ids.len() as u32).collect::<Vec<_>>());
    let listed = dsc::read(&std::fs::read_to_string(out.join("two.dsc")).unwrap(), "two").unwrap();
    let panels = target.target.panels.iter().zip(&listed.panels);
    panels.for_each(|(a, b)| assert_eq!((&a.corners, &a.tags), (&b.corners, &b.tags)));
}

#[test]
fn without_an_edge_length_the_board_fills_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let args = "board --rows 10 --cols 11 --paper a3";
    deltille(folder.path()).args(args.split(' ')).assert().success();
    assert_eq!(read(&folder.path().join("board.json")).target.panels[0].edge_mm, 28.0);
}

#[test]
fn a_saved_template_reproduces_the_board_and_options_override_it() {
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
    let TargetSpec::Board(spec) = read(&folder.path().join("other/board.json")).target.spec else {
        panic!("a board")
    };
    assert_eq!((spec.rows, spec.cols, spec.tags), (4, 6, None));
}

#[test]
fn dense_boards_and_solids_have_a_position_code_in_every_upright_tile() {
    let folder = tempfile::tempdir().unwrap();
    let args =
        "board --dense --rows 6 --cols 7 --board-id 254 --save-template t.toml --name d --png";
    deltille(folder.path()).args(args.split(' ')).assert().success();
    let first = read(&folder.path().join("d.json"));
    assert_eq!(first.target.family.as_ref().unwrap().name, "dense9");
    // Every upright tile between corners.
    assert_eq!(first.target.panels[0].tags.len(), 5 * 6);
    let again = "board --template t.toml -o again";
    deltille(folder.path()).args(again.split(' ')).assert().success();
    assert_eq!(first, read(&folder.path().join("again/d.json")));
    let other = "board --template t.toml --family d25h7 -o other";
    deltille(folder.path()).args(other.split(' ')).assert().success();
    let TargetSpec::Board(spec) = read(&folder.path().join("other/d.json")).target.spec else {
        panic!("a board")
    };
    assert_eq!(spec.tags.map(|tags| (tags.family, tags.spacing)), Some(("d25h7".to_owned(), 3)));
    // Boards with different ids contain different position codes.
    let ids = |target: &Printing| -> Vec<u32> {
        target.target.panels.iter().flat_map(|panel| &panel.tags).map(|tag| tag.id).collect()
    };
    let solid = "octahedron --dense --tiles 6 --stl";
    deltille(folder.path()).args(solid.split(' ')).assert().success();
    let solid = read(&folder.path().join("octahedron.json"));
    assert!(ids(&solid).iter().all(|id| !ids(&first).contains(id)));
    deltille(folder.path()).args("verify d.json".split(' ')).assert().success();
}

/// Boards next to each other are not mistaken for one board.
#[test]
fn each_board_packed_on_a_sheet_is_verified() {
    let folder = tempfile::tempdir().unwrap();
    for (args, boards, sheets) in [
        ("board --rows 3 --cols 4 --boards 4", 4, 1),
        // Without --edge, the largest that fits: one board fills the paper.
        ("board --rows 4 --cols 5 --boards 2 --paper A4", 2, 2),
        ("board --dense --rows 5 --cols 6 --edge 8mm --boards 9 --paper A4 --invert", 9, 2),
        ("checkerboard --rows 4 --cols 5 --edge 15mm --tags t36h11 --boards 7 --paper A4", 7, 2),
    ] {
        let args = format!("{args} --pack --json --name packed --force");
        let made = deltille(folder.path()).args(args.split(' ')).assert().success();
        let told: serde_json::Value = serde_json::from_slice(&made.get_output().stdout).unwrap();
        assert_eq!(told["proof"]["passed"], true, "{args}");
        let target = read(&folder.path().join("packed.json"));
        assert_eq!((target.target.panels.len(), target.sheets.len()), (boards, sheets), "{args}");
    }
}

/// The note is on every label, both of the sheet and of each board that is cut out, on a separate line below the
/// board.
#[test]
fn every_board_that_is_cut_out_carries_the_note() {
    let folder = tempfile::tempdir().unwrap();
    let made = "board --rows 3 --cols 4 --edge 12mm --boards 6 --pack --note Lab-3 --svg";
    deltille(folder.path()).args(made.split(' ')).assert().success();
    let target = read(&folder.path().join("board.json"));
    let texts = || target.sheets.iter().flat_map(|sheet| &sheet.texts);
    let notes: Vec<_> = texts().filter(|text| text.text.to_string() == "Lab-3").collect();
    assert_eq!(notes.len(), 6);
    assert!(texts().any(|text| text.text.to_string().starts_with("board · Lab-3 · ")));
    for placed in target.sheets.iter().flat_map(|sheet| &sheet.placements) {
        let panel = target.target.panels.iter().find(|panel| panel.id == placed.panel).unwrap();
        let [left, lower, ..] = panel.bounds_mm();
        let below = placed.page_from_panel(glam::DVec2::new(left, lower));
        let is_its = |at: glam::DVec2| {
            (at.x - below.x).abs() < 1.0 && (0.0..30.0).contains(&(below.y - at.y))
        };
        assert_eq!(notes.iter().filter(|note| is_its(note.at_mm)).count(), 1, "board {}", panel.id);
    }
    let long = "x".repeat(80);
    let refused = format!("board --rows 3 --cols 4 --edge 8mm --boards 6 --pack --note {long}");
    let said = deltille(folder.path()).args(refused.split(' ')).assert().code(2);
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(said.starts_with("error: --note: the note has 80 characters, but only "), "{said}");
}

#[test]
fn every_sample_template_makes_a_board() {
    let templates = Path::new(crate::common::REPOSITORY).join("templates");
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
fn impossible_boards_are_rejected_with_the_option_to_change() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in [
        "--edge 0mm",
        "--edge -20mm",
        "--edge NaN",
        "--edge 1e300m",
        "--edge 500mm",
        "--edge 30mm --paper A4",
        "--margin -1mm",
        "--margin 60mm --paper A4 --edge 20mm",
        "--paper A9",
        "--paper NaNxNaN",
        "--orientation sideways",
        "--family nobody",
        "--family delTag25h7 --untagged",
        "--family t36h11",
        "--first-id 340",
        "--first-id 4294967295",
        "--first-id -1",
        "--boards 0",
        "--boards 2 --untagged",
        "--board-id 4294967295",
        "--tag-spacing 0",
        "--tag-spacing 99999999999",
        "--tag-border NaN",
        "--tag-border 0.5",
        "--tags-in white",
        "--dpi 0",
        "--pdf --dpi 300",
        "--name ../up",
        "--dsc --untagged",
        "--dsc --invert",
        "--dsc --family d25h7",
        "--dsc --dsc-dialect original",
        "--dsc --dsc-dialect klingon",
        "--dsc-dialect fork",
        "--dense --family d25h7",
        "--dense --tag-spacing 2",
        "--dense --board-id 255",
        "--family dense9 --first-id 3",
        "--dense --rows 300 --cols 300 --edge 2mm",
        "--dense --rows 4 --cols 4",
        "--pack --poster",
        "--pack --rows 4 --cols 5 --edge 60mm --paper A4",
    ] {
        let size = if args.contains("--rows") { "" } else { "--rows 10 --cols 11 " };
        page.refused(at, &format!("deltille board {size}-o out {args}"));
    }
    for size in [
        "0 --cols 11",
        "10 --cols 1",
        "-3 --cols 4",
        "501 --cols 4",
        "1e3 --cols 4",
        "NaN --cols 4",
    ] {
        page.refused(at, &format!("deltille board --rows {size}"));
    }
    page.title("Templates");
    for text in ["rows = 3\ncolumns = 4\n", "rows = \"three\"\n", "rows = 3\ncols = \n", ""] {
        page.title(&format!("{text:?}"));
        std::fs::write(at.join("t.toml"), text).unwrap();
        page.refused(at, "deltille board --template t.toml");
    }
    page.refused(at, "deltille board --template missing.toml");
    deltille(at)
        .args("checkerboard --rows 5 --cols 6 --save-template t.toml".split(' '))
        .assert()
        .success();
    page.refused(at, "deltille board --template t.toml");
    std::fs::write(at.join("part.obj"), "# deltille 0.1.0, millimetres\nv 0 0 0\n").unwrap();
    page.refused(at, "deltille board --rows 4 --cols 4 --save-template part.obj");

    page.title("Boards for one scene must not share ids");
    deltille(at).args("board --rows 4 --cols 4 --name first".split(' ')).assert().success();
    let second = "board --rows 4 --cols 4 --name second --with first.json";
    page.refused(at, &format!("deltille {second}"));
    page.refused(at, &format!("deltille {second} --first-id 3"));
    let apart = format!("{second} --first-id 3 --board-id 1");
    deltille(at).args(apart.split(' ')).assert().success();
    page.is("board");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Any numbers give either a board or a one-line error, and never part of a board.
    #[test]
    fn numbers_of_any_size_give_a_board_or_a_one_line_error(
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
