//! Output files of a command: either all are written, or none.

use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, anyhow, bail, ensure};

use crate::output::{self, Overwrite, log};
use crate::run::{Interrupted, message};
use crate::{interrupt, progress};
use deltille::artwork::Artwork;
use deltille::export::kind::Kind;
use deltille::export::staging::{Staging, same_content};
use deltille::export::{ExportError, atomic, pdf, png, sheet_file_name, svg};
use deltille::target_file::lost_board;
use deltille::targets;

/// Writes one file to a path.
type Writer = dyn Fn(&Path) -> anyhow::Result<()>;

/// An output file: its name, and the function that writes it.
pub struct File {
    name: String,
    kind: Kind,
    write: Box<Writer>,
}

impl File {
    /// Creates a file with this name and kind, written by `write`.
    pub fn new(
        name: String,
        kind: Kind,
        write: impl Fn(&Path) -> anyhow::Result<()> + 'static,
    ) -> Self {
        Self { name, kind, write: Box::new(write) }
    }
}

/// Formats of drawn sheets.
#[derive(Clone, Copy)]
pub struct Formats {
    pub pdf: bool,
    pub svg: bool,
    pub png: bool,
}

/// Creates a text file.
pub fn text_file(name: String, text: String) -> File {
    bytes_file(name, text.into_bytes())
}

/// Creates a binary file.
pub fn bytes_file(name: String, bytes: Vec<u8>) -> File {
    let kind = Kind::of(&bytes);
    File::new(name, kind, move |path| Ok(atomic::write(path, |out| out.write_all(&bytes))?))
}

/// Creates the files of an artwork in the given formats.
pub fn drawn(name: &str, artwork: Artwork, formats: Formats, dpi: u32) -> Vec<File> {
    let artwork = Rc::new(artwork);
    let mut files = Vec::new();
    if formats.pdf {
        let artwork = artwork.clone();
        let write = move |path: &Path| Ok(pdf::write(&artwork, path)?);
        files.push(File::new(format!("{name}.pdf"), Kind::own_pdf(), write));
    }
    let count = artwork.sheets.len();
    for index in 0..count {
        if formats.svg {
            let artwork = artwork.clone();
            let write = move |path: &Path| Ok(svg::write(&artwork, index, path)?);
            let kind = Kind::of(svg::HEAD.as_bytes());
            files.push(File::new(sheet_file_name(name, index, count, "svg"), kind, write));
        }
        if formats.png {
            let (artwork, dpi) = (artwork.clone(), f64::from(dpi));
            let write = move |path: &Path| {
                let written = png::write(&artwork.sheets[index], &artwork.title, path, dpi);
                written.map_err(|error| match error {
                    ExportError::TooLarge { .. } => anyhow!(error).context("--dpi"),
                    _ => anyhow!(error),
                })
            };
            let name = sheet_file_name(name, index, count, "png");
            files.push(File::new(name, Kind::own_printed_png(), write));
        }
    }
    files
}

/// Whether the paths of an output file and of an existing file refer to the same file.
pub fn same_file(written: &Path, other: &Path) -> bool {
    let [written, other] = [written, other].map(|path| path.canonicalize().ok());
    written.is_some() && written == other
}

/// Rejects outputs in a folder that would replace a file that the command reads, even with `--force`.
pub fn keep_inputs(folder: &Path, files: &[File], inputs: &[PathBuf]) -> anyhow::Result<()> {
    let is_read = |path: &PathBuf| inputs.iter().any(|input| same_file(path, input));
    match files.iter().map(|file| folder.join(&file.name)).find(is_read) {
        Some(path) => bail!("-o: {} is read by this command; use another name", path.display()),
        None => Ok(()),
    }
}

/// Returns a placeholder JSON of a schema, for [`check_places`].
pub fn sample_of(schema: &str) -> String {
    format!("{{\"schema\": \"{schema}\"}}")
}

/// Rejects outputs that would replace a folder, or a file of another kind. Commands that run long call this first,
/// with placeholders.
pub fn check_places(folder: &Path, files: &[File], overwrite: Overwrite) -> anyhow::Result<()> {
    output::check_folder(folder).context("-o")?;
    files.iter().try_for_each(|file| {
        let path = folder.join(&file.name);
        let show = || format!("cannot write {}", path.display());
        atomic::check_place(&path).with_context(show)?;
        ensure!(!path.is_dir(), "{}: it is a folder", show());
        overwrite.check(&path, &file.kind)
    })
}

/// Writes all files, or none; returns their paths under their final names. See
/// [`staging`](deltille::export::staging).
pub fn write_all(
    folder: &Path,
    files: &[File],
    overwrite: Overwrite,
) -> anyhow::Result<Vec<PathBuf>> {
    Staged::new(folder, files, overwrite)?.commit()
}

/// Files written under temporary names, to be moved into place together at the end. If dropped before, they leave
/// nothing behind.
pub struct Staged<'a> {
    folder: &'a Path,
    files: &'a [File],
    overwrite: Overwrite,
    staging: Staging,
}

impl<'a> Staged<'a> {
    /// Writes the files under temporary names.
    pub fn new(folder: &'a Path, files: &'a [File], overwrite: Overwrite) -> anyhow::Result<Self> {
        check_places(folder, files, overwrite)?;
        interrupt::set_status("nothing was written");
        let staging = Staging::new(folder).with_context(|| cannot_write(folder, files))?;
        let staged = staging.files();
        let bar = progress::bar(files.len() as u64, "files");
        let written = files.iter().try_for_each(|file| {
            check_interrupt()?;
            bar.set_message(file.name.clone());
            (file.write)(&staged.join(&file.name)).map_err(|error| {
                // The name of the temporary folder means nothing to the user.
                let staged = staged.display().to_string();
                anyhow!(message(&error).replace(&staged, &folder.display().to_string()))
            })?;
            bar.inc(1);
            Ok(())
        });
        bar.finish_and_clear();
        written.and_then(|()| check_interrupt())?;
        Ok(Self { folder, files, overwrite, staging })
    }

    /// Moves all files into place.
    pub fn commit(self) -> anyhow::Result<Vec<PathBuf>> {
        let Self { folder, files, overwrite, staging } = self;
        // Drawing takes a while, and existing files may have changed.
        check_places(folder, files, overwrite)?;
        let staged = staging.files();
        for file in files.iter().filter(|_| !overwrite.is_forced()) {
            file.check_board(folder, &staged)?;
        }
        let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
        let replaced = files.iter().filter_map(|file| file.replaced(folder, &staged, &names));
        let mut replaced: Vec<String> = replaced.collect();
        if replaced.is_empty() {
            replaced.extend(textures_replaced(folder, &staged, &names));
        }
        staging.commit().with_context(|| cannot_write(folder, files))?;
        interrupt::set_status("the files are complete, but not all were verified");
        replaced.iter().for_each(|line| log!("{line}"));
        Ok(files.iter().map(|file| folder.join(&file.name)).collect())
    }
}

/// Names the first of the files, because a folder alone may not be what the user typed.
fn cannot_write(folder: &Path, files: &[File]) -> String {
    let first = files.first().map_or(folder.to_owned(), |file| folder.join(&file.name));
    format!("-o: cannot write {}", first.display())
}

fn check_interrupt() -> anyhow::Result<()> {
    match interrupt::is_raised() {
        true => Err(Interrupted("nothing was written".to_owned()).into()),
        false => Ok(()),
    }
}

impl File {
    /// Refuses to replace the description of another board, because its prints cannot be used without it.
    fn check_board(&self, folder: &Path, staged: &Path) -> anyhow::Result<()> {
        if self.kind != Kind::of_schema(targets::SCHEMA) {
            return Ok(());
        }
        let path = folder.join(&self.name);
        let new = fs::read(staged.join(&self.name)).unwrap_or_default();
        match lost_board(&path, &new) {
            Some(board) => bail!(
                "{} describes another board, {board}; without it, existing prints of that board cannot be used; \
                 keep both with another --name or -o, or use --force to replace it",
                path.display()
            ),
            None => Ok(()),
        }
    }

    /// Returns a note if this file replaces a symbolic link, or a different description whose other files may remain.
    fn replaced(&self, folder: &Path, staged: &Path, written: &[&str]) -> Option<String> {
        let path = folder.join(&self.name);
        if let Ok(old) = fs::read_link(&path) {
            let (path, old) = (path.display(), old.display());
            return Some(format!(
                "{path}: replaced the symbolic link to {old}; its destination is unchanged"
            ));
        }
        let is_other = self.kind == Kind::of_schema(targets::SCHEMA)
            && path.is_file()
            && !same_content(&path, &staged.join(&self.name));
        let stem = self.name.strip_suffix(".json").filter(|_| is_other)?;
        let left = own_left(folder, written, |name| is_of_target(name, stem));
        let line = format!("{}: replaced a different description", path.display());
        Some(match left.len() {
            0 => line,
            _ => format!(
                "{line}; files of the earlier target remain: {}; remove them, or write them again",
                left.join(", ")
            ),
        })
    }
}

/// Returns a note if the written textures differ from existing ones: unused textures and mesh parts that remain, and
/// meshes that use outdated textures.
fn textures_replaced(folder: &Path, staged: &Path, written: &[&str]) -> Option<String> {
    let stem = written.iter().find_map(|name| name.strip_suffix(".json"))?;
    let is_texture = |name: &str| {
        name.strip_prefix(stem).is_some_and(|rest| rest.starts_with("-texture"))
            && is_of_target(name, stem)
    };
    let mut textures = written.iter().filter(|name| is_texture(name)).peekable();
    textures.peek()?;
    let is_other = |name: &&str| {
        let path = folder.join(name);
        path.is_file() && !same_content(&path, &staged.join(name))
    };
    let spare = own_left(folder, written, is_texture);
    if spare.is_empty() && !textures.any(is_other) {
        return None;
    }
    let is_mesh = |name: &str| {
        let extension = name.rsplit_once('.').map(|(_, extension)| extension);
        extension.is_some_and(|extension| TEXTURED.contains(&extension)) && is_of_target(name, stem)
    };
    let left = own_left(folder, written, |name| is_texture(name) || is_mesh(name));
    (!left.is_empty()).then(|| {
        format!(
            "{}: these files use textures other than those just written; remove them, or write them again",
            left.iter()
                .map(|name| folder.join(name).display().to_string())
                .collect::<Vec<_>>()
                .join(", ")
        )
    })
}

/// Extensions of files that use the texture files, or belong to one that does.
const TEXTURED: [&str; 6] = ["obj", "mtl", "sdf", "urdf", "xml", "usda"];

/// Returns the files in a folder that an earlier run of this program wrote under matching names, sorted.
fn own_left(folder: &Path, written: &[&str], is_meant: impl Fn(&str) -> bool) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut left: Vec<String> = entries
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !written.contains(&name.as_str()) && is_meant(name))
        .filter(|name| fs::read(folder.join(name)).is_ok_and(|text| Kind::of(&text).is_own()))
        .collect();
    left.sort();
    left
}

/// Whether a file name is one that is written for the target with this stem.
fn is_of_target(name: &str, stem: &str) -> bool {
    let Some((part, extension)) = name.strip_prefix(stem).and_then(|rest| rest.rsplit_once('.'))
    else {
        return false;
    };
    let is_page = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let is_part = match part.strip_prefix('-') {
        None => part.is_empty(),
        Some(part) => {
            let is_texture = part.strip_prefix("texture-").is_some_and(is_page);
            let is_other = ["texture", "skeleton", "panels", "net", "laser"].contains(&part);
            is_page(part) || is_texture || is_other
        }
    };
    is_part
        && (TEXTURED.contains(&extension)
            || ["pdf", "svg", "png", "dsc", "glb", "stl", "dxf", "3mf"].contains(&extension))
}

#[cfg(test)]
mod tests {
    use super::is_of_target;

    #[test]
    fn files_of_a_target_are_recognized_by_name() {
        for name in [
            "a.pdf",
            "a-12.svg",
            "a-texture.png",
            "a-texture-2.png",
            "a-2.obj",
            "a.usda",
            "a-net.dxf",
            "a-laser.svg",
            "a.dsc",
        ] {
            assert!(is_of_target(name, "a"), "{name}");
        }
        for name in ["a.json", "b.pdf", "ab.pdf", "a-b.pdf", "a-.pdf", "a-view.png", "a"] {
            assert!(!is_of_target(name, "a"), "{name}");
        }
    }
}
