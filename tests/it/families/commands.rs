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
fn a_search_ends_after_the_round_in_which_its_time_is_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.json");
    deltag()
        .args(["gen-family", "d9h4", "--method", "search", "--time", "0.001", "-o"])
        .arg(&path)
        .assert()
        .success();
    let family = std::fs::read_to_string(&path).unwrap();
    assert!(family.contains("\"rounds\": 1"), "{family}");
}

/// What ships is where a search starts, and is said, with the true distance, before the search begins.
#[test]
fn a_search_starts_from_what_ships() {
    let folder = tempfile::tempdir().unwrap();
    let made = |family: &str, more: &[&str]| {
        let mut command = deltag();
        command.args(["gen-family", family, "--time", "0.1", "-o"]).arg(folder.path()).args(more);
        command.assert().success()
    };
    made("d25h7", &[])
        .stderr(contains(
            "starts from 1208 codes of d25h7: any two, in any turn, differ in at least 7",
        ))
        .stdout(contains("1208 codes of 25 bits"));
    let file = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("families/d25h7.json");
    assert_eq!(file("d25h7.json"), std::fs::read_to_string(shipped).unwrap());
    // Codes that are farther apart than asked for, and fewer of them under stricter rules.
    made("d36h10", &[])
        .stderr(contains("of d36h11").and(contains("at least 12 cells, more than the 10")));
    made("d16h5", &["--min-complexity", "0.7"]).stderr(contains("starts from "));
    let silent = made("d16h5", &["--from-nothing", "--force"]);
    assert!(silent.get_output().stderr.is_empty());
}

/// Work is counted alike on every machine, whatever its number of threads.
#[test]
fn a_search_by_work_depends_on_its_seed_alone() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, more: &[&str]| {
        let mut command = deltag();
        command.args([
            "gen-family",
            "d16h6",
            "--from-nothing",
            "--work",
            "1",
            "--name",
            "codes",
            "-o",
        ]);
        command.arg(folder.path().join(name)).args(more).assert().success();
        std::fs::read_to_string(folder.path().join(name)).unwrap()
    };
    let one = made("one.json", &["-j", "1"]);
    assert_eq!(one, made("two.json", &["-j", "2"]));
    assert_ne!(one, made("other.json", &["--seed", "2"]));
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
        (|text| text[..text.len() / 2].to_owned(), "not a family file"),
        (|_| "34 codes".to_owned(), "not a family file (line 1, column "),
        (|text| text.replace("\"distance\": 5", "\"distance\": \"5\""), "wrong kind"),
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
            .stderr(contains(reason).and(contains(file.path().to_str().unwrap())))
            .stderr(contains("struct").or(contains("u32")).not());
    }
}

#[test]
fn altered_codes_do_not_hold_and_no_command_takes_them() {
    type Edit = fn(&str) -> String;
    let cases: [(Edit, &str); 4] = [
        (|text| text.replace("\"name\": \"delTag16h5\"", "\"name\": \"d9h3\""), "field `name`"),
        (
            |text| text.replace("0.001556396484375", "0.000556396484375"),
            "field `false_positive_rate`",
        ),
        (|text| text.replace("0x24d6", "0x24d7"), "field `fingerprint`"),
        (|text| text.replace("0x2a9b", "0x24d6"), "code 0 again"),
    ];
    for (edit, reason) in cases {
        let file = altered(edit);
        let verify = |files: &[&Path]| deltag().arg("verify-family").args(files).assert();
        verify(&[file.path()]).code(1).stdout(contains("DOES NOT HOLD").and(contains(reason)));
        deltag().arg("info").arg(file.path()).assert().code(2).stderr(contains(reason));
        // One bad file does not hide the others.
        let missing = Path::new("/no/such/file.json");
        verify(&[missing, file.path(), Path::new("d16h5")])
            .code(2)
            .stdout(contains(reason).and(contains("d16h5: holds")))
            .stderr(contains("/no/such/file.json"));
    }
}

#[test]
fn a_claim_that_does_not_hold_is_named() {
    // Fewer white cells than the rule now asks for; the fingerprint covers only the codes.
    let file = altered(|t| t.replace("\"black_distance\": 5", "\"black_distance\": 9"));
    deltag().arg("verify-family").arg(file.path()).assert().code(1).stdout(contains("rules:"));
    let warning = contains("warning: ").and(contains("is not what it claims"));
    deltag().arg("info").arg(file.path()).assert().success().stderr(warning);
    let file = altered(|t| t.replace("\"step\": 982451653", "\"step\": 982451655"));
    let other = contains("construction: gives other codes");
    deltag().arg("verify-family").arg(file.path()).assert().code(1).stdout(other);
    // What is not repeated is named.
    let prefix = contains("not checked: all but the first 4194304 candidates");
    deltag().args(["verify-family", "delTag36h11"]).assert().success().stdout(prefix);
}

/// A refusal is one line that names what to change, in nobody's programming language.
fn refused(arguments: &[&str], mention: &str) {
    let output = deltag().args(arguments).output().unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert!(text.starts_with("error: ") && text.lines().count() == 1, "{arguments:?}: {text}");
    assert!(text.contains(mention), "{arguments:?} should mention {mention}: {text}");
    for rust in ["target type", "u64", "u32", "f64", "Some(", "invalid digit", "..=", "184467"] {
        assert!(!text.contains(rust), "{arguments:?}: {text}");
    }
}

#[test]
fn bad_arguments_are_one_line_and_exit_code_2() {
    let gen_family = |arguments: &[&str], mention: &str| {
        refused(&[&["gen-family", "d25h7"], arguments].concat(), mention);
    };
    refused(&["gen-family", "d17h5"], "17");
    refused(&["gen-family", "d16h0"], "between 1 and the 16 bits");
    refused(&["gen-family", "d16h99999999999"], "d16h99999999999");
    refused(&["gen-family", "d49h12", "--method", "search"], "--method search");
    refused(&["gen-family", "d49h12", "--method", "lexicode"], "--method");
    let far = ["gen-family", "d36h30", "--time", "0.1"];
    refused(&far, "no word of 36 bits was found that satisfies the rules at distance 30");
    gen_family(&["--threads", "0"], "--threads");
    gen_family(&["--time", "-1"], "--time");
    gen_family(&["--time", "nan"], "--time");
    gen_family(&["--seed", "-1"], "--seed");
    gen_family(&["--seed", "x"], "--seed");
    gen_family(&["--rounds", "0"], "--rounds");
    gen_family(&["--limit", "0"], "--limit");
    gen_family(&["--black-distance", "99"], "--black-distance");
    gen_family(&["--black-distance", "26"], "--black-distance");
    gen_family(&["--min-complexity", "2"], "--min-complexity");
    gen_family(&["--rules", "/nonexist"], "--rules");
    gen_family(&["--name", "a/b"], "--name");
    gen_family(&["--name", ""], "--name");
    refused(&["gen-family", "d25h7", "-o", "x.txt"], "-o x.txt");
    refused(&["gen-family", "d25h7", "-o", "Cargo.toml/x"], "-o: Cargo.toml/x");
    gen_family(&["--rounds", "3"], "--rounds: does nothing with --method best");
    gen_family(&["--resume", "x"], "--resume");
    gen_family(&["--method", "lexicode", "--seed", "3"], "--seed");
    gen_family(&["--method", "lexicode", "--time", "3"], "--time");
    gen_family(&["--method", "lexicode", "--limit", "3"], "--limit");
    gen_family(&["--method", "search", "--work", "3"], "--work: does nothing with --method search");
    gen_family(&["--method", "lexicode", "--from-nothing"], "--from-nothing");
    gen_family(&["--work", "3", "--time", "3"], "--time");
    gen_family(&["--work", "0"], "--work");
    refused(&["verify-family", "no-such-family"], "no-such-family");
    refused(&["verify-family", "/no/such/file.json"], "/no/such/file.json");
    refused(&["verify-family"], "FAMILIES");
    refused(&["export", "d16h5", "--format", "cobol"], "--format");
    refused(&["export", "d16h5", "--format", "c", "-o", "x.txt"], "x.h");
    refused(&["export", "d16h5", "--format", "c", "--name", "x"], "--name");
    refused(&["export", "d16h5", "--format", "c", "-o", "/proc/no/x.h"], "-o");
    refused(&["show", "d16h5", "-o", "/proc/no"], "-o");
    refused(&["show", "d16h5", "--name", "a/b"], "--name");
    refused(&["show", "d16h5", "--ids", "0,0,0"], "0 is named twice");
    refused(&["show", "d16h5", "--ids", "999"], "--ids");
    refused(&["show", "d16h5", "--dpi", "300"], "--png");
    refused(&["show", "d16h5", "--png", "--dpi", "1"], "--dpi");
    refused(&["show", "d16h5", "--columns", "0"], "--columns");
    refused(&["show", "d16h5", "-o", "x.pdf"], "x.svg");
    refused(&["sheet", "d36h9"], "--ids");
    refused(&["sheet", "d16h5", "--edge", "1mm"], "--edge");
    refused(&["sheet", "d16h5", "--edge", "wide"], "--edge");
    refused(&["sheet", "d16h5", "--edge", "400mm"], "--paper");
    refused(&["sheet", "d16h5", "--paper", "A9"], "--paper");
    refused(&["sheet", "d16h5", "--margin", "-1mm"], "--margin");
    refused(&["sheet", "d16h5", "--orientation", "up"], "--orientation");
    refused(&["sheet", "d16h5", "--tag-border", "0"], "--tag-border");
    refused(&["sheet", "d16h5", "--ids", "5-3"], "--ids");
    refused(&["sheet", "d16h5", "--ids", "99"], "--ids");
    refused(&["sheet", "d16h5", "-o", "x.pdf"], "-o");
    refused(&["by-rank", "d49h12", "--rank", "99999999"], "--rank");
    deltag().args(["by-rank", "d49h12", "--rank", "18446744073709551615"]).assert().code(2);
    refused(&["by-rank", "d49h12", "--rank", "1", "--count", "5592320"], "there are 5592319");
    refused(&["gen-family", "d9h3", "--name", "d16h5"], "--name");
    refused(&["bounds", "d025h07"], "leading zeros");
    refused(&["by-rank", "d49h12", "--rank", "-1"], "--rank");
    refused(&["by-rank", "d49h12", "--rank", "1", "--count", "0"], "--count");
    refused(&["by-rank", "delTag16h5", "--rank", "1"], "delTag16h5");
    refused(&["bounds", "d8h2"], "8");
    refused(&["info", "nothing"], "nothing");
    refused(&["plan", "--faces", "0"], "--faces");
    refused(&["plan", "--tags-per-face", "1.5"], "--tags-per-face");
    refused(&["plan", "--corrects", "24"], "--corrects");
    refused(&["plan", "--faces", "9999999"], "--faces");
    refused(&["frobnicate"], "frobnicate");
    refused(&[], "--help");
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

/// A file with more codes, or of other tags, is not lost; neither is what was found.
#[test]
fn a_larger_family_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("d16h5.json");
    deltag().args(["export", "d16h5", "--format", "json", "-o"]).arg(&file).assert().success();
    let before = std::fs::read(&file).unwrap();
    let lexicode = |family: &str, more: &[&str]| {
        let mut command = deltag();
        command.args(["gen-family", family, "--method", "lexicode"]).args(more);
        command.arg("-o").arg(&file).assert()
    };
    lexicode("d16h5", &[]).code(1).stderr(contains("keeps its 78 codes").and(contains("--force")));
    assert!(folder.path().join("d16h5-2.json").is_file());
    lexicode("d9h3", &[]).code(2).stderr(contains("78 codes of 16 bits, distance 5"));
    assert!(std::fs::read(&file).unwrap() == before);
    lexicode("d16h5", &["--force"]).success().stdout(contains("34 codes"));
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
    for (text, reason) in [
        ("min_complexty = 0.7", "unknown field `min_complexty`"),
        ("min_complexity = nan", "between 0 and 1"),
        ("min_complexity = \"much\"", "field `min_complexity`"),
        ("black_distance = 0.5", "field `black_distance`"),
        ("white_distance = 99", "field `white_distance`"),
        ("\nmin_complexity 0.5", "line 2"),
    ] {
        search(text).code(2).stderr(contains(reason).and(contains("rules.toml")));
    }
}

#[test]
fn plan_names_the_smallest_family_that_suffices() {
    let plan = |arguments: &[&str]| deltag().arg("plan").args(arguments).assert();
    plan(&["--faces", "20", "--tags-per-face", "10"])
        .success()
        .stdout(contains("20 x 10 = 200 tags: delTag25h7, 343 codes"));
    plan(&["--faces", "6", "--tags-per-face", "10"]).success().stdout(contains("d16h5, 78 codes"));
    plan(&["--tags-per-face", "10", "--corrects", "4"]).success().stdout(contains("25h9"));
    plan(&["--faces", "9999999"]).code(2).stderr(contains("--faces"));
}

/// `deltag info d16h5 | head -1` is no error.
#[test]
fn a_reader_that_goes_away_ends_the_work_quietly() {
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_deltag"))
        .args(["verify-family", "d36h11", "d16h5"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.code() == Some(141) && output.stderr.is_empty(), "{output:?}");
}

/// The tags of one board and of one icosahedron, as `deltille` makes them.
#[test]
fn info_tells_how_many_targets_a_family_covers() {
    deltag().args(["info", "d25h7"]).assert().success().stdout(
        contains("1208")
            .and(contains("corrects 3 cells"))
            .and(contains("15 of 30 neighbouring pairs"))
            .and(contains("boards of 10 x 11 corners (11 tags each)"))
            .and(contains("when up to 3 cells are corrected")),
    );
}

#[test]
fn exports_list_every_code() {
    for format in ["c", "rust", "python", "json", "txt", "opencv"] {
        let output = deltag().args(["export", "delTag16h5", "--format", format]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.matches("0x").count(), 34 + usize::from(format == "json"), "{format}");
    }
    deltag()
        .args(["export", "delTag16h5", "--format", "opencv"])
        .assert()
        .success()
        .stdout(contains("triangular tags: not an ArUco dictionary"));
}

/// The tool chains decide whether an export is of use; those that are not installed are skipped.
#[test]
fn exports_compile() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("families/d49h12.json");
    // A name that is no identifier, and 49-bit codes.
    let family = folder.path().join("family.json");
    let text = std::fs::read_to_string(shipped).unwrap();
    std::fs::write(&family, text.replace("\"name\": \"d49h12\"", "\"name\": \"4-tags\"")).unwrap();
    let export = |format: &str, file: &str| {
        deltag()
            .arg("export")
            .arg(&family)
            .args(["--format", format, "-o"])
            .arg(folder.path().join(file))
            .assert()
            .success();
    };
    for (format, file) in [
        ("c", "tags.h"),
        ("rust", "tags.rs"),
        ("python", "tags.py"),
        ("json", "tags.json"),
        ("opencv", "tags.yml"),
    ] {
        export(format, file);
    }
    let c = "#include \"tags.h\"\n#include \"tags.h\"\nint main(void) { return \
             family_4_tags_codes[FAMILY_4_TAGS_SIZE - 1] >> FAMILY_4_TAGS_BITS ? 1 : 0; }\n";
    std::fs::write(folder.path().join("main.c"), c).unwrap();
    std::fs::write(folder.path().join("main.cpp"), c).unwrap();
    let rust = "mod tags;\nfn main() { assert!(tags::CODES.iter().all(|c| c >> tags::BITS == 0)); \
                assert_eq!(tags::DISTANCE, 12); }\n";
    std::fs::write(folder.path().join("main.rs"), rust).unwrap();
    let python = "import tags, json\nassert len(tags.CODES) == 20000 and tags.BITS == 49\n\
                  listed = json.load(open('tags.json'))['codes']\n\
                  assert [int(c, 16) for c in listed] == list(tags.CODES)\n";
    let yaml = "import cv2\nf = cv2.FileStorage('tags.yml', cv2.FILE_STORAGE_READ)\n\
                assert f.getNode('name').string() == '4-tags'\n\
                assert [f.getNode(n).real() for n in ('bits', 'distance', 'size')] == \
                [49, 12, 20000]\n\
                import tags\ncodes = f.getNode('codes')\n\
                assert [int(codes.at(i).string(), 16) for i in range(codes.size())] == \
                list(tags.CODES)\n";
    let has_cv = std::process::Command::new("python3").args(["-c", "import cv2"]).output();
    let has_cv = has_cv.is_ok_and(|o| o.status.success());
    let strict = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o", "main", "main.c"];
    let mut runs: Vec<(&str, Vec<&str>)> = vec![
        ("gcc", [&["-std=c99"][..], &strict].concat()),
        ("g++", vec!["-Wall", "-Werror", "-o", "main", "main.cpp"]),
        ("rustc", vec!["--edition", "2021", "-Dwarnings", "-o", "main-rs", "main.rs"]),
        ("python3", vec!["-c", python]),
    ];
    if has_cv {
        runs.push(("python3", vec!["-c", yaml]));
    } else {
        println!("skipped: OpenCV's python module is not installed");
    }
    for (program, arguments) in runs {
        match std::process::Command::new(program)
            .args(arguments)
            .current_dir(folder.path())
            .output()
        {
            Err(_) => println!("skipped: {program} is not installed"),
            Ok(output) => {
                let errors = String::from_utf8_lossy(&output.stderr);
                assert!(output.status.success(), "{program}: {errors}");
            }
        }
    }
}
