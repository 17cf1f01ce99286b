//! The `deltag` program: generating and checking families, and its errors.

use std::path::Path;

use crate::common::page::Page;
use assert_cmd::Command;
use deltille::family::{Construction, Family};

fn deltag() -> Command {
    Command::cargo_bin("deltag").unwrap()
}

#[test]
fn a_search_ends_after_the_round_in_which_its_time_runs_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.json");
    deltag()
        .args(["gen-family", "d9h4", "--method", "search", "--time", "0.001", "-o"])
        .arg(&path)
        .assert()
        .success();
    let family: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    assert_eq!(family["construction"]["rounds"], 1, "{}", family["construction"]);
}

/// A search starts from a shipped family and says so, with the true distance, before it begins: from codes that are
/// farther apart than requested, and from fewer codes under stricter rules.
#[test]
fn a_search_starts_from_a_shipped_family() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for args in ["d25h7", "d36h10", "d16h5 --min-complexity 0.7", "d16h5 --from-scratch --force"] {
        let output = page.warned(at, &format!("deltag gen-family {args} --time 0.1 -o ."));
        assert!(output.status.success(), "{args}");
    }
    page.is("deltag-gen-family-starts");
    let shipped = Path::new(crate::common::REPOSITORY).join("families/d25h7.json");
    assert!(std::fs::read(at.join("d25h7.json")).unwrap() == std::fs::read(shipped).unwrap());
}

/// Work is counted the same way on every machine, with any number of threads.
#[test]
fn a_search_by_work_depends_on_its_seed_alone() {
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, more: &[&str]| {
        let mut command = deltag();
        command.args([
            "gen-family",
            "d9h3",
            "--from-scratch",
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
        .success();
    let shipped = Path::new(crate::common::REPOSITORY).join("families/delTag16h5.json");
    assert_eq!(
        std::fs::read_to_string(folder.path().join("delTag16h5.json")).unwrap(),
        std::fs::read_to_string(shipped).unwrap()
    );
}

/// Each command that reads families names the problem of an invalid file.
#[test]
fn commands_name_the_problem_of_an_invalid_family() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shipped = Path::new(crate::common::REPOSITORY).join("families/delTag16h5.json");
    let good = std::fs::read_to_string(shipped).unwrap();
    let mut page = Page::default();
    let mut check = |title: &str, text: String, codes: [i32; 2]| {
        assert_ne!(text, good, "{title}");
        std::fs::write(at.join("f.json"), text).unwrap();
        page.title(title);
        for (command, code) in ["verify-family", "info"].into_iter().zip(codes) {
            let run = if code == 0 { Page::warned } else { Page::run };
            let output = run(&mut page, at, &format!("deltag {command} f.json"));
            assert_eq!(output.status.code(), Some(code), "{title}");
        }
    };
    check("Half of it", good[..good.len() / 2].to_owned(), [2, 2]);
    check("Not JSON", "34 codes".to_owned(), [2, 2]);
    for (from, to, codes) in [
        ("\"distance\": 5", "\"distance\": \"5\"", [2, 2]),
        ("family/1", "family/9", [2, 2]),
        ("\"bits\": 16", "\"bits\": 17", [2, 2]),
        ("\"rules\"", "\"rulez\"", [2, 2]),
        // Altered codes violate the claims, and every command rejects them.
        ("\"name\": \"delTag16h5\"", "\"name\": \"d9h3\"", [1, 2]),
        ("0.001556396484375", "0.000556396484375", [1, 2]),
        ("0x24d6", "0x24d7", [1, 2]),
        ("0x2a9b", "0x24d6", [1, 2]),
        // Fewer white cells than the rule now requires; the fingerprint covers only the codes.
        ("\"black_distance\": 5", "\"black_distance\": 9", [1, 0]),
        ("\"step\": 982451653", "\"step\": 982451655", [1, 0]),
    ] {
        check(&format!("{to} instead of {from}"), good.replace(from, to), codes);
    }
    page.title("One bad file does not hide the others");
    let output = page.run(at, "deltag verify-family no-such.json f.json d16h5");
    assert_eq!(output.status.code(), Some(2));
    page.title("Checks that are not repeated are named");
    assert!(page.run(at, "deltag verify-family delTag36h11").status.success());
    page.is("deltag-verify-family");
}

#[test]
fn bad_arguments_give_one_line_and_exit_code_2() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("file"), "").unwrap();
    let mut page = Page::default();
    for args in [
        "",
        "frobnicate",
        "gen-family d17h5",
        "gen-family d16h0",
        "gen-family d16h99999999999",
        "gen-family d49h12 --method search",
        "gen-family d49h12 --method lexicode",
        "gen-family d36h30 --time 0.1",
        "gen-family d9h9 --method search --rounds 1",
        "gen-family d9h3 --name d16h5",
        "gen-family d25h7 --threads 0",
        "gen-family d25h7 --time -1",
        "gen-family d25h7 --time nan",
        "gen-family d25h7 --seed -1",
        "gen-family d25h7 --seed x",
        "gen-family d25h7 --rounds 0",
        "gen-family d25h7 --limit 0",
        "gen-family d25h7 --black-distance 99",
        "gen-family d25h7 --black-distance 26",
        "gen-family d25h7 --min-complexity 2",
        "gen-family d25h7 --corrects 2",
        "gen-family d25h7 --false-positives 2",
        "gen-family d25h7 --false-positives 1e-4 --corrects 9",
        "gen-family d25h7 --false-positives 1e-4 --min-complexity 0.5",
        "gen-family d25h7 --false-positives 1e-4 --method search",
        "gen-family d9h3 --false-positives 1e-4",
        "frontier d36h9 --false-positives 1e-12",
        "info d16h5 d25h7",
        "info d16h5 d16h5 d16h5",
        "gen-family d25h7 --extend d16h5",
        "gen-family d25h7 --rules nowhere.toml",
        "gen-family d25h7 --name a/b",
        "gen-family d25h7 --name ''",
        "gen-family d25h7 -o x.txt",
        "gen-family d25h7 -o file/x",
        "gen-family d25h7 --rounds 3",
        "gen-family d25h7 --method lexicode --seed 3",
        "gen-family d25h7 --method lexicode --time 3",
        "gen-family d25h7 --method lexicode --limit 3",
        "gen-family d25h7 --method search --work 3",
        "gen-family d25h7 --method lexicode --from-scratch",
        "gen-family d25h7 --work 3 --time 3",
        "gen-family d25h7 --work 0",
        "verify-family",
        "verify-family no-such-family",
        "verify-family no/such/file.json",
        "info nothing",
        "export d16h5 --format cobol",
        "export d16h5 --format c -o x.txt",
        "export d16h5 --format c --name x",
        "export d16h5 --format c -o /proc/no/x.h",
        "show d16h5 -o /proc/no",
        "show d16h5 --name a/b",
        "show d16h5 --ids 0,0,0",
        "show d16h5 --ids 999",
        "show d16h5 --dpi 300",
        "show d16h5 --png --dpi 1",
        "show d16h5 --columns 0",
        "show d16h5 -o x.pdf",
        "by-rank d49h12 --rank 99999999",
        "by-rank d49h12 --rank 18446744073709551615",
        "by-rank d49h12 --rank -1",
        "by-rank d49h12 --rank 1 --count 5592320",
        "by-rank d49h12 --rank 1 --count 0",
        "by-rank d64h12 --rank 22906490880",
        "gen-family d64h12 --method search",
        "gen-family d81h12",
        "by-rank delTag16h5 --rank 1",
        "bounds d025h07",
        "bounds d8h2",
        "plan --faces 0",
        "plan --faces 9999999",
        "plan --tags-per-face 1.5",
        "plan --corrects 24",
    ] {
        page.refused(at, &format!("deltag {args}"));
    }
    page.title("Rules from a file");
    let search = "deltag gen-family d16h5 --method lexicode --rules rules.toml -o d16h5.json";
    for text in [
        "min_complexty = 0.7",
        "min_complexity = nan",
        "min_complexity = \"much\"",
        "black_distance = 0.5",
        "white_distance = 99",
        "\nmin_complexity 0.5",
    ] {
        page.title(&format!("{text:?}"));
        std::fs::write(at.join("rules.toml"), text).unwrap();
        page.refused(at, search);
    }
    page.is("deltag");
    std::fs::write(at.join("rules.toml"), "min_complexity = 0.7").unwrap();
    for command in [search, "deltag verify-family d16h5.json"] {
        assert!(Page::default().run(at, command).status.success(), "{command}");
    }
}

/// A file with more codes, or with other tags, is kept, and so are the new codes.
#[test]
fn a_larger_family_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    let lexicode = "--method lexicode -o d16h5.json";
    page.run(at, "deltag export d16h5 --format json -o d16h5.json");
    let before = std::fs::read(at.join("d16h5.json")).unwrap();
    let smaller = page.run(at, &format!("deltag gen-family d16h5 {lexicode}"));
    assert_eq!(smaller.status.code(), Some(1));
    assert!(at.join("d16h5-2.json").is_file());
    page.refused(at, &format!("deltag gen-family d9h3 {lexicode}"));
    assert!(std::fs::read(at.join("d16h5.json")).unwrap() == before);
    page.run(at, &format!("deltag gen-family d16h5 {lexicode} --force"));
    assert!(std::fs::read(at.join("d16h5.json")).unwrap() != before);
    page.is("deltag-gen-family-replaces");
}

/// The coverage of a family: the tags of one board and of one icosahedron, as `deltille` generates them; and the
/// smallest family that suffices.
#[test]
fn families_are_described_by_the_targets_that_they_cover() {
    let folder = tempfile::tempdir().unwrap();
    let mut page = Page::default();
    for args in [
        "info d25h7",
        "plan --faces 20 --tags-per-face 10",
        "plan --faces 6 --tags-per-face 10",
        "plan --tags-per-face 10 --corrects 4",
        "info d16h5 delTag16h5",
        "frontier d25h9 --false-positives 1e-4 --corrects 2",
        "bounds d25h7",
    ] {
        assert!(page.run(folder.path(), &format!("deltag {args}")).status.success(), "{args}");
    }
    page.is("deltag-info");
}

/// The chosen rule has the most codes among those with few enough natural false positives, and the family generated
/// with it stays below that limit.
#[test]
fn a_rule_is_chosen_by_the_false_positives_it_leaves() {
    let folder = tempfile::tempdir().unwrap();
    let made = |args: &str| {
        let mut command = deltag();
        command.args(["gen-family", "d36h11", "--time", "0.1", "--force", "-o"]).arg(folder.path());
        command.args(args.split(' ')).assert().success();
        let text = std::fs::read_to_string(folder.path().join("d36h11.json")).unwrap();
        Family::from_json(&text).unwrap()
    };
    let shipped = Family::shipped("d36h11").unwrap();
    for (accepted, corrects, more) in [(2e-4, 3, true), (1e-5, 3, false)] {
        let family = made(&format!("--false-positives {accepted} --corrects {corrects}"));
        let rates = family.natural_false_positive_rates().unwrap();
        assert!(rates[corrects] <= 1.02 * accepted, "{rates:?}");
        assert_eq!(family.len() > shipped.len(), more, "{}", family.len());
    }
}

/// `deltag info d16h5 | head -1` is not an error.
#[test]
fn a_reader_that_closes_the_pipe_ends_the_program_quietly() {
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

#[test]
fn exports_list_every_code() {
    for format in ["c", "rust", "python", "json", "txt", "opencv"] {
        let output = deltag().args(["export", "delTag16h5", "--format", format]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.matches("0x").count(), 34 + usize::from(format == "json"), "{format}");
    }
}

/// Creates a folder with exports of 64-bit codes, which fill a machine word, under a name that is not an identifier.
fn exports() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let shipped = Path::new(crate::common::REPOSITORY).join("families/d64h12.json");
    let text = std::fs::read_to_string(shipped).unwrap();
    let named = text.replace("\"name\": \"d64h12\"", "\"name\": \"4-tags\"");
    std::fs::write(folder.path().join("family.json"), named).unwrap();
    for (format, file) in [
        ("c", "tags.h"),
        ("rust", "tags.rs"),
        ("python", "tags.py"),
        ("json", "tags.json"),
        ("opencv", "tags.yml"),
    ] {
        let args = ["export", "family.json", "--format", format, "-o", file];
        deltag().current_dir(folder.path()).args(args).assert().success();
    }
    folder
}

/// Runs another program in a folder.
#[track_caller]
fn assert_runs(folder: &Path, program: impl AsRef<std::ffi::OsStr>, args: &[&str]) {
    let output = std::process::Command::new(program).args(args).current_dir(folder).output();
    let output = output.unwrap();
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
#[cfg_attr(not(has_gcc), ignore = "no gcc and g++ on the path")]
fn exports_compile_in_c() {
    let folder = exports();
    let text = "#include \"tags.h\"\n#include \"tags.h\"\nint main(void) { return \
                (family_4_tags_codes[FAMILY_4_TAGS_SIZE - 1] >> (FAMILY_4_TAGS_BITS - 1)) >> 1 ? 1 : 0; }\n";
    for name in ["main.c", "main.cpp"] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-o", "main", "main.c"];
    assert_runs(folder.path(), "gcc", &strict);
    assert_runs(folder.path(), "g++", &["-Wall", "-Werror", "-o", "main", "main.cpp"]);
}

#[test]
fn exports_compile_in_rust() {
    let folder = exports();
    let text = "mod tags;\nfn main() { assert!(tags::CODES.iter().any(|c| c >> (tags::BITS - 1) == 1)); \
                assert_eq!(tags::DISTANCE, 12); }\n";
    std::fs::write(folder.path().join("main.rs"), text).unwrap();
    let args = ["--edition", "2021", "-Dwarnings", "-o", "main-rs", "main.rs"];
    assert_runs(folder.path(), "rustc", &args);
}

#[test]
#[cfg_attr(not(has_python), ignore = "no python3 on the path")]
fn exports_are_read_by_python() {
    let text = "import tags, json\nassert len(tags.CODES) == 10000 and tags.BITS == 64\n\
                listed = json.load(open('tags.json'))['codes']\n\
                assert [int(c, 16) for c in listed] == list(tags.CODES)\n";
    assert_runs(exports().path(), "python3", &["-c", text]);
}

#[test]
#[cfg_attr(not(has_opencv), ignore = "no OpenCV: set DELTILLE_PYTHON to a Python that has it")]
fn exports_are_read_by_opencv() {
    let text = "import cv2\nf = cv2.FileStorage('tags.yml', cv2.FILE_STORAGE_READ)\n\
                assert f.getNode('name').string() == '4-tags'\n\
                assert [f.getNode(n).real() for n in ('bits', 'distance', 'size')] == \
                [64, 12, 10000]\n\
                import tags\ncodes = f.getNode('codes')\n\
                assert [int(codes.at(i).string(), 16) for i in range(codes.size())] == \
                list(tags.CODES)\n";
    let python = std::env::var_os("DELTILLE_PYTHON").expect("it was set when this was built");
    assert_runs(exports().path(), python, &["-c", text]);
}

#[test]
fn tables_of_other_programs_become_families() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let codes = Family::shipped("aprilTag16h5").unwrap();
    let list = |suffix: &str| -> String {
        codes.codes().iter().map(|code| format!("  0x{code:04x}{suffix},\n")).collect()
    };
    let c = format!("/* 16h5 */\nstatic const uint64_t t16h5[] = {{\n{}}};\n", list("ULL"));
    std::fs::write(at.join("mine.h"), c).unwrap();
    std::fs::write(at.join("mine.py"), format!("BITS = 16\ncodes = [\n{}]\n", list(""))).unwrap();
    std::fs::write(at.join("words.txt"), "231b\n2ea5\n346a\n").unwrap();
    std::fs::write(at.join("prose.txt"), "no table\n").unwrap();
    // Only the all-white and the all-black tag are unchanged by every rotation.
    std::fs::write(at.join("blank.txt"), "231b\n0000\n").unwrap();
    let mut page = Page::default();
    for args in [
        "mine.h --shape square --bits 16 --name t16h5",
        "mine.py --shape square",
        "words.txt --shape triangle --bits 16 --distance 4",
    ] {
        assert!(page.run(at, &format!("deltag import {args}")).status.success(), "{args}");
    }
    let read = std::fs::read_to_string(at.join("t16h5.json")).unwrap();
    assert_eq!(Family::from_json(&read).unwrap().fingerprint(), codes.fingerprint());
    page.run(at, "deltag verify-family t16h5.json mine.json words.json aprilTag36h11");
    let board = "deltille checkerboard --rows 4 --cols 5 --tags t16h5.json --png --name own";
    assert!(page.run(at, board).status.success());
    assert!(page.run(at, "deltille detect own.png --target own.json -o found").status.success());

    page.title("Not a table");
    for args in [
        "prose.txt",
        "mine.h --shape square",
        "mine.h --bits 16",
        "mine.h --shape square --bits 20",
        "mine.h --shape square --bits 9",
        "mine.h --shape square --bits 16 --distance 7",
        "nowhere.h",
        "blank.txt --shape triangle --bits 16",
        "mine.json",
    ] {
        page.refused(at, &format!("deltag import {args}"));
    }
    page.is("deltag-import");
}

/// Detection relies on the distance that a family claims.
#[test]
fn a_family_with_false_claims_is_rejected_for_detection() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let known = Family::shipped("delTag16h5").unwrap();
    let (dimension, rules) = (known.dimension(), known.rules().clone());
    let source = Construction::Imported { source: "nowhere".to_owned() };
    let codes = known.codes().to_vec();
    let lies = Family::new("lies", dimension, 7, codes, rules, source).unwrap();
    std::fs::write(at.join("lies.json"), lies.to_json()).unwrap();
    let mut page = Page::default();
    page.run(at, "deltag verify-family lies.json");
    page.run(
        at,
        "deltille board --rows 5 --cols 6 --family lies.json --png --name own --no-verify",
    );
    page.refused(at, "deltille detect own.png --target own.json --family lies.json -o found");
    page.is("family-rejected");
}
