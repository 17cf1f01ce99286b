//! Reading detections from files, folders and tables.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

use super::filming::Given;
use crate::deltille::files::detection_tables;
use crate::output::log;
use deltille::detect::Detection;
use deltille::export::detection;
use deltille::export::tables::folder;
use deltille::limits::{Limits, ReadError};
use deltille_core::words::counted;

/// Reads detection files or folders.
pub fn given(paths: &[PathBuf], limits: &Limits) -> anyhow::Result<Given> {
    let (mut different, mut foreign) = (Different::default(), Vec::new());
    let mut copies = Vec::new();
    let Places { texts, tables } = places(paths)?;
    for Place { path, is_named } in texts {
        let show = || path.display().to_string();
        let text = match limits.read_text(&path) {
            Err(ReadError::NotText { .. }) => bail!(
                "{}: this is not a text file; for an image, run `deltille detect` first",
                show()
            ),
            text => text?,
        };
        if !is_named && detection::is_foreign(&text) {
            foreign.push(path);
            continue;
        }
        let found: Detection = detection::read(&text).with_context(show)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        copies.extend(different.add((name, found), path));
    }
    for Tables { files: of_table, folder } in tables {
        // The tables repeat the JSON detections in the same folder, which would then count twice.
        if let Some(one) = folder
            .and_then(|folder| different.files.iter().find(|file| file.parent() == Some(&folder)))
        {
            log!("excluded: {}: {} contains the same data", of_table[0].display(), one.display());
            continue;
        }
        for (name, found) in of_tables(&of_table, limits)? {
            let path = of_table[0].with_file_name(&found.image);
            copies.extend(different.add((name, found), path));
        }
    }
    let Different { detections, files, .. } = different;
    if let Some((copy, first)) = copies.first() {
        let others = match copies.len() - 1 {
            0 => String::new(),
            others => format!("; {}", counted(others, "more duplicate")),
        };
        let (copy, first) = (copy.display(), first.display());
        log!("warning: {copy}: duplicate of {first}, counted once{others}");
    }
    if let Some(first) = foreign.first() {
        let count = counted(foreign.len(), "file");
        ensure!(
            !files.is_empty(),
            "{}: no .json file contains a detection; run `deltille detect` first",
            first.parent().unwrap_or(first).display()
        );
        log!("excluded: {count} in the folder without a detection, such as {}", first.display());
    }
    Ok(Given { detections, files, first: paths[0].clone() })
}

/// Whether two detections are of the same image, under any name: noise never produces identical corners.
pub fn is_same(one: &Detection, other: &Detection) -> bool {
    // Tables contain no tags.
    let corners = one.grids.iter().map(|grid| &grid.corners);
    !one.grids.is_empty() && corners.eq(other.grids.iter().map(|grid| &grid.corners))
}

/// Detections of different images, with their files.
#[derive(Default)]
struct Different {
    detections: Vec<(String, Detection)>,
    files: Vec<PathBuf>,
    /// The detections by the position of their first corner.
    by_corner: HashMap<Option<[u64; 2]>, Vec<usize>>,
}

impl Different {
    /// Adds a detection, unless it duplicates another; then returns both files.
    fn add(&mut self, found: (String, Detection), path: PathBuf) -> Option<(PathBuf, PathBuf)> {
        let first = found.1.grids.iter().find_map(|grid| grid.corners.first());
        let first = first.map(|corner| [corner.x, corner.y].map(f64::to_bits));
        let others = self.by_corner.entry(first).or_default();
        let same = others.iter().find(|&&other| is_same(&found.1, &self.detections[other].1));
        if let Some(&same) = same {
            return Some((path, self.files[same].clone()));
        }
        others.push(self.files.len());
        self.detections.push(found);
        self.files.push(path);
        None
    }
}

/// Reads the detections in tables, in the order that their JSON files would have.
fn of_tables(files: &[PathBuf], limits: &Limits) -> anyhow::Result<Vec<(String, Detection)>> {
    let pictures = detection_tables::read(files, limits)?;
    let all = pictures.len();
    let found: Vec<Detection> =
        pictures.into_iter().filter_map(|picture| picture.found.ok()).collect();
    if found.len() < all {
        let unread = counted(all - found.len(), "image");
        let folder = files[0].parent().unwrap_or(&files[0]);
        log!("excluded: {unread} marked as unreadable in the tables in {}", folder.display());
    }
    let stem = |image: &str| {
        let stem = Path::new(image).file_stem();
        stem.map_or_else(|| image.to_owned(), |stem| stem.to_string_lossy().into_owned())
    };
    let stems: BTreeSet<String> = found.iter().map(|found| stem(&found.image)).collect();
    let are_told_apart = stems.len() == found.len();
    // If images in several folders have the same name, the folder becomes part of it.
    let name = |found: &Detection| {
        let image = &found.image;
        let stem = stem(image);
        if are_told_apart {
            stem
        } else {
            Path::new(image).with_file_name(stem).display().to_string()
        }
    };
    let mut named: Vec<(String, Detection)> =
        found.into_iter().map(|found| (name(&found), found)).collect();
    named.sort_by_cached_key(|(name, found)| {
        (PathBuf::from(format!("{name}.json")), found.image.clone())
    });
    Ok(named)
}

/// Possible detection files.
struct Places {
    texts: Vec<Place>,
    tables: Vec<Tables>,
}

/// A detection file.
struct Place {
    path: PathBuf,
    /// Named directly, not found in a named folder.
    is_named: bool,
}

/// Table files that belong together.
struct Tables {
    files: Vec<PathBuf>,
    /// The named folder, if the files themselves were not named.
    folder: Option<PathBuf>,
}

fn places(paths: &[PathBuf]) -> anyhow::Result<Places> {
    let (mut texts, mut tables) = (Vec::new(), Vec::new());
    let mut named: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            let files = folder::files(path)?;
            let inside = in_folder(path)?;
            let show = path.display();
            ensure!(
                !(files.is_empty() && inside.is_empty()),
                "{show}: no photograph and no detection (.json or .parquet) in this folder"
            );
            texts.extend(inside.into_iter().map(|path| Place { path, is_named: false }));
            if !files.is_empty() {
                tables.push(Tables { files, folder: Some(path.clone()) });
            }
        } else if folder::is_named(path) {
            let both = [Some(path.clone()), folder::beside(path)];
            for file in both.into_iter().flatten() {
                if !named.contains(&file) {
                    named.push(file);
                }
            }
        } else {
            texts.push(Place { path: path.clone(), is_named: true });
        }
    }
    if !named.is_empty() {
        tables.push(Tables { files: named, folder: None });
    }
    Ok(Places { texts, tables })
}

/// Returns the JSON files of a folder, sorted by name.
fn in_folder(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let show = || format!("cannot read {}", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(show)? {
        let path = entry.with_context(show)?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
