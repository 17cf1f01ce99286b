//! Printed output, and the path and safe writing of output files.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};

use crate::terminal;
use deltille::Name;
use deltille::export::kind::Kind;
use deltille::export::{atomic, staging};
use deltille::limits::{Limits, ReadError};
use deltille_core::words::shown;

/// What `-o` means: a folder, or a file in it.
#[derive(Debug, PartialEq)]
pub struct Place {
    /// The folder.
    pub folder: PathBuf,
    /// The file, if one is named.
    pub file: Option<NamedFile>,
}

/// Name of an output file, without its folder.
#[derive(Debug, PartialEq)]
pub struct NamedFile {
    /// The name without its extension.
    pub stem: String,
    /// The extension, in lower case.
    pub ending: String,
}

/// Returns what `-o` means: a file if it ends in one of these extensions of the command, otherwise a folder. A new path with
/// the extension of another kind of file is rejected.
pub fn place(output: &Path, endings: &[&str]) -> anyhow::Result<Place> {
    check_is_path(output).context("-o")?;
    let is_folder = output.is_dir() || output.as_os_str().to_string_lossy().ends_with('/');
    let ending = output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let known: Vec<String> = endings.iter().map(|ending| format!(".{ending}")).collect();
    let (shown, without) = (output.display(), output.with_extension(""));
    if !known.is_empty() && !output.is_dir() && output.exists() && ending.is_empty() {
        bail!(
            "-o {shown} is not a folder; expected a folder, or a file that ends in {}",
            any_of(&known)
        );
    }
    if is_folder || ending.is_empty() || !is_of_file(&ending, endings) {
        check_folder(output).context("-o")?;
        return Ok(Place { folder: output.to_owned(), file: None });
    }
    ensure!(
        !known.is_empty(),
        "-o: {shown} looks like a file, but a folder is needed, such as {}",
        without.display()
    );
    ensure!(
        endings.contains(&ending.as_str()),
        "-o: {shown} must end in {}, or be a folder",
        any_of(&known)
    );
    let stem = output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let file = Some(NamedFile { stem, ending });
    Ok(Place { folder: folder_of(output).to_owned(), file })
}

/// Sets the stem of the output files to that of the file given by `-o`, and returns its extension (empty without one). Rejects a
/// `--name` that differs.
pub fn named_by(name: &mut Option<String>, file: Option<NamedFile>) -> anyhow::Result<String> {
    let Some(NamedFile { stem, ending }) = file else { return Ok(String::new()) };
    Name::without_dots(&stem).map_err(|why| anyhow!("-o: {why}"))?;
    match name.replace(stem.clone()).filter(|name| *name != stem) {
        Some(name) => bail!(
            "--name: -o already names the files {stem}; remove --name {name}, or use a folder as -o"
        ),
        None => Ok(ending),
    }
}

/// Requests the format with this extension, if it is one of these.
pub fn request<const N: usize>(ending: &str, formats: [(&str, &mut bool); N]) {
    for (known, is_requested) in formats {
        *is_requested |= known == ending;
    }
}

/// Joins alternatives: `a, b or c`.
fn any_of(words: &[String]) -> String {
    match words {
        [before @ .., last] if !before.is_empty() => format!("{} or {last}", before.join(", ")),
        words => words.concat(),
    }
}

/// Returns the file that `-o` means, see [`place`]: in a folder, `<stem>.<extension>`.
pub fn file(output: &Path, stem: &str, extension: &str) -> anyhow::Result<PathBuf> {
    file_of(output, stem, &[extension])
}

/// Returns the file that `-o` means, which has one of these extensions, in lower case: the first of them in a folder.
pub fn file_of(output: &Path, stem: &str, extensions: &[&str]) -> anyhow::Result<PathBuf> {
    let Place { folder, file } = place(output, extensions)?;
    Ok(match file {
        Some(file) => output.with_extension(file.ending),
        None => folder.join(format!("{stem}.{}", extensions[0])),
    })
}

/// Returns the path of the page of `--report`: a file that ends in .html, or a folder. Rejects unusable paths before the work
/// starts.
pub fn page(page: &Path, stem: &str, overwrite: Overwrite) -> anyhow::Result<PathBuf> {
    let is_page = page.is_dir() || page.extension().is_some_and(|end| end == "html");
    ensure!(is_page, "--report: {} must end in .html, or be a folder", page.display());
    let page = file(page, stem, "html")?;
    check_writable("--report", &page)?;
    overwrite.check(&page, &Kind::own_page()).context("--report")?;
    Ok(page)
}

/// Checks, before hours of work and without leaving a trace, whether a file can be written.
pub fn check_writable(option: &str, path: &Path) -> anyhow::Result<()> {
    let context = || format!("{option}: cannot write {}", path.display());
    ensure!(!path.is_dir(), "{}: it is a folder", context());
    let folders = path.ancestors().skip(1);
    let nearest = folders
        .map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
        .find(|folder| folder.exists());
    if let Some(folder) = nearest {
        ensure!(folder.is_dir(), "{}: {} is not a folder", context(), folder.display());
        let trial = tempfile::tempfile_in(folder);
        // The error of the system would show the temporary path.
        trial.map_err(|error| std::io::Error::from(error.kind())).with_context(context)?;
    }
    Ok(())
}

/// Exit code if the reader of standard output has closed it: the code of a program terminated by
/// SIGPIPE.
const UNREAD: i32 = 141;

/// Prints a result. If the reader has closed standard output, as `head` does after enough lines,
/// ends the process silently and removes partially written files.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
            let _nothing_more = atomic::abandon();
            std::process::exit(UNREAD)
        }
        result => result.context("cannot write to standard output"),
    }
}

/// Returns a line as a terminal shows it.
pub(crate) fn line(text: &str) -> String {
    format!("{}\n", shown(text))
}

/// Prints a line of the result.
pub(crate) fn print_line(text: &str) -> anyhow::Result<()> {
    print(&terminal::coloured(&line(text), &std::io::stdout()))
}

/// Prints a [`line`] of the result; returns the error from the calling function.
macro_rules! say {
    ($($argument:tt)*) => {
        $crate::output::print_line(&format!($($argument)*))?
    };
}
pub(crate) use say;

/// Prints a [`line`] about work that succeeded, such as a written file, unless `--quiet` is given.
macro_rules! report {
    ($($argument:tt)*) => {
        if !$crate::terminal::is_quiet() {
            $crate::output::say!($($argument)*)
        }
    };
}
pub(crate) use report;

/// Prints a line on standard error; with `--quiet`, no notes.
pub(crate) fn log_line(text: &str) {
    let is_note = ["note:", "ink:"].iter().any(|start| text.starts_with(start));
    if !(is_note && terminal::is_quiet()) {
        // Standard error may be closed.
        let mut stderr = std::io::stderr();
        let _ = stderr.write_all(terminal::coloured(&line(text), &std::io::stderr()).as_bytes());
    }
}

/// Prints a [`line`] on standard error.
macro_rules! log {
    ($($argument:tt)*) => {
        $crate::output::log_line(&format!($($argument)*))
    };
}
pub(crate) use log;

/// Prints a [`line`] on standard error with `--verbose`.
macro_rules! detail {
    ($($argument:tt)*) => {
        if $crate::terminal::is_verbose() {
            $crate::output::log!($($argument)*);
        }
    };
}
pub(crate) use detail;

/// Returns the line about a written file.
pub(crate) fn wrote(path: &Path) -> String {
    format!("wrote {}", path.strip_prefix(".").unwrap_or(path).display())
}

/// Output format of a command.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct ResultFormat {
    /// Print the result as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

impl ResultFormat {
    /// Whether the result is printed as JSON.
    pub fn is_json(self) -> bool {
        self.json
    }
}

/// Prints a result as JSON.
pub fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// Treatment of existing files. Files of the same kind are always replaced.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct Overwrite {
    /// Overwrite existing files, including those that other programs wrote
    #[arg(long)]
    force: bool,
}

impl Overwrite {
    /// Whether every file is replaced.
    pub fn is_forced(self) -> bool {
        self.force
    }

    /// Refuses to replace a file of another kind: it only shares the name, and may be the only copy of a mesh, a
    /// target or a calibration.
    pub fn check(self, path: &Path, kind: &Kind) -> anyhow::Result<()> {
        if self.force {
            return Ok(());
        }
        ensure!(
            !path.is_symlink(),
            "cannot write {}: it is a symbolic link; use its destination, or --force to replace the link",
            path.display()
        );
        if !path.is_file() {
            return Ok(());
        }
        let (there, is_empty) = match Limits::default().read(path) {
            Err(ReadError::Exceeded { .. }) => {
                let there = Kind::of_large(path).with_context(|| cannot_read(path))?;
                let there = there.with_context(|| {
                    format!(
                        "{} is too large to inspect, and would be lost: write to another path, or use --force to \
                         replace it",
                        path.display()
                    )
                })?;
                (there, false)
            }
            content => {
                let content = content.with_context(|| cannot_read(path))?;
                (Kind::of(&content), content.is_empty())
            }
        };
        ensure!(
            is_empty || there == *kind,
            "{} contains {there}, which would be lost: write to another path, or use --force to \
             replace it",
            path.display()
        );
        Ok(())
    }
}

fn cannot_read(path: &Path) -> String {
    format!("cannot read {}, which would be replaced", path.display())
}

/// Finishes or removes files that killed runs left unfinished in a folder.
pub fn settle(folder: &Path) -> anyhow::Result<()> {
    Ok(staging::settle(folder)?)
}

/// Writes a file completely or not at all, and creates its folder if needed. A file with the same content is left
/// untouched.
pub fn write(path: &Path, content: &[u8], overwrite: Overwrite) -> anyhow::Result<()> {
    overwrite.check(path, &Kind::of(content))?;
    settle(folder_of(path))?;
    if path.is_file()
        && !path.is_symlink()
        && std::fs::read(path).is_ok_and(|there| there == content)
    {
        return Ok(());
    }
    make_folder_of(path)?;
    Ok(atomic::write(path, |file| file.write_all(content))?)
}

/// Returns the folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Extensions of files that these programs write, and of images and videos. A new folder with such a name was probably
/// meant to be a file.
const OF_FILES: &str = "3mf ai avi bmp c cameramodel csv doc docx dsc dwg dxf eps gif glb gltf gz h heic html iges igs jpeg \
                        jpg json md mkv mov mp4 mtl ndjson npy npz obj odt orpc parquet pdf ply png ps psd py rs sdf step stl \
                        stp svg tif tiff toml txt urdf usd usda usdz webp xlsx xml yaml yml zip";

/// Whether an extension is one of these, or that of another kind of file.
fn is_of_file(ending: &str, endings: &[&str]) -> bool {
    endings.contains(&ending) || OF_FILES.split(' ').any(|known| known == ending)
}

/// Rejects `-`, which other programs take for standard output.
fn check_is_path(output: &Path) -> anyhow::Result<()> {
    let problem = "`-` is not a file: results are not written to standard output; name a file, or a folder such as ./-";
    ensure!(output.as_os_str() != "-", problem);
    Ok(())
}

/// Rejects a folder if a file exists at its path, or if it is new and has the name of a file.
pub fn check_folder(folder: &Path) -> anyhow::Result<()> {
    check_is_path(folder)?;
    if let Some(file) = folder.ancestors().find(|part| part.exists() && !part.is_dir()) {
        bail!("{} is a file, but a folder is needed", file.display());
    }
    let extension = folder.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    ensure!(
        folder.exists()
            || folder.as_os_str().to_string_lossy().ends_with('/')
            || !is_of_file(&extension, &[]),
        "{} looks like a file, but a folder is needed, such as {}",
        folder.display(),
        folder.with_extension("").display()
    );
    Ok(())
}

/// Creates the folder of a file if needed.
pub fn make_folder_of(path: &Path) -> anyhow::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        check_folder(folder)?;
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the folder {}", folder.display()))?;
    }
    Ok(())
}

/// Formats a number with a fixed number of decimals, and without a sign if it rounds to zero.
pub(crate) fn fixed(value: f64, places: usize) -> String {
    let text = format!("{value:.places$}");
    match text.strip_prefix('-') {
        Some(zeros) if !zeros.contains(|c: char| matches!(c, '1'..='9')) => zeros.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_is_a_file_only_with_an_ending_of_the_command() {
        let endings = ["pdf", "svg"];
        let of =
            |text: &str| place(Path::new(text), &endings).map_err(|error| format!("{error:#}"));
        let folder = |text: &str| Ok(Place { folder: text.into(), file: None });
        for text in ["new", "new/board", "board-1.2", "out.pdf/", "."] {
            assert_eq!(of(text), folder(text), "{text}");
        }
        let file = Some(NamedFile { stem: "desk".to_owned(), ending: "pdf".to_owned() });
        assert_eq!(of("new/desk.PDF"), Ok(Place { folder: "new".into(), file }));
        let error = "-o: desk.stl must end in .pdf or .svg, or be a folder";
        assert_eq!(of("desk.stl"), Err(error.to_owned()));
        assert!(place(Path::new("desk.json"), &[]).is_err());
        assert!(of("-").is_err());
    }

    #[test]
    fn zero_has_no_sign() {
        for (value, text) in
            [(-0.0, "0.00"), (-0.004, "0.00"), (-0.006, "-0.01"), (-10.0, "-10.00")]
        {
            assert_eq!(fixed(value, 2), text);
        }
    }
}
