//! `deltille verify` from the user's point of view.

use std::fs;
use std::path::Path;

use crate::common::command::deltille;
use crate::common::page::Page;
use serde_json::Value;
use tempfile::TempDir;

/// Creates a folder with a small board in every format.
fn board() -> TempDir {
    let folder = TempDir::new().unwrap();
    let args = "board --rows 3 --cols 4 --edge 20mm --name b --pdf --svg --png --dsc";
    deltille(folder.path(), args).success();
    folder
}

/// Replaces part of a text file.
fn edit(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).unwrap();
    let edited = text.replacen(from, to, 1);
    assert_ne!(text, edited);
    fs::write(path, edited).unwrap();
}

#[test]
fn a_finding_names_the_damaged_line_of_a_usd() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 3 --cols 4 --name b --usd --no-verify").success();
    let usd = at.join("b.usda");
    let whole = fs::read_to_string(&usd).unwrap();
    let verdict = || {
        let said = deltille(at, "verify b.json b.usda").code(1);
        String::from_utf8(said.get_output().stdout.clone()).unwrap()
    };
    edit(&usd, "upAxis", "upaxis");
    let said = verdict();
    assert!(said.contains("line 6: `upaxis") && said.contains("generate it again"), "{said}");
    fs::write(&usd, whole.lines().take(9).collect::<Vec<_>>().join("\n")).unwrap();
    let said = verdict();
    assert!(
        said.contains("line 10: the file ends") && said.contains("generate it again"),
        "{said}"
    );
}

#[test]
fn verify_reports_match_the_snapshot() {
    let mut page = Page::default();
    let verify = |page: &mut Page, at: &Path, args: &str, code: i32| -> Value {
        let output = page.run(at, &format!("deltille verify {args} --report r.json"));
        assert_eq!(output.status.code(), Some(code), "{args}");
        serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap()
    };
    page.title("A board");
    let folder = board();
    let at = folder.path();
    let report = verify(&mut page, at, "b.json", 0);
    assert_eq!(
        (&report["passed"], report["artifacts"].as_array().unwrap().len()),
        (&true.into(), 4)
    );
    assert_eq!(report["artifacts"][0]["sheets"][0]["corners_found"], 12);

    page.title("A tile is missing");
    let text = fs::read_to_string(at.join("b.svg")).unwrap();
    let tile = text.lines().find(|line| line.contains("id=\"tile-0-r1-c1\"")).unwrap();
    edit(&at.join("b.svg"), tile, "");
    let report = verify(&mut page, at, "b.json b.svg b.pdf", 1);
    let kinds = |at: usize, of: &str| -> Vec<&str> {
        let all = report["artifacts"][at].pointer(of).unwrap().as_array().unwrap();
        all.iter().map(|finding| finding["kind"].as_str().unwrap()).collect()
    };
    assert_eq!(report["passed"], false);
    assert!(kinds(0, "/sheets/0/findings").contains(&"tile_colour"), "{report}");
    assert_eq!(kinds(1, "/sheets/0/findings"), [""; 0]);

    page.title("A construct that viewers may render differently, and a wrong tag in the list");
    let folder = board();
    let at = folder.path();
    let hidden = "<style>@media print { * { display: none } }</style><title>";
    edit(&at.join("b.svg"), "<title>", hidden);
    edit(&at.join("b.dsc"), "\n0,", "\n7,");
    verify(&mut page, at, "b.json", 1);

    page.title("Files that cannot be verified");
    let folder = board();
    let at = folder.path();
    let pdf = fs::read(at.join("b.pdf")).unwrap();
    fs::write(at.join("cut.pdf"), &pdf[..pdf.len() / 2]).unwrap();
    fs::write(at.join("empty.pdf"), "").unwrap();
    fs::write(at.join("broken.json"), "{").unwrap();
    fs::create_dir(at.join("alone")).unwrap();
    fs::copy(at.join("b.json"), at.join("alone/b.json")).unwrap();
    for args in [
        "b.json empty.pdf",
        "b.json cut.pdf",
        "b.json absent.png",
        "b.json b.json",
        "b.json b.mtl",
        "broken.json",
        "alone/b.json",
        "b.json b.pdf --max-nodes 10",
        "b.json b.png --max-pixels 1k",
    ] {
        page.refused(at, &format!("deltille verify {args}"));
    }
    for report in ["b.pdf/r.json", "b.json"] {
        let output = page.warned(at, &format!("deltille verify b.json --report {report}"));
        assert_eq!(output.status.code(), Some(2), "{report}");
    }
    deltille(at, "verify b.json b.svg --max-bytes 1G --max-nodes 1M --max-seconds 90").success();

    page.title("Three pages");
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    let args = "board --rows 3 --cols 4 --edge 20mm --boards 3 --name b --svg --no-verify";
    deltille(at, args).success();
    verify(&mut page, at, "b.json", 0);
    page.title("One page too many");
    fs::write(at.join("b-4.svg"), "").unwrap();
    verify(&mut page, at, "b.json", 0);
    page.title("One page alone, and two without the third");
    verify(&mut page, at, "b.json b-2.svg", 0);
    verify(&mut page, at, "b.json b-1.svg b-3.svg", 1);
    page.title("One is missing, then two");
    fs::remove_file(at.join("b-2.svg")).unwrap();
    verify(&mut page, at, "b.json", 1);
    fs::remove_file(at.join("b-3.svg")).unwrap();
    verify(&mut page, at, "b.json", 1);

    page.title("A missing page of a net, an empty page and a missing file do not end the run");
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    let args = "tetrahedron --edge 90mm --paper A5 --name t --svg --stl --no-verify";
    deltille(at, args).success();
    fs::remove_file(at.join("t-2.svg")).unwrap();
    verify(&mut page, at, "t.json", 1);
    fs::write(at.join("t-1.svg"), "").unwrap();
    let report = verify(&mut page, at, "t.json no.pdf t.stl", 2);
    assert_eq!(report["passed"], false);
    page.is("verify");
}
