//! The `deltag` program: families made, checked and refused.

use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;

fn deltag() -> Command {
    Command::cargo_bin("deltag").unwrap()
}

/// A shipped family file after one edit of its text.
fn altered(edit: impl Fn(&str) -> String) -> tempfile::NamedTempFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("families/delTag16h5.json");
    let file = tempfile::Builder::new().suffix(".json").tempfile().unwrap();
    std::fs::write(file.path(), edit(&std::fs::read_to_string(path).unwrap())).unwrap();
    file
}

#[test]
fn the_published_lexicode_is_written_as_shipped() {
    let folder = tempfile::tempdir().unwrap();
    deltag()
        .args(["gen-family", "d16h5", "--method", "lexicode", "--name", "delTag16h5", "-o"])
        .arg(folder.path())
        .assert()
        .success()
        .stdout(contains("34 codes"));
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("families/delTag16h5.json");
    assert_eq!(
        std::fs::read_to_string(folder.path().join("delTag16h5.json")).unwrap(),
        std::fs::read_to_string(shipped).unwrap()
    );
}

#[test]
fn damaged_family_files_are_refused_with_the_reason() {
    type Edit = fn(&str) -> String;
    let cases: [(Edit, &str); 6] = [
        (|text| text.replace("0x24d6", "0x24d7"), "field `fingerprint`"),
        (|text| text.replace("0x2a9b", "0x24d6"), "code 0 again"),
        (|text| text[..text.len() / 2].to_owned(), "not a family file"),
        (|text| text.replace("family/1", "family/9"), "field `schema` is `deltille/family/9`"),
        (|text| text.replace("\"bits\": 16", "\"bits\": 17"), "field `bits`"),
        (|text| text.replace("\"rules\"", "\"rulez\""), "unknown field `rulez`"),
    ];
    for (edit, reason) in cases {
        let file = altered(edit);
        deltag()
            .arg("verify-family")
            .arg(file.path())
            .assert()
            .code(2)
            .stderr(contains(reason).and(contains(file.path().to_str().unwrap())));
    }
}

#[test]
fn a_claim_that_does_not_hold_is_named() {
    // Fewer white cells than the rule now asks for; the fingerprint covers only the codes.
    let file = altered(|t| t.replace("\"black_distance\": 5", "\"black_distance\": 9"));
    deltag().arg("verify-family").arg(file.path()).assert().code(1).stdout(contains("rules:"));
}

#[test]
fn bad_arguments_are_one_line_and_exit_code_2() {
    for arguments in [
        &["gen-family", "d17h5"][..],
        &["gen-family", "d16h0"],
        &["gen-family", "d16h99999999999"],
        &["gen-family", "d16h5", "--threads", "0"],
        &["verify-family", "no-such-family"],
        &["verify-family", "/no/such/file.json"],
        &["frobnicate"],
        &[],
    ] {
        let one_line = predicate::function(|text: &str| text.lines().count() == 1);
        deltag()
            .args(arguments)
            .assert()
            .code(2)
            .stderr(predicates::str::starts_with("error: ").and(one_line));
    }
}

#[test]
fn a_search_without_an_answer_says_why_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    deltag()
        .args(["gen-family", "d9h9", "--method", "search", "--rounds", "1", "-o"])
        .arg(folder.path())
        .assert()
        .code(2)
        .stderr(predicates::str::starts_with("error: "));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn rules_come_from_a_file_and_unknown_ones_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let rules = folder.path().join("rules.toml");
    let search = |text: &str| {
        std::fs::write(&rules, text).unwrap();
        deltag()
            .args(["gen-family", "d16h5", "--method", "lexicode", "--rules"])
            .arg(&rules)
            .arg("-o")
            .arg(folder.path().join("d16h5.json"))
            .assert()
    };
    search("min_complexity = 0.7").success();
    deltag().arg("verify-family").arg(folder.path().join("d16h5.json")).assert().success();
    search("min_complexty = 0.7").code(2).stderr(contains("min_complexty"));
    search("min_complexity = nan").code(2).stderr(contains("between 0 and 1"));
}

#[test]
fn plan_names_the_smallest_family_that_suffices() {
    deltag()
        .args(["plan", "--faces", "20", "--tags-per-face", "10"])
        .assert()
        .success()
        .stdout(contains("25h7"));
    deltag().args(["plan", "--faces", "9999999"]).assert().code(2).stderr(contains("--faces"));
}

#[test]
fn exports_list_every_code() {
    for format in ["c", "rust", "python", "json", "txt"] {
        let output = deltag().args(["export", "delTag16h5", "--format", format]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.matches("0x").count(), 34 + usize::from(format == "json"), "{format}");
    }
    deltag()
        .args(["export", "delTag16h5", "--format", "opencv"])
        .assert()
        .success()
        .stdout(contains("marker_0: \"0010010011010110\""));
}
