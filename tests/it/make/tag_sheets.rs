//! `deltag sheet`: tags to true scale, read back from what was written.

use std::path::Path;

use assert_cmd::Command;
use deltille::artwork;
use deltille::export::svg;
use deltille::family::Family;
use deltille::targets::{PaperSpec, TagSheetSpec, Target, TargetSpec};
use deltille::verify::{Finding, MarkFinding, TileFinding, Verifier};
use predicates::prelude::*;
use predicates::str::contains;

fn sheet(family: &str, arguments: &[&str], folder: &Path) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("deltag").unwrap();
    command.arg("sheet").arg(family).args(arguments).arg("-o").arg(folder).assert()
}

#[test]
fn every_format_is_written_and_every_cell_verified() {
    let folder = tempfile::tempdir().unwrap();
    let all = ["--pdf", "--svg", "--png", "--dpi", "200", "--ids", "0-2,9,30-33", "--name", "few"];
    sheet("d16h5", &all, folder.path())
        .success()
        .stdout(contains("8 tags exact, check bars").count(3).and(contains("page size exact")));
    for extension in ["pdf", "svg", "png"] {
        assert!(folder.path().join(format!("few.{extension}")).is_file());
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
}

#[test]
fn a_whole_family_takes_several_pages() {
    let folder = tempfile::tempdir().unwrap();
    sheet("d16h5", &["--svg"], folder.path())
        .success()
        .stdout(contains("d16h5-sheet-3.svg: verified").and(contains("tags exact").count(3)));
    let text = std::fs::read_to_string(folder.path().join("d16h5-sheet-1.svg")).unwrap();
    assert!(text.contains("fingerprint"), "the fingerprint is in the metadata");
    let nowhere = folder.path().join("nowhere");
    sheet("d16h5", &["--png", "--paper", "3000x3000mm", "--dpi", "2400"], &nowhere)
        .code(2)
        .stderr(contains("--dpi").and(contains(".deltille-").not()));
    assert!(!nowhere.exists());
    let pdf = tempfile::tempdir().unwrap();
    sheet("d16h5", &["--edge", "15mm"], pdf.path()).success().stdout(contains("78 tags exact"));
}

/// A sheet of four tags, after an edit of its tags' codes or of its SVG.
fn verdict(ids: &[u32], edit: impl Fn(&str) -> String) -> deltille::verify::Verdict {
    let family = Family::shipped("delTag25h7").unwrap();
    let build = |ids: &[u32]| {
        let (family_name, ids) = ("delTag25h7".to_owned(), ids.to_vec());
        let spec = TagSheetSpec { family: family_name, ids, edge_mm: 40.0, border_bits: 1.5 };
        let paper = PaperSpec { size: Some("A5".parse().unwrap()), ..PaperSpec::default() };
        Target::build("tags", &TargetSpec::Tags(spec), Some(&family), Some(&paper)).unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tags.svg");
    let drawn = artwork::draw(&build(ids), Some(&family)).unwrap();
    std::fs::write(&path, edit(&svg::to_string(&drawn, 0))).unwrap();
    let target = build(&[5, 6, 7, 8]);
    Verifier::new(&target, Some(&family)).unwrap().verify_path(&path).unwrap()
}

#[test]
fn a_wrong_sheet_is_refused_with_the_reason() {
    let same = str::to_owned;
    assert!(verdict(&[5, 6, 7, 8], same).passed);

    let exchanged = verdict(&[5, 7, 6, 8], same);
    assert!(!exchanged.passed && exchanged.sheets[0].tags_exact == 2, "{exchanged}");
    let reads = exchanged.sheets[0].findings.iter().any(|finding| {
        matches!(finding, Finding::Tile(TileFinding::TagReads { id: 6, reads: 7, .. }))
    });
    assert!(reads, "{exchanged}");

    let without = |svg: &str, id: &str| {
        let at = svg.find(&format!("id=\"{id}\"")).unwrap();
        let begin = svg[..at].rfind("<path").unwrap();
        let end = at + svg[at..].find("/>").unwrap() + 2;
        [&svg[..begin], &svg[end..]].concat()
    };
    let cut = |svg: &str| without(svg, "tile-8-r0-c0");
    let missing = verdict(&[5, 6, 7, 8], cut);
    assert_eq!(missing.sheets[0].findings, [TileFinding::TagMissing { id: 8 }.into()], "{missing}");

    let text = |svg: &str| without(svg, "label-4");
    let nameless = verdict(&[5, 6, 7, 8], text);
    assert!(
        matches!(nameless.sheets[0].findings[..], [Finding::Mark(MarkFinding::TextDiffers { .. })]),
        "{nameless}"
    );
}
