//! Output of commands, verbatim: one page per command in `tests/snapshots`, as a user would read it.
//! `INSTA_UPDATE=always cargo test --release --test it` updates all of them.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};
use std::time::SystemTime;

/// Commands, each with its output on both streams and its exit code.
#[derive(Default)]
pub struct Page(String);

impl Page {
    /// Adds a title for the commands that follow.
    pub fn title(&mut self, title: &str) {
        self.0 += &format!("\n# {title}\n");
    }

    /// Runs a command in a folder. Spaces separate its words; `''` is an empty word.
    #[track_caller]
    pub fn run(&mut self, folder: &Path, command: &str) -> Output {
        self.write(folder, command, |output| vec![&output.stdout, &output.stderr])
    }

    /// The same without standard output.
    #[track_caller]
    pub fn warned(&mut self, folder: &Path, command: &str) -> Output {
        self.write(folder, command, |output| vec![&output.stderr])
    }

    #[track_caller]
    fn write(
        &mut self,
        folder: &Path,
        command: &str,
        shown: fn(&Output) -> Vec<&Vec<u8>>,
    ) -> Output {
        let mut words = command.split_whitespace().map(|word| word.replace("''", ""));
        let program = match &*words.next().unwrap() {
            "deltag" => env!("CARGO_BIN_EXE_deltag"),
            "deltille" => env!("CARGO_BIN_EXE_deltille"),
            other => panic!("{other}"),
        };
        let mut process = Command::new(program);
        process
            .current_dir(folder)
            .args(words)
            .env_remove("COLUMNS")
            .stdin(std::process::Stdio::null());
        let output = process.output().unwrap();
        self.0 += &format!("\n$ {}\n", command.trim_end());
        for printed in shown(&output) {
            let printed = std::str::from_utf8(printed).unwrap();
            assert!(!printed.contains('\u{1b}'), "{command}: {printed}");
            self.line(printed);
        }
        if output.status.code() != Some(0) {
            self.0 += &format!("[{}]\n", output.status.code().expect("killed"));
        }
        output
    }

    /// Adds one or more lines.
    pub fn line(&mut self, said: &str) {
        said.lines().for_each(|line| self.0 += &(same_everywhere(line) + "\n"));
    }

    /// Adds output that does not come from a command run here.
    pub fn said(&mut self, what: &str, said: &str) {
        self.title(what);
        self.line(said);
    }

    /// Runs a command that must fail: with one line, exit code 2, and no change in the folder.
    #[track_caller]
    pub fn refused(&mut self, folder: &Path, command: &str) {
        let before = files(folder);
        let Output { status, stdout, stderr } = self.run(folder, command);
        let said = String::from_utf8_lossy(&stderr);
        assert_eq!((status.code(), &*stdout), (Some(2), &b""[..]), "{command}: {said}");
        assert!(said.starts_with("error: ") && said.lines().count() == 1, "{command}: {said}");
        assert!(files(folder) == before, "{command}: files were changed");
    }

    /// Compares the page with the one in `tests/snapshots`.
    #[track_caller]
    pub fn is(self, name: &str) {
        let mut settings = insta::Settings::new();
        settings.set_snapshot_path(Path::new(super::REPOSITORY).join("tests/snapshots"));
        settings.set_prepend_module_to_snapshot(false);
        settings.set_omit_expression(true);
        settings.bind(|| insta::assert_snapshot!(name, self.0.trim_start()));
    }
}

/// Returns a line without system-dependent parts. Figures whose last digits depend on the system are rounded, or
/// compared with the others.
fn same_everywhere(line: &str) -> String {
    let line =
        if cfg!(windows) { line.replace('\\', "/").replace(".exe", "") } else { line.to_owned() };
    if line.contains(": verified, ") {
        let mut parts = line.split(" within ");
        let first = parts.next().unwrap().to_owned();
        return parts.fold(first, |all, part| {
            let (figure, after) = part.split_once(" mm").unwrap_or_else(|| panic!("{line}"));
            all + " within " + &within(figure.parse().unwrap()) + " mm" + after
        });
    }
    if let Some((before, after)) = line.split_once("the lens model is valid up to ") {
        // Poles of weakly determined parameters.
        let figures = after.split(" px").take(3).map(|to| to.rsplit(' ').next().unwrap());
        let figures: Vec<f64> = figures.map(|figure| figure.parse().unwrap()).collect();
        let [steady, outermost, farthest] = figures[..] else { panic!("{line}") };
        assert!(0.0 < steady && steady < farthest, "{line}");
        assert_eq!(steady < outermost, after.contains("avoid pixels near that radius"), "{line}");
        let after = after.trim_start_matches(|c: char| c.is_ascii_digit());
        return format!("{before}the lens model is valid up to …{after}");
    }
    let Some(end) = line.find(" (os error ") else { return line };
    let begin = line[..end].rfind(": ").map_or(0, |colon| colon + 2);
    line[..begin].to_owned() + "[what the system says]"
}

/// Returns the accuracy of a verification. Positions in lists, drawings and bodies are as accurate as they are written.
/// Corners in images are accurate to 0.01 mm, or to the limit of a coarse texture.
fn within(mm: f64) -> String {
    if mm < 0.0004 { "0.0004".to_owned() } else { format!("{:.2}", (100.0 * mm).ceil() / 100.0) }
}

/// Returns all files below a folder with their sizes and times.
fn files(folder: &Path) -> BTreeMap<std::path::PathBuf, (u64, Option<SystemTime>)> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.metadata() {
            Ok(about) if about.is_dir() => all.extend(files(&path)),
            Ok(about) => drop(all.insert(path, (about.len(), about.modified().ok()))),
            Err(_) => {}
        }
    }
    all
}
