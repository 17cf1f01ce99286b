//! `deltille verify` as a user meets it.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use tempfile::TempDir;

fn deltille(folder: &Path, arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::cargo_bin("deltille").unwrap().current_dir(folder).args(arguments).assert()
}

/// A folder with a small board in every format.
fn board() -> TempDir {
    let folder = TempDir::new().unwrap();
    let arguments = ["board", "--rows", "3", "--cols", "4", "--edge", "20mm", "--name", "b"];
    let formats = ["--pdf", "--svg", "--png", "--dsc"];
    deltille(folder.path(), &[&arguments[..], &formats].concat()).success();
    folder
}

#[test]
fn the_files_beside_the_description_are_verified() {
    let folder = board();
    deltille(folder.path(), &["verify", "b.json", "--report", "r.json"])
        .success()
        .stdout(contains("b.pdf: verified, 12 corners within"))
        .stdout(contains("b.svg: verified"))
        .stdout(contains("b.png: verified"))
        .stdout(contains("b.dsc: verified, 1 board, 12 corners listed"))
        .stdout(contains("verified: 4 files of target b"));
    let report = fs::read_to_string(folder.path().join("r.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(report["passed"], true);
    assert_eq!(report["artifacts"][0]["sheets"][0]["corners_found"], 12);
}

#[test]
fn a_changed_file_fails_with_exit_code_1() {
    let folder = board();
    let svg = folder.path().join("b.svg");
    let text = fs::read_to_string(&svg).unwrap();
    // The tile at row 1, column 1 is gone.
    let line = text.lines().find(|line| line.contains("id=\"tile-0-r1-c1\"")).unwrap();
    fs::write(&svg, text.replace(line, "")).unwrap();
    deltille(folder.path(), &["verify", "b.json", "b.svg", "b.pdf", "--report", "r.json"])
        .code(1)
        .stdout(contains("b.svg: FAILED").and(contains("tile missing at row 1 col 1")))
        .stdout(contains("b.pdf: verified"))
        .stdout(contains("FAILED: 1 of 2 files differs from target b"));
    let report = fs::read_to_string(folder.path().join("r.json")).unwrap();
    assert!(report.contains("\"kind\": \"tile_colour\""));
}

#[test]
fn a_page_that_is_missing_fails_unless_one_is_verified_alone() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    let arguments = ["board", "--rows", "3", "--cols", "4", "--edge", "20mm", "--boards", "3"];
    deltille(path, &[&arguments[..], &["--name", "b", "--svg", "--no-verify"]].concat()).success();
    deltille(path, &["verify", "b.json"])
        .success()
        .stdout(contains("verified: 3 files"))
        .stderr("");
    fs::write(path.join("b-4.svg"), "").unwrap();
    let too_many = contains("b-4.svg: not compared, b has 3 pages").and(contains("b-3").not());
    deltille(path, &["verify", "b.json"]).success().stderr(too_many);
    deltille(path, &["verify", "b.json", "b-2.svg"]).success();
    let left_out = || contains("b-1.svg to b-3.svg: FAILED").and(contains("b-2.svg is missing"));
    deltille(path, &["verify", "b.json", "b-1.svg", "b-3.svg"]).code(1).stdout(left_out());
    fs::remove_file(path.join("b-2.svg")).unwrap();
    deltille(path, &["verify", "b.json"]).code(1).stdout(left_out());
    fs::remove_file(path.join("b-3.svg")).unwrap();
    deltille(path, &["verify", "b.json"]).code(1).stdout(contains("b-3.svg is missing"));
}

#[test]
fn a_net_without_a_page_and_a_file_that_is_none_do_not_end_the_run() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    let arguments = ["tetrahedron", "--edge", "90mm", "--paper", "A5", "--name", "t"];
    deltille(path, &[&arguments[..], &["--svg", "--stl", "--no-verify"]].concat()).success();
    fs::remove_file(path.join("t-2.svg")).unwrap();
    deltille(path, &["verify", "t.json"])
        .code(1)
        .stdout(contains("t-2.svg is missing").and(contains("t.stl: verified")));
    fs::write(path.join("t-1.svg"), "").unwrap();
    deltille(path, &["verify", "t.json", "no.pdf", "t.stl", "--report", "r.json"])
        .code(2)
        .stdout(contains("t.stl: verified"))
        .stderr(contains("no.pdf"));
    let report = fs::read_to_string(path.join("r.json")).unwrap();
    assert!(report.contains("\"passed\": false") && report.contains("no.pdf"), "{report}");
}

#[test]
fn bad_input_is_one_line_and_exit_code_2() {
    let folder = board();
    let path = folder.path();
    fs::write(path.join("empty.pdf"), "").unwrap();
    let pdf = fs::read(path.join("b.pdf")).unwrap();
    fs::write(path.join("cut.pdf"), &pdf[..pdf.len() / 2]).unwrap();
    fs::write(path.join("broken.json"), "{").unwrap();
    fs::create_dir(path.join("alone")).unwrap();
    fs::copy(path.join("b.json"), path.join("alone/b.json")).unwrap();
    let cases: [(&[&str], &str); 9] = [
        (&["b.json", "empty.pdf"], "empty.pdf"),
        (&["b.json", "cut.pdf"], "cut.pdf"),
        (&["b.json", "absent.png"], "absent.png"),
        (&["b.json", "b.json"], "only .pdf, .svg, .png"),
        (&["b.json", "b.mtl"], "it is compared with b.obj: name that"),
        (&["broken.json"], "broken.json"),
        (&["alone/b.json"], "no b.pdf, .svg, .png, .glb, .obj, .stl, .dsc or .dxf beside"),
        (&["b.json", "--report", "b.pdf/r.json"], "b.pdf"),
        (&["b.json", "--report", "b.json"], "--report: b.json holds deltille/target/1"),
    ];
    for (arguments, reason) in cases {
        let output = deltille(path, &[&["verify"], arguments].concat()).code(2);
        let output = output.stderr(contains(reason));
        let stderr = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.starts_with("error: "), "{stderr}");
    }
}

#[test]
fn what_not_every_viewer_shows_alike_is_named_with_its_place() {
    let folder = board();
    let svg = folder.path().join("b.svg");
    let text = fs::read_to_string(&svg).unwrap();
    let hidden = "<style>@media print { * { display: none } }</style>";
    fs::write(&svg, text.replace("<title>", &format!("{hidden}<title>"))).unwrap();
    let dsc = folder.path().join("b.dsc");
    let text = fs::read_to_string(&dsc).unwrap();
    fs::write(&dsc, text.replacen("\n0,", "\n7,", 1)).unwrap();
    deltille(folder.path(), &["verify", "b.json"])
        .code(1)
        .stdout(contains("b.svg: FAILED, line 4: element <style>: not every viewer shows"))
        .stdout(contains("b.dsc: FAILED").and(contains("is listed as tag 7")))
        .stdout(contains("b.pdf: verified"))
        .stdout(contains("FAILED: 2 of 4 files differ from target b"));
}
