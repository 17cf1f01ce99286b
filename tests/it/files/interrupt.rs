//! Ctrl-C during a search: the kept results, and resuming from them.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::folder::names;
use crate::common::page::Page;

/// Longer than any of these searches takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(300);

fn start(arguments: &[&str], folder: &Path) -> Child {
    Command::new(env!("CARGO_BIN_EXE_deltag"))
        .arg("gen-family")
        .args(arguments)
        .arg("-o")
        .arg(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn interrupt(child: Child) -> Output {
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    child.wait_with_output().unwrap()
}

fn wait_for(what: &str, mut there: impl FnMut() -> bool) {
    let start = Instant::now();
    while !there() {
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn verified(file: &Path) -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_deltag"));
    command.arg("verify-family").arg(file).output().unwrap().status.success()
}

/// Interrupts a search at every checkpoint, repeatedly, until it ends on its own.
fn in_pieces(arguments: &[&str], folder: &Path, mut after: impl FnMut(&Output)) -> u32 {
    let checkpoint = folder.join("checkpoint");
    let resume = checkpoint.to_str().unwrap();
    for piece in 0.. {
        // The first checkpoint is written before the search begins.
        let read = || std::fs::read(&checkpoint).ok();
        let before = read();
        let mut child = start(&[arguments, &["--resume", resume]].concat(), folder);
        let mut ended = false;
        wait_for("a checkpoint, or the end", || {
            ended = child.try_wait().unwrap().is_some();
            ended || (read().is_some() && read() != before)
        });
        let output = if ended { child.wait_with_output().unwrap() } else { interrupt(child) };
        match output.status.code() {
            Some(0) => {
                assert!(!checkpoint.exists());
                return piece;
            }
            Some(130) => {
                let stderr = text(&output.stderr);
                // A slow machine reports its progress first.
                let last = stderr.lines().last().unwrap();
                assert!(last.starts_with("interrupted: ") && last.contains(resume), "{stderr}");
                after(&output);
            }
            other => panic!("{other:?}: {}", text(&output.stderr)),
        }
    }
    unreachable!("a search ends")
}

#[test]
fn an_interrupted_lexicode_is_the_published_one() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = ["d25h7", "--method", "lexicode", "--name", "delTag25h7"];
    let pieces = in_pieces(&arguments, folder.path(), |_| {
        assert_eq!(names(folder.path()), ["checkpoint"]);
    });
    assert!(pieces > 0, "it was never interrupted");
    assert_eq!(names(folder.path()), ["delTag25h7.json"]);
    let shipped = Path::new(crate::common::REPOSITORY).join("families/delTag25h7.json");
    let made = std::fs::read(folder.path().join("delTag25h7.json")).unwrap();
    assert!(made == std::fs::read(shipped).unwrap());
}

#[test]
fn an_interrupted_search_finds_the_same_codes() {
    let (folder, whole) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let arguments = ["d16h5", "--method", "search", "--rounds", "5", "--seed", "7"];
    let made = folder.path().join("d16h5.json");
    let pieces = in_pieces(&arguments, folder.path(), |_| {
        assert!(!made.exists() || verified(&made));
    });
    assert!(pieces > 0, "it was never interrupted");
    let output = start(&arguments, whole.path()).wait_with_output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let at_once = std::fs::read(whole.path().join("d16h5.json")).unwrap();
    assert!(std::fs::read(&made).unwrap() == at_once);
    assert_eq!(names(folder.path()), ["d16h5.json"]);
    assert!(verified(&made));
}

#[test]
fn without_a_checkpoint_an_interrupted_lexicode_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // Minutes of work, so it is not finished at the signal.
    let mut child = start(&["d36h9", "--method", "lexicode"], folder.path());
    wait_for("the signal handler", || handles_interrupts(&mut child));
    let output = interrupt(child);
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let mut page = Page::default();
    page.said("deltag gen-family d36h9 --method lexicode, interrupted", &text(&output.stderr));
    page.is("deltag-gen-family-interrupted");
    assert_eq!(names(folder.path()), [""; 0]);
}

/// The best family so far is kept, at least the shipped one; a search from scratch without a family keeps nothing.
#[test]
fn an_interrupted_best_search_keeps_the_best_so_far() {
    for (from, pause_ms, must_find) in [
        (None, 3000, true),
        (Some("--from-scratch"), 0, false),
        (Some("--from-scratch"), 4000, true),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let arguments: Vec<&str> = ["d16h5", "--time", "100000"].into_iter().chain(from).collect();
        let mut child = start(&arguments, folder.path());
        wait_for("the signal handler", || handles_interrupts(&mut child));
        std::thread::sleep(Duration::from_millis(pause_ms));
        let output = interrupt(child);
        let (code, stderr) = (output.status.code(), text(&output.stderr));
        let said: Vec<&str> =
            stderr.lines().filter(|line| !line.starts_with("starting from")).collect();
        assert!(said.len() == 1 && said[0].starts_with("interrupted: "), "{stderr}");
        assert_eq!(stderr.lines().count(), 1 + usize::from(from.is_none()), "{stderr}");
        if code == Some(0) {
            assert_eq!(names(folder.path()), ["d16h5.json"]);
            assert!(verified(&folder.path().join("d16h5.json")));
        } else {
            assert_eq!((code, must_find), (Some(130), false), "{stderr}");
            assert_eq!(names(folder.path()), [""; 0]);
        }
    }
}

/// The pages are complete, but not all were compared.
#[test]
fn an_interrupted_sheet_ends_between_pages() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_deltag"));
    command.args(["sheet", "d25h7", "-o"]).arg(folder.path());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for("the signal handler", || handles_interrupts(&mut child));
    wait_for("the file", || names(folder.path()) == ["d25h7-sheet.pdf"]);
    let output = interrupt(child);
    assert_eq!(output.status.code(), Some(130));
    assert!(text(&output.stderr).starts_with("interrupted: "), "{}", text(&output.stderr));
    assert_eq!(names(folder.path()), ["d25h7-sheet.pdf"]);
}

/// Whether a process has installed its handler of Ctrl-C.
fn handles_interrupts(child: &mut Child) -> bool {
    assert!(child.try_wait().unwrap().is_none(), "it has ended");
    let Ok(status) = std::fs::read_to_string(format!("/proc/{}/status", child.id())) else {
        // This file exists only on Linux; elsewhere, wait.
        std::thread::sleep(Duration::from_secs(2));
        return true;
    };
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let caught = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    caught.is_some_and(|mask| mask >> 1 & 1 == 1)
}
