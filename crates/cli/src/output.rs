//! Where a command's one file goes, and how it gets there whole.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use deltille::export::kind::Kind;
use deltille::export::{atomic, staging};
use deltille::limits::{Limits, ReadError};
use deltille_core::words::shown;

/// The file that `-o` means: itself when it ends in the extension, else `<stem>.<extension>` in
/// that folder. A path that ends in another extension is no folder, unless it is there as one.
pub fn file(output: &Path, stem: &str, extension: &str) -> anyhow::Result<PathBuf> {
    let shown = output.display();
    if output.is_dir() {
        return Ok(output.join(format!("{stem}.{extension}")));
    }
    if output.exists() && output.extension().is_none() {
        bail!("-o {shown}: is no folder; name a folder, or a file that ends in .{extension}");
    }
    match output.extension() {
        Some(found) if found == extension => Ok(output.to_owned()),
        Some(_) if !output.as_os_str().to_string_lossy().ends_with('/') => {
            let instead = output.with_extension(extension);
            bail!(
                "-o {shown}: the file written is a .{extension} file; name it {}, or name a folder",
                instead.display()
            )
        }
        _ => Ok(output.join(format!("{stem}.{extension}"))),
    }
}

/// Finds out before hours of work, and without a trace, whether a file can be written.
pub fn check_writable(option: &str, path: &Path) -> anyhow::Result<()> {
    let context = || format!("{option}: {} cannot be written", path.display());
    ensure!(!path.is_dir(), "{}: there is a folder of that name", context());
    let folders = path.ancestors().skip(1);
    let nearest = folders
        .map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
        .find(|folder| folder.exists());
    if let Some(folder) = nearest {
        ensure!(folder.is_dir(), "{}: {} is no folder", context(), folder.display());
        tempfile::tempfile_in(folder).with_context(context)?;
    }
    Ok(())
}

/// Exit code when the reader of the standard output has gone away, as of a program that SIGPIPE ends.
const UNREAD: i32 = 141;

/// Prints a result. Where its reader has gone away, as `head` does when it has seen enough, the
/// process ends without a word, and what it is writing is removed.
pub fn print(text: &str) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
            let _nothing_more = atomic::abandon();
            std::process::exit(UNREAD)
        }
        result => result.context("cannot write to the standard output"),
    }
}

/// A line as a terminal shows it.
pub(crate) fn line(text: &str) -> String {
    format!("{}\n", shown(text))
}

/// Prints a [`line`], and returns from the function where that fails.
macro_rules! say {
    ($($argument:tt)*) => {
        $crate::output::print(&$crate::output::line(&format!($($argument)*)))?
    };
}
pub(crate) use say;

/// Prints a [`line`] on standard error.
macro_rules! tell {
    ($($argument:tt)*) => {{
        // Nobody may be left to read it.
        let _ = ::std::io::Write::write_all(
            &mut ::std::io::stderr(),
            $crate::output::line(&format!($($argument)*)).as_bytes(),
        );
    }};
}
pub(crate) use tell;

/// How a command tells its result.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct Telling {
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    json: bool,
}

impl Telling {
    /// Whether it is printed as JSON.
    pub fn is_json(self) -> bool {
        self.json
    }
}

/// Prints a result as JSON.
pub fn print_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    print(&(serde_json::to_string_pretty(value)? + "\n"))
}

/// What becomes of files that are there already. One of the same kind is replaced.
#[derive(clap::Args, Clone, Copy, Default)]
pub struct Overwrite {
    /// Replace files of the same name also where they are of another kind, or something else wrote them
    #[arg(long)]
    force: bool,
}

impl Overwrite {
    /// Whether anything is replaced.
    pub fn is_forced(self) -> bool {
        self.force
    }

    /// Refuses to write a file of some kind over one of another kind: it only has the same name, and
    /// may be all that its owner has of a mesh, a target or a calibration.
    pub fn check(self, path: &Path, kind: &Kind) -> anyhow::Result<()> {
        if self.force {
            return Ok(());
        }
        ensure!(
            !path.is_symlink(),
            "cannot write {}: it is a symbolic link; name what it leads to, or --force replaces the link",
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
                        "{} is too large to be looked at, and would be lost: choose another place to write to; \
                         --force replaces it",
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
            "{} holds {there}, which would be lost: choose another place to write to; --force \
             replaces it",
            path.display()
        );
        Ok(())
    }
}

fn cannot_read(path: &Path) -> String {
    format!("cannot read {}, which would be replaced", path.display())
}

/// Finishes or removes what killed runs have left of files that were on their way to a folder.
pub fn settle(folder: &Path) -> anyhow::Result<()> {
    Ok(staging::settle(folder)?)
}

/// Writes a file whole or not at all, making its folder where there is none. Where the same content
/// is there already, it stays.
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

/// The folder that a file goes to.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Extensions of files that these programs write, and of photographs: a new folder with one of them was meant to be a file.
const OF_FILES: &str = "3mf cameramodel csv dsc dxf glb gltf html jpeg jpg json mtl ndjson npy obj orpc parquet pdf ply \
                        png sdf stl svg tif tiff toml txt urdf usda xml yaml yml";

/// Refuses a folder in whose place there is a file, and a new one whose name is that of a file.
pub fn check_folder(folder: &Path) -> anyhow::Result<()> {
    if let Some(file) = folder.ancestors().find(|part| part.exists() && !part.is_dir()) {
        bail!("{} is a file where a folder is needed: name a folder", file.display());
    }
    let extension = folder.extension().unwrap_or_default();
    let is_of_file = OF_FILES.split(' ').any(|known| extension.eq_ignore_ascii_case(known));
    ensure!(
        folder.exists() || !is_of_file,
        "{} looks like a file: give a folder, such as {}",
        folder.display(),
        folder.with_extension("").display()
    );
    Ok(())
}

/// Makes the folder that a file goes to, where there is none.
pub fn make_folder_of(path: &Path) -> anyhow::Result<()> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        check_folder(folder)?;
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    }
    Ok(())
}

/// A number with so many places, without a sign where nothing but zeros is left.
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
    fn nothing_is_not_negative() {
        for (value, text) in
            [(-0.0, "0.00"), (-0.004, "0.00"), (-0.006, "-0.01"), (-10.0, "-10.00")]
        {
            assert_eq!(fixed(value, 2), text);
        }
    }
}
