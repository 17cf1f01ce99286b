//! Where a command's one file goes, and how it gets there whole.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use crate::export::atomic;
use crate::json;

/// The file that `-o` means: itself when it ends in the extension, else `<stem>.<extension>` in
/// that folder. A path that ends in another extension is no folder, unless it is there as one.
pub fn file(output: &Path, stem: &str, extension: &str) -> anyhow::Result<PathBuf> {
    let shown = output.display();
    if output.is_dir() {
        return Ok(output.join(format!("{stem}.{extension}")));
    }
    if output.is_file() && output.extension().is_none() {
        bail!("-o {shown}: is a file; name a folder, or a file that ends in .{extension}");
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

/// Prints a result; a reader that has gone away (`| head`) is not an error.
pub fn print(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to the standard output")
        }
        _ => Ok(()),
    }
}

/// Prints a line, [`shown`], and returns from the function where that fails.
macro_rules! say {
    ($($argument:tt)*) => {
        $crate::cli::output::print(&format!(
            "{}\n",
            $crate::words::shown(&format!($($argument)*))
        ))?
    };
}
pub(crate) use say;

/// Prints a line on standard error, [`shown`].
macro_rules! tell {
    ($($argument:tt)*) => {
        eprintln!("{}", $crate::words::shown(&format!($($argument)*)))
    };
}
pub(crate) use tell;

/// Refuses to write a JSON of some schema, or anything else, over a JSON of another kind: it only
/// has the same name, and may be all that its owner has of a target or a calibration.
pub fn check_replaced(path: &Path, schema: Option<&str>) -> anyhow::Result<()> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
        return Ok(());
    }
    let there = std::fs::read(path).ok().and_then(|text| json::schema(&text).ok().flatten());
    match there {
        Some(there) if schema.map(json::kind) != Some(json::kind(&there)) => bail!(
            "{} holds {there}, which would be lost: choose another place to write to",
            path.display()
        ),
        _ => Ok(()),
    }
}

/// The same for a content that is there already.
pub fn check_replaced_by(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    check_replaced(path, json::schema(content).ok().flatten().as_deref())
}

/// Writes a file whole or not at all, making its folder where there is none.
pub fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    check_replaced_by(path, content)?;
    make_folder_of(path)?;
    Ok(atomic::write(path, |file| file.write_all(content))?)
}

/// The folder that a file goes to.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Refuses a folder in whose place there is a file.
pub fn check_folder(folder: &Path) -> anyhow::Result<()> {
    match folder.ancestors().find(|part| part.is_file()) {
        Some(file) => bail!("{} is a file where a folder is needed: name a folder", file.display()),
        None => Ok(()),
    }
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
