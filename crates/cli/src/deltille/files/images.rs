//! Input images of a command: files, folders, patterns, and lists on standard input.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};

/// Extensions of the files used from a folder; files named directly may have any extension.
const EXTENSIONS: [&str; 11] =
    ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm", "ppm", "pnm", "pbm", "webp"];

/// The error of an empty list.
const NO_LIST: &str = "-: standard input contains no file names; write one path per line";

/// Images in the order of the arguments; a list on standard input is read as it arrives.
pub struct Images {
    named: Vec<PathBuf>,
    /// Index in `named` before which the list on standard input is inserted.
    listed: Option<usize>,
}

impl Images {
    /// Expands folders and patterns.
    pub fn of(arguments: &[PathBuf]) -> anyhow::Result<Self> {
        let mut images = Self { named: Vec::new(), listed: None };
        for argument in arguments {
            if argument.as_os_str() == "-" {
                if images.listed.replace(images.named.len()).is_some() {
                    bail!("-: standard input is given twice");
                }
            } else if argument.is_dir() {
                images.named.extend(in_folder(argument)?);
            } else if argument.exists() {
                images.named.push(argument.clone());
            } else {
                images.named.extend(matching(argument)?);
            }
        }
        Ok(images)
    }

    /// Returns the images that are known in advance.
    pub fn named(&self) -> &[PathBuf] {
        &self.named
    }

    /// Returns the number of images, if known.
    pub fn count(&self) -> Option<usize> {
        self.listed.is_none().then_some(self.named.len())
    }

    /// Iterates over all images; an unreadable line ends the list with an error.
    pub fn iter(&self) -> impl Iterator<Item = anyhow::Result<PathBuf>> + Send + '_ {
        let (before, after) = self.named.split_at(self.listed.unwrap_or(0));
        let lines = self.listed.map(|_| std::io::BufReader::new(std::io::stdin()).lines());
        let mut listed = lines.into_iter().flatten().filter_map(|line| match line {
            Ok(line) if line.trim().is_empty() => None,
            Ok(line) => Some(Ok(PathBuf::from(line.trim_end_matches('\r')))),
            Err(error) => Some(Err(error).context("-: the list on standard input")),
        });
        let mut is_empty = self.listed.is_some();
        let listed = std::iter::from_fn(move || {
            let next = listed.next();
            let is_missing = std::mem::replace(&mut is_empty, false) && next.is_none();
            if is_missing { Some(Err(anyhow!(NO_LIST))) } else { next }
        });
        before.iter().cloned().map(Ok).chain(listed).chain(after.iter().cloned().map(Ok))
    }
}

/// Returns the images directly inside a folder, sorted by name; fails if there are none.
fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let images = photographs_in(folder)?;
    if images.is_empty() {
        bail!("{}: no PNG, JPEG, TIFF, BMP, PGM or WebP file in this folder", folder.display());
    }
    Ok(images)
}

/// Returns the images directly inside a folder, sorted by name; may be empty.
pub fn photographs_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder);
    let entries = entries.with_context(|| format!("cannot read {}", folder.display()))?;
    let mut images = Vec::new();
    for entry in entries {
        let path = entry.with_context(|| format!("cannot read {}", folder.display()))?.path();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        // Overlays drawn by an earlier run are not photographs.
        let drawn = path.to_string_lossy().ends_with(".overlay.jpg");
        if extension.is_some_and(|e| EXTENSIONS.contains(&e.as_str())) && !drawn && path.is_file() {
            images.push(path);
        }
    }
    images.sort();
    Ok(images)
}

/// Returns the files that match a pattern with `*`, `?` or `[…]`. Other arguments are returned unchanged; errors are
/// reported when they are opened.
fn matching(argument: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let Some(pattern) = argument.to_str().filter(|text| text.contains(['*', '?', '['])) else {
        return Ok(vec![argument.to_owned()]);
    };
    let paths = glob::glob(pattern).with_context(|| format!("{pattern}: invalid pattern"))?;
    let images: Vec<PathBuf> = paths.flatten().filter(|path| path.is_file()).collect();
    if images.is_empty() {
        bail!("{pattern}: no file matches");
    }
    Ok(images)
}

/// Returns the stem of an image's result files.
pub fn stem(image: &Path) -> anyhow::Result<String> {
    match image.file_stem() {
        Some(stem) => Ok(stem.to_string_lossy().into_owned()),
        None => bail!("{} is not a valid file name", image.display()),
    }
}

/// Unique stems of result files, one per image.
#[derive(Default)]
pub struct Stems {
    taken: BTreeMap<String, PathBuf>,
}

impl Stems {
    /// Returns the stem of an image's result files; fails if another image has the same.
    pub fn claim(&mut self, image: &Path) -> anyhow::Result<String> {
        let stem = stem(image)?;
        if let Some(other) = self.taken.insert(stem.clone(), image.to_owned()) {
            bail!(
                "{} and {} would both be written as {stem}; process them separately with different -o folders",
                other.display(),
                image.display()
            );
        }
        Ok(stem)
    }
}
