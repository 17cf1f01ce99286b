//! Existing files, runs that are killed or interrupted, and concurrent runs in one folder.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::command::deltille;
use crate::common::folder::names;
use crate::common::page::Page;
use deltille::camera::Camera;
use deltille::export::staging;

const DELTILLE: &str = env!("CARGO_BIN_EXE_deltille");
const DELTAG: &str = env!("CARGO_BIN_EXE_deltag");

/// All files of a folder and its subfolders, with their content.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for name in names(folder) {
        let path = folder.join(&name);
        if path.is_dir() {
            all.extend(contents(&path).into_iter().map(|(n, c)| (format!("{name}/{n}"), c)));
        } else {
            all.insert(name, std::fs::read(path).unwrap());
        }
    }
    all
}

fn run(program: &str, folder: &Path, args: &str) -> (Option<i32>, String) {
    let mut command = Command::new(program);
    let output = command.current_dir(folder).args(args.split_whitespace()).output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Each command reports in one line that a new folder has the name of a file or a device; nothing is written.
#[test]
fn a_new_folder_with_the_name_of_a_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("c.yaml"), Camera::pinhole(640, 480, 1.0).to_yaml()).unwrap();
    deltille(at, "board --rows 4 --cols 4 --name b").success();
    let before = names(at);
    let refused = |args: &str, words: &str| {
        let said = deltille(at, args).code(2);
        let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
        assert!(said.contains(words) && said.lines().count() == 1, "{args}: {said}");
    };
    for args in [
        "board --rows 4 --cols 5",
        "detect --target b.json b.json",
        "undistort --camera c.yaml",
        "rig --camera a=a --camera b=b --target b.json",
        "calibrate none --target b.json",
    ] {
        refused(&format!("{args} -o out.stp"), "-o: out.stp must end in .");
    }
    refused(
        "rectify r.json --pair a,b -o out.yaml",
        "-o: out.yaml looks like a file, but a folder is needed",
    );
    refused("detect --target b.json b.json b.json -o out.csv", "must be a folder, because several");
    refused("board --rows 4 --cols 5 --name c -o d.pdf", "--name: -o already names the files d");
    refused("undistort --camera c.yaml -o /dev/full", "-o /dev/full");
    let pose = "pose none.png --target b.json --camera c.yaml -o /dev/full";
    refused(
        pose,
        "-o /dev/full is not a folder; expected a folder, or a file that ends in .ndjson",
    );
    assert_eq!(names(at), before);
    // An existing folder is accepted.
    std::fs::create_dir(at.join("out.json")).unwrap();
    deltille(at, "board --rows 4 --cols 5 -o out.json --no-verify").success();
}

/// The ending of `-o` selects the format, its stem the name; the folder stands for the description in it.
#[test]
fn an_output_may_be_a_file_and_a_folder_may_stand_for_its_description() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 5 --cols 6 -o new/desk.svg").success();
    assert_eq!(names(&at.join("new")), ["desk.json", "desk.svg"]);
    deltille(at, "icosahedron -o solid/ball.3mf --no-verify").success();
    assert_eq!(names(&at.join("solid")), ["ball.3mf", "ball.json"]);
    deltille(at, "verify new").success();
    std::fs::write(at.join("c.yaml"), Camera::pinhole(640, 480, 1.0).to_yaml()).unwrap();
    deltille(at, "render new --camera c.yaml --eye 0,0,300 --look-at 0,0,0 -o view.png").success();
    deltille(at, "detect view.png --target new -o corners.csv --overlay").success();
    deltille(at, "undistort view.png --camera c.yaml -o straight/view.png").success();
    assert_eq!(
        names(&at.join("straight")),
        [
            "c-undistorted-opencv.yaml",
            "c-undistorted-ros.yaml",
            "c-undistorted.json",
            "c-undistorted.yaml",
            "view.png"
        ]
    );
    assert!(at.join("corners.csv").is_file() && at.join("corners.overlay.jpg").is_file());
    deltille(at, "board --rows 5 --cols 6 --name other -o new --no-verify").success();
    let said = deltille(at, "verify new").code(2);
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(
        said.contains("several descriptions of targets in this folder (desk.json, other.json)"),
        "{said}"
    );
}

/// `--quiet` leaves errors and results, `--verbose` adds what is read.
#[test]
fn quiet_and_verbose_runs() {
    let folder = tempfile::tempdir().unwrap();
    let said = |args: &str| {
        let said = deltille(folder.path(), args);
        let output = said.get_output();
        [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text).into_owned())
    };
    assert_eq!(said("board --rows 4 --cols 5 -q"), ["", ""]);
    assert_eq!(said("verify board.json --quiet"), ["", ""]);
    assert!(!said("plan --size 640x480 --distance 30cm..1m -q")[0].is_empty());
    assert!(said("verify nothing.json -q")[1].starts_with("error: "));
    let [_, details] = said("verify board.json -v");
    assert!(
        details.contains("read board.json: 1 panel, 20 corners") && details.contains("finished in"),
        "{details}"
    );
}

/// Every command replaces its own files, and nothing else without `--force`.
#[test]
fn only_files_of_the_same_kind_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 4 --cols 4 --png --svg --dpi 200 --name t --no-verify").success();
    std::fs::write(at.join("seeds.csv"), "x,y\n20,20\n").unwrap();
    let camera = "width: 320\nheight: 240\nfocal_px: [400, 400]\ncentre_px: [159.5, 119.5]\n\
                  model: pinhole\ndistortion: []\n";
    std::fs::write(at.join("camera.yaml"), camera).unwrap();
    let commands = [
        (DELTILLE, "board --rows 4 --cols 4 --pdf --svg --png --dsc --dpi 200 --no-verify -o out"),
        (DELTILLE, "checkerboard --rows 4 --cols 4 --save-template out/t.toml -o out --no-verify"),
        (
            DELTILLE,
            "tetrahedron --tiles 6 --edge 60mm --family delTag16h5 --gltf --obj \
             --stl --skeleton --dxf --svg --dsc --no-verify -o out",
        ),
        (DELTILLE, "detect t.png --target t.json --format json,orpc,csv,parquet --overlay -o out"),
        (DELTILLE, "render t.json --camera camera.yaml --eye 10,10,300 -o out/view.png"),
        (DELTILLE, "refine --kind deltille --seeds seeds.csv t.png -o out/corners.csv"),
        (DELTILLE, "verify t.json t.svg --report out/verdict.json"),
        (DELTAG, "export delTag16h5 --format c -o out"),
        (DELTAG, "export delTag16h5 --format rust -o out"),
        (DELTAG, "export delTag16h5 --format python -o out"),
        (DELTAG, "export delTag16h5 --format txt -o out"),
        (DELTAG, "export delTag16h5 --format opencv -o out"),
        (DELTAG, "show delTag16h5 --svg --png --dpi 50 -o out"),
        (DELTAG, "sheet delTag16h5 --ids 0-3 --pdf --no-verify -o out"),
        (DELTAG, "gen-family d9h4 --work 1 --from-scratch -o out"),
    ];
    let foreign: [&[u8]; 3] =
        [b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", b"{\"mine\": 1}", b"\x89PNG\r\n\x1a\n"];
    for (program, args) in commands {
        let out = at.join("out");
        for _ in 0..2 {
            let (code, said) = run(program, at, args);
            assert_eq!(code, Some(0), "{args}: {said}");
        }
        for name in names(&out) {
            let own = std::fs::read(out.join(&name)).unwrap();
            for content in foreign {
                std::fs::write(out.join(&name), content).unwrap();
                let before = contents(at);
                let (code, said) = run(program, at, args);
                assert_eq!(code, Some(2), "{args} over {name}: {said}");
                assert!(said.contains(&name) && said.lines().count() == 1, "{args}: {said}");
                assert!(contents(at) == before, "{args} over {name}");
            }
            std::fs::write(out.join(&name), own).unwrap();
        }
        for name in names(&out) {
            std::fs::write(out.join(name), foreign[0]).unwrap();
        }
        let (code, said) = run(program, at, &format!("{args} --force"));
        assert_eq!(code, Some(0), "{args}: {said}");
        assert_eq!(run(program, at, args).0, Some(0), "{args}");
        std::fs::remove_dir_all(&out).unwrap();
    }
    std::fs::copy(at.join("t.png"), at.join("page.png")).unwrap();
    let mut page = Page::default();
    page.refused(at, "deltille render t.json --camera camera.yaml --eye 10,10,300 -o page.png");
    page.is("render");
}

#[test]
fn another_board_of_the_same_name_does_not_replace_the_first() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let time = |name: &str| at.join(name).metadata().unwrap().modified().unwrap();
    let mut page = Page::default();
    page.run(at, "deltille board --rows 4 --cols 4 --pdf --svg --png --dsc --no-verify");
    std::fs::write(at.join("board-2.png"), "not of a board").unwrap();
    let written = ["board.json", "board.pdf", "board.svg"].map(time);
    // The same again with fewer files: nothing is left over, and nothing is touched.
    page.run(at, "deltille board --rows 4 --cols 4 --pdf --no-verify");
    assert_eq!(["board.json", "board.pdf", "board.svg"].map(time), written);
    // The prints of the first need its description.
    page.run(at, "deltille board --rows 5 --cols 4 --pdf --no-verify");
    assert_eq!(["board.json", "board.pdf", "board.svg"].map(time), written);
    page.run(at, "deltille board --rows 5 --cols 4 --pdf --no-verify --force");
    page.is("board-again");
}

/// A link stays unchanged, or becomes a file with `--force`; its destination is never written.
#[cfg(unix)]
#[test]
fn nothing_is_written_through_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 4 --cols 4 --png --dpi 200 --name t --no-verify").success();
    std::fs::create_dir(at.join("out")).unwrap();
    let commands = [
        ("board --rows 5 --cols 6 --pdf -o out", "board.pdf"),
        ("detect t.png --target t.json --overlay -o out", "t.overlay.jpg"),
        ("refine --kind deltille --seeds seeds.csv t.png -o out/corners.csv", "corners.csv"),
        ("verify t.json t.png --report out/verdict.json", "verdict.json"),
        ("board --rows 5 --cols 6 --pdf --save-template out/t.toml -o out", "t.toml"),
    ];
    std::fs::write(at.join("seeds.csv"), "x,y\n20,20\n").unwrap();
    let mut page = Page::default();
    for (args, name) in commands {
        let (link, outside) = (at.join("out").join(name), at.join("outside"));
        std::fs::write(&outside, "").unwrap();
        std::os::unix::fs::symlink("../outside", &link).unwrap();
        page.refused(at, &format!("deltille {args}"));
        assert!(link.is_symlink());
        deltille(at, &format!("{args} --force")).success();
        assert!(!link.is_symlink() && link.is_file(), "{args}");
        assert_eq!(std::fs::read(&outside).unwrap(), b"", "{args}");
        std::fs::remove_dir_all(at.join("out")).unwrap();
        std::fs::create_dir(at.join("out")).unwrap();
    }
    page.is("links");
}

/// All results of an image are written, or none; the count of failures is that of the missing images.
#[test]
fn results_of_an_image_appear_together() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 4 --cols 4 --png --dpi 200 --name a --no-verify").success();
    std::fs::copy(at.join("a.png"), at.join("b.png")).unwrap();
    // The second file cannot be written.
    std::fs::create_dir_all(at.join("out/b.overlay.jpg")).unwrap();
    let (code, said) =
        run(DELTILLE, at, "detect a.png b.png --target a.json --overlay --ink none -o out");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("1 of 2 images failed"), "{said}");
    assert_eq!(names(&at.join("out")), ["a.json", "a.overlay.jpg", "b.overlay.jpg"]);
}

/// Quotes from a file are short.
#[test]
fn errors_quote_little_of_a_hostile_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let long = "\u{1b}[31mx".repeat(1000);
    let escaped = long.replace('\u{1b}', "\\u001b");
    let files = [
        ("key.toml", format!("\"{escaped}\" = 1\n")),
        ("value.toml", format!("command = \"{escaped}\"\n")),
        ("number.toml", format!("rows = \"{escaped}\"\n")),
        ("key.json", format!("{{\"schema\": \"deltille/target/1\", \"{escaped}\": 1}}")),
        ("schema.json", format!("{{\"schema\": \"{escaped}\"}}")),
        ("name.json", format!("{{\"schema\": \"deltille/target/1\", \"name\": \"{escaped}\"}}")),
        ("model.yaml", format!("width: 9\nheight: 9\nmodel: \"{escaped}\"\n")),
        ("key.yaml", format!("\"{escaped}\": 9\n")),
        ("family.dsc", format!("0,4,4,20\n{long},2\n")),
        ("word.dsc", format!("{long}\n")),
    ];
    for (name, text) in files {
        std::fs::write(at.join(name), text).unwrap();
        let command = match name.rsplit_once('.').unwrap().1 {
            "toml" => format!("board --template {name}"),
            "yaml" => format!("undistort --camera {name}"),
            _ => format!("render {name} --camera none.yaml --eye 0,0,300"),
        };
        let (code, said) = run(DELTILLE, at, &command);
        assert_eq!(code, Some(2), "{name}: {said}");
        assert!(said.lines().count() == 1 && said.chars().count() < 700, "{name}: {said}");
    }
    for option in ["--rows", "--edge", "--paper", "--family", "--name"] {
        let (code, said) = run(DELTILLE, at, &format!("board {option} {}", "x".repeat(9000)));
        assert_eq!(code, Some(2), "{option}: {said}");
        assert!(said.lines().count() == 1 && said.chars().count() < 1500, "{option}: {said}");
    }
}

/// Two boards with different contents of all their files.
struct Boards {
    folder: tempfile::TempDir,
    sets: [BTreeMap<String, Vec<u8>>; 2],
}

const BOARDS: [&str; 2] = [
    "board --rows 4 --cols 4 --pdf --svg --png --dsc --dpi 200 --paper A5 --no-verify",
    "board --rows 5 --cols 4 --pdf --svg --png --dsc --dpi 200 --paper A5 --no-verify",
];

impl Boards {
    fn new() -> Self {
        let sets = BOARDS.map(|args| {
            let folder = tempfile::tempdir().unwrap();
            deltille(folder.path(), args).success();
            contents(folder.path())
        });
        Self { folder: tempfile::tempdir().unwrap(), sets }
    }

    fn start(&self, which: usize) -> Child {
        let mut command = Command::new(DELTILLE);
        command
            .args(BOARDS[which].split_whitespace())
            .arg("--force")
            .current_dir(self.folder.path());
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// Whether the folder contains one of the two and nothing else.
    fn is_whole(&self) -> bool {
        self.sets.contains(&contents(self.folder.path()))
    }
}

/// Runs are killed at random moments. Afterwards, a command that only reads the description finds the old or the new state of
/// the folder.
fn kill(trials: u64) {
    let boards = Boards::new();
    let at = boards.folder.path();
    let start = Instant::now();
    assert!(boards.start(0).wait().unwrap().success());
    let takes = start.elapsed();
    let (mut mixed, mut left, mut done) = (0, 0, 0);
    for trial in 0..trials {
        let mut child = boards.start((trial % 2) as usize);
        // A sequence that fills the interval evenly.
        let share = (trial as f64 * 0.618_034).fract();
        std::thread::sleep(takes.mul_f64(1.2 * share));
        done += u32::from(child.try_wait().unwrap().is_some());
        child.kill().unwrap();
        child.wait().unwrap();
        let mut there = contents(at);
        left += u32::from(there.keys().any(|name| name.starts_with(".deltille-")));
        there.retain(|name, _| !name.starts_with(".deltille-"));
        mixed += u32::from(!boards.sets.contains(&there));
        // It fails because there is no camera, after it has read the description.
        deltille(at, "render board.json --camera none.yaml --eye 0,0,300").code(2);
        assert!(boards.is_whole(), "trial {trial}: {:?}", contents(at).keys());
    }
    eprintln!(
        "{trials} runs of {takes:?} killed, {done} of them after their end; before the next run {left} \
         folders held temporary files, {mixed} a mixture; after it none"
    );
}

#[test]
fn killed_runs_leave_the_old_or_the_new_set() {
    kill(24);
}

#[test]
#[ignore = "many minutes"]
fn a_thousand_killed_runs_leave_the_old_or_the_new_set() {
    kill(1000);
}

/// The leftovers of `kill -9` between two renames are simulated, because they are too rare.
#[test]
fn complete_sets_are_finished_and_others_removed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let write = |name: &str, text: &str| {
        let path = at.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("a.json", "new");
    write("a.pdf", "old");
    write(".deltille-writing-aaaaaa/files/a.pdf", "new");
    write(".deltille-writing-aaaaaa/complete", "");
    write(".deltille-writing-bbbbbb/files/a.pdf", "newer, but not all there");
    write(".deltille-writing-cccccc", "half");
    // Killed while it was removed.
    write(".deltille-writing-dddddd/complete", "");
    write(".deltille-writing-of-mine/keep", "");
    let living = staging::Staging::new(at).unwrap();
    std::fs::write(living.files().join("b.txt"), "b").unwrap();
    // A running process keeps its files, as seen by another process.
    deltille(at, "render a.json --camera none.yaml --eye 0,0,300").code(2);
    assert_eq!(std::fs::read(at.join("a.pdf")).unwrap(), b"new");
    assert_eq!(names(at).len(), 4, "{:?}", names(at));
    living.commit().unwrap();
    assert_eq!(names(at), [".deltille-writing-of-mine", "a.json", "a.pdf", "b.txt"]);
}

#[test]
fn concurrent_runs_do_not_mix() {
    let boards = Boards::new();
    for _ in 0..6 {
        let mut children = [0, 1, 0, 1].map(|which| boards.start(which));
        assert!(children.iter_mut().all(|child| child.wait().unwrap().success()));
        assert!(boards.is_whole(), "{:?}", names(boards.folder.path()));
    }
}

/// Longer than the required half second, on a busy machine.
#[cfg(unix)]
const SOON: Duration = Duration::from_secs(5);

/// Whether these tests run under `nohup`, which child processes inherit.
#[cfg(unix)]
fn ignores_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_none_or(|mask| mask & 1 == 1)
}

/// Long work ends soon after any of the signals, and leaves nothing behind.
#[cfg(unix)]
#[test]
fn signals_end_work_soon_and_leave_nothing() {
    let sheet = tempfile::tempdir().unwrap();
    deltille(sheet.path(), "board --rows 30 --cols 30 --png --dpi 600 --paper A2 --no-verify")
        .success();
    let page = sheet.path().join("board");
    // One takes half a second.
    let pages = sheet.path().join("pages");
    std::fs::create_dir(&pages).unwrap();
    for i in 0..40 {
        std::fs::copy(page.with_extension("png"), pages.join(format!("{i:02}.png"))).unwrap();
    }
    let (page, pages) = (page.display(), pages.display());
    let cases = [
        ("board --rows 30 --cols 30 --png --dpi 1200 --paper A1".to_owned(), "INT", 130),
        ("icosahedron --texture-dpi 750 --gltf".to_owned(), "TERM", 143),
        (format!("verify {page}.json"), "HUP", 129),
        (format!("detect {pages} --target {page}.json -o ."), "TERM", 143),
        ("experiment corners --images 100000".to_owned(), "INT", 130),
    ];
    for (args, signal, code) in cases {
        if signal == "HUP" && ignores_hangup() {
            continue;
        }
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(DELTILLE);
        command.args(args.split_whitespace()).current_dir(folder.path());
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(700));
        assert!(child.try_wait().unwrap().is_none(), "{args}: it is done already");
        let id = child.id().to_string();
        assert!(
            Command::new("kill").args([&format!("-{signal}"), &id]).status().unwrap().success()
        );
        let start = Instant::now();
        let output = child.wait_with_output().unwrap();
        let took = start.elapsed();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{args}: {said}");
        assert!(said.starts_with("interrupted: ") && said.lines().count() == 1, "{args}: {said}");
        assert!(took < SOON, "{args}: {took:?}");
        // Detections of images that were finished in time stay.
        let is_done = |name: &String| args.starts_with("detect") && name.ends_with(".json");
        let left: Vec<String> = names(folder.path()).into_iter().filter(|n| !is_done(n)).collect();
        assert!(left.is_empty(), "{args}: {left:?}");
        eprintln!("{args}: {took:?} after {signal}");
    }
}

/// `detect --stream | head -1`
#[cfg(unix)]
#[test]
fn work_ends_if_nobody_reads_its_output() {
    const IMAGES: usize = 60;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    deltille(at, "board --rows 4 --cols 4 --png --dpi 200 --paper A5 --no-verify").success();
    std::fs::create_dir(at.join("images")).unwrap();
    for i in 0..IMAGES {
        std::fs::copy(at.join("board.png"), at.join(format!("images/{i:02}.png"))).unwrap();
    }
    let mut command = Command::new(DELTILLE);
    command.args("detect images --target board.json --stream -o out -j 1".split_whitespace());
    command.current_dir(at).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut first = String::new();
    BufReader::with_capacity(64, child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    assert!(deltille::export::detection::read(&first).is_ok(), "{first}");
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), &*output.stderr), (Some(141), &b""[..]));
    // One is read, one is written while the reader ends, one cannot be written.
    assert!(names(&at.join("out")).len() <= 5, "{:?}", names(&at.join("out")));
}
