//! The files of a target, written all or none.

use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::atomic::Ordering;

use anyhow::{Context, anyhow, bail};

use crate::artwork::Artwork;
use crate::cli::interrupt;
use crate::cli::output;
use crate::cli::run::{Interrupted, message};
use crate::export::{atomic, pdf, png, sheet_file_name, svg};

/// Writes one file to a path.
type Writer = dyn Fn(&Path) -> anyhow::Result<()>;

/// A file to be written: its name, and what writes it.
pub struct File {
    name: String,
    write: Box<Writer>,
}

impl File {
    /// A file of that name, written by `write`.
    pub fn new(name: String, write: impl Fn(&Path) -> anyhow::Result<()> + 'static) -> Self {
        Self { name, write: Box::new(write) }
    }
}

/// Formats of drawn sheets.
#[derive(Clone, Copy)]
pub struct Formats {
    pub pdf: bool,
    pub svg: bool,
    pub png: bool,
}

/// A file of text.
pub fn text_file(name: String, text: String) -> File {
    bytes_file(name, text.into_bytes())
}

/// A file of bytes.
pub fn bytes_file(name: String, bytes: Vec<u8>) -> File {
    File::new(name, move |path| Ok(atomic::write(path, |out| out.write_all(&bytes))?))
}

/// The sheets of an artwork in some formats.
pub fn drawn(name: &str, artwork: Artwork, formats: Formats, dpi: u32) -> Vec<File> {
    let artwork = Rc::new(artwork);
    let mut files = Vec::new();
    if formats.pdf {
        let artwork = artwork.clone();
        let write = move |path: &Path| Ok(pdf::write(&artwork, path)?);
        files.push(File::new(format!("{name}.pdf"), write));
    }
    let count = artwork.sheets.len();
    for index in 0..count {
        if formats.svg {
            let artwork = artwork.clone();
            let write = move |path: &Path| Ok(svg::write(&artwork, index, path)?);
            files.push(File::new(sheet_file_name(name, index, count, "svg"), write));
        }
        if formats.png {
            let (artwork, dpi) = (artwork.clone(), f64::from(dpi));
            let write = move |path: &Path| {
                Ok(png::write(&artwork.sheets[index], &artwork.title, path, dpi)?)
            };
            files.push(File::new(sheet_file_name(name, index, count, "png"), write));
        }
    }
    files
}

/// Whether a file that is to be written is one that is there already, by whatever path.
pub fn same_file(written: &Path, other: &Path) -> bool {
    let [written, other] = [written, other].map(|path| path.canonicalize().ok());
    written.is_some() && written == other
}

/// Writes all files into a folder beside their places, then moves them there: all or none.
pub fn write_all(folder: &Path, files: &[File]) -> anyhow::Result<Vec<PathBuf>> {
    let missing: Vec<&Path> =
        folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists()).collect();
    let written = write_here(folder, files);
    if written.is_err() {
        for folder in missing {
            // Only a folder that is still empty goes.
            let _ = fs::remove_dir(folder);
        }
    }
    written
}

fn write_here(folder: &Path, files: &[File]) -> anyhow::Result<Vec<PathBuf>> {
    let interrupted = interrupt::flag();
    let check = || match interrupted.load(Ordering::Relaxed) {
        true => Err(Interrupted("nothing was written")),
        false => Ok(()),
    };
    let context = || format!("-o: cannot write to {}", folder.display());
    output::check_folder(folder).context("-o")?;
    fs::create_dir_all(folder).with_context(context)?;
    let place = |file: &File| {
        let path = folder.join(&file.name);
        atomic::place(&path).with_context(|| format!("cannot write {}", path.display()))
    };
    let paths = files.iter().map(place).collect::<anyhow::Result<Vec<PathBuf>>>()?;
    if let Some(path) = paths.iter().find(|path| path.is_dir()) {
        bail!("cannot write {}: there is a folder of that name", path.display());
    }
    let staging = tempfile::Builder::new().prefix(".deltille-").tempdir_in(folder);
    let staging = staging.with_context(context)?;
    for file in files {
        check()?;
        (file.write)(&staging.path().join(&file.name)).map_err(|error| {
            // The name of the temporary folder means nothing to the user.
            let staged = staging.path().display().to_string();
            anyhow!(message(&error).replace(&staged, &folder.display().to_string()))
        })?;
    }
    check()?;
    for (file, path) in files.iter().zip(&paths).filter(|(_, path)| path.exists()) {
        let staged = fs::read(staging.path().join(&file.name));
        output::check_replaced_by(path, &staged.with_context(context)?)?;
    }
    for (file, path) in files.iter().zip(&paths) {
        let staged = staging.path().join(&file.name);
        if fs::rename(&staged, path).is_err() {
            // A link may lead to another file system.
            let content = fs::read(&staged).with_context(context)?;
            atomic::write(path, |out| out.write_all(&content))?;
        }
    }
    Ok(paths)
}
