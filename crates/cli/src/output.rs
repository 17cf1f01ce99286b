//! Printed output, and the path and safe writing of output files.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use deltille::export::kind::Kind;
use deltille::export::{atomic, staging};
use deltille::limits::{Limits, ReadError};
use deltille_core::words::shown;

/// Returns the file that `-o` means: the path itself if it ends in the extension, otherwise `<stem>.<extension>` in
/// that folder. A path with another extension is not a folder, unless it exists as one.
pub fn file(output: &Path, stem: &str, extension: &str) -> anyhow::Result<PathBuf> {
    let shown = output.display();
    check_is_path(output).context("-o")?;
    if output.is_dir() {
        return Ok(output.join(format!("{stem}.{extension}")));
    }
    if output.exists() && output.extension().is_none() {
        bail!("-o {shown} is not a folder; expected a folder, or a file that ends in .{extension}");
    }
    match output.extension() {
        Some(found) if found == extension => Ok(output.to_owned()),
        Some(_) if !output.as_os_str().to_string_lossy().ends_with('/') => {
            let instead = output.with_extension(extension);
            bail!(
                "-o {shown}: the output is a .{extension} file; use {}, or a folder",
                instead.display()
            )
        }
        _ => Ok(output.join(format!("{stem}.{extension}"))),
    }
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
        tempfile::tempfile_in(folder).with_context(context)?;
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

/// Prints a [`line`]; returns the error from the calling function.
macro_rules! say {
    ($($argument:tt)*) => {
        $crate::output::print(&$crate::output::line(&format!($($argument)*)))?
    };
}
pub(crate) use say;

/// Prints a [`line`] on standard error.
macro_rules! log {
    ($($argument:tt)*) => {{
        // Standard error may be closed.
        let _ = ::std::io::Write::write_all(
            &mut ::std::io::stderr(),
            $crate::output::line(&format!($($argument)*)).as_bytes(),
        );
    }};
}
pub(crate) use log;

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

/// Extensions of files that these programs write, and of photographs. A new folder with such a name was probably
/// meant to be a file.
const OF_FILES: &str = "3mf cameramodel csv dsc dxf glb gltf html jpeg jpg json mtl ndjson npy obj orpc parquet pdf ply \
                        png sdf stl svg tif tiff toml txt urdf usda xml yaml yml";

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
    let extension = folder.extension().unwrap_or_default();
    let is_of_file = OF_FILES.split(' ').any(|known| extension.eq_ignore_ascii_case(known));
    ensure!(
        folder.exists() || !is_of_file,
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
    fn zero_has_no_sign() {
        for (value, text) in
            [(-0.0, "0.00"), (-0.004, "0.00"), (-0.006, "-0.01"), (-10.0, "-10.00")]
        {
            assert_eq!(fixed(value, 2), text);
        }
    }
}
